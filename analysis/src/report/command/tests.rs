use std::fs;

use missions::waste::data::{default_scenario, default_setup};
use run_log::recorder::Folder;
use run_log::{RunFile, Table};
use scenario::Scenario;
use tempfile::TempDir;

use super::*;
use crate::{testkit, visit};
use in_process::Team;

/// The files that contain no figures.
const NUMBERS: [&str; 5] = [
    "metrics.tex",
    "plot.py",
    "robots.csv",
    "stints.csv",
    "tasks.csv",
];

const FILES: &str = "every-reported.svg gantt.svg map-by-robot.svg map.svg mission.svg report.html robot-blue.svg \
    robot-gold.svg robot-green.svg task-0-find-locations-applicable.svg task-0-find-locations.svg \
    task-1-move-spill-top.svg task-2-move-spill-bottom.svg task-3-report-progress.svg";

/// Returns a folder with the log of the first 80 s of the default mission.
fn run(log: LogLevel) -> TempDir {
    run_of("alliance", log)
}

fn run_of(allocator: &str, log: LogLevel) -> TempDir {
    run_until(allocator, 80.0, log)
}

fn run_until(allocator: &str, limit_s: f64, log: LogLevel) -> TempDir {
    let folder = TempDir::new().unwrap();
    let scenario = Scenario {
        limit_s,
        allocator: Some(allocator.to_owned()),
        ..default_scenario()
    };
    let sink = Folder::create(folder.path()).unwrap();
    let team = Team::new(testkit::setup(scenario), log, sink).unwrap();
    team.run().unwrap();
    folder
}

/// Returns the file names of a folder in one line, without [`NUMBERS`].
fn files(folder: &Path) -> String {
    let entries = fs::read_dir(folder).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names
        .filter(|name| !NUMBERS.contains(&name.as_str()))
        .collect();
    names.sort();
    names.join(" ")
}

fn reported(folder: &Path, out: &Path) -> anyhow::Result<Vec<String>> {
    report(folder, out, &with_svg())
}

/// Returns options with a file for each figure.
fn with_svg() -> FigureOptions {
    FigureOptions {
        svg: true,
        ..FigureOptions::default()
    }
}

#[test]
fn a_page_that_needs_no_other_file() {
    let folder = run(LogLevel::Full);
    let out = folder.path().join("elsewhere/report");
    assert_eq!(reported(folder.path(), &out).unwrap(), [""; 0]);
    assert_eq!(files(&out), FILES);
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert_eq!(page.matches("<svg ").count(), 13);
    let place = |text: &str| page.find(text).unwrap();
    assert!(place("id=\"gantt\"") < place(">outcome<"));
    assert!(place(">Figures</h2>") < place("id=\"map\""));
    // Links of the contents stay in the page.
    let page = page.replace("href=\"#", "");
    let page = page.replace("http://www.w3.org/2000/svg", "");
    for reference in ["http", "src=", "href=", "url(", "@import"] {
        assert!(!page.contains(reference), "{reference}");
    }
}

#[test]
fn figures_have_files_only_on_request() {
    let folder = run(LogLevel::Full);
    let out = folder.path().join("report");
    let notes = report(folder.path(), &out, &FigureOptions::default()).unwrap();
    assert_eq!(notes, [""; 0]);
    assert_eq!(files(&out), "report.html");
    let stints = fs::read_to_string(out.join("stints.csv")).unwrap();
    let first = "task,robot,from_s,to_s,color\nfind-locations,blue,";
    assert!(stints.starts_with(first), "{stints}");
    assert!(stints.lines().nth(1).unwrap().ends_with(",#1a78be"));
    for name in NUMBERS {
        assert!(out.join(name).metadata().unwrap().len() > 0, "{name}");
    }
    let tables = fs::read_to_string(out.join("metrics.tex")).unwrap();
    for row in [
        "robot & present, s & idle",
        "gold & 80.0 & ",
        "move-spill(top) & ",
    ] {
        assert!(tables.contains(row), "{tables}");
    }
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert_eq!(page.matches("<svg ").count(), 13);
    assert!(!page.contains("on request"));
    let look = FigureOptions {
        pdf: true,
        only: vec!["map".to_owned()],
        ..FigureOptions::default()
    };
    report(folder.path(), &out, &look).unwrap();
    assert_eq!(files(&out), "map.pdf map.svg report.html");
}

#[test]
fn a_torn_log_of_a_killed_run_is_reported_and_that_of_an_ended_run_is_refused() {
    for (allocator, table) in [
        ("alliance", "motivations.csv"),
        ("nearest", "allocation.csv"),
    ] {
        let folder = run_of(allocator, LogLevel::Full);
        let table = folder.path().join(table);
        let bytes = fs::read(&table).unwrap();
        fs::write(&table, &bytes[..bytes.len() / 2]).unwrap();
        let refused = reported(folder.path(), &folder.path().join("report")).unwrap_err();
        let refused = format!("{refused:#}");
        assert!(refused.contains("the log is damaged: "), "{refused}");
        let run = folder.path().join("run.json");
        let mut json: serde_json::Value = serde_json::from_slice(&fs::read(&run).unwrap()).unwrap();
        (json["outcome"], json["hash"]) = ("running".into(), serde_json::Value::Null);
        fs::write(&run, json.to_string()).unwrap();
        let log = RunLog::open(folder.path(), &Registry::built_in().vocabulary()).unwrap();
        let end = History::read(&log).unwrap().end;
        assert_eq!(end.0, log.last.unwrap().now.0 + 50);
        assert!((10_000..70_000).contains(&end.0), "{allocator}: {end}");
        reported(folder.path(), &folder.path().join("report")).unwrap();
    }
}

/// Reads a complete table with the columns of an older version.
#[test]
fn a_table_with_other_columns_is_refused_in_one_line() {
    let old = "t_ms,robot,task,utility,holder,state\n0,blue,find-locations,0.5,,hibernating\n";
    let tables = [(Table::Allocation, old.as_bytes().to_vec())];
    let run = RunFile {
        setup: default_setup(1),
        ..visit::run_file()
    };
    let log = RunLog::from_tables(Path::new("runs/old"), run, tables.into());
    let error = History::read(&log).unwrap_err().to_string();
    let at = "runs/old/allocation.csv: CSV deserialize error: record 1 (line: 2, byte: 37)";
    assert_eq!(error, format!("{at}: missing field `behavior_set`"));
}

#[test]
fn a_folder_without_a_run_is_refused_in_one_line() {
    let nothing = TempDir::new().unwrap();
    let out = nothing.path().join("report");
    let error = reported(nothing.path(), &out).unwrap_err();
    assert!(!out.exists());
    let name = nothing.path().display();
    assert_eq!(
        format!("{error:#}"),
        format!("{name} is not the folder of a run: it has no run.json")
    );
}

#[test]
fn a_replayed_run_has_the_figures_of_its_full_log() {
    for (allocator, level) in [
        ("alliance", LogLevel::Off),
        ("alliance", LogLevel::Summary),
        ("nearest", LogLevel::Summary),
    ] {
        let reported = |level: LogLevel| {
            let folder = run_of(allocator, level);
            let out = folder.path().join("report");
            let notes = reported(folder.path(), &out).unwrap();
            let names = files(&out);
            let names = names.split(' ').filter(|name| name.ends_with(".svg"));
            let figures = names.map(|name| (fs::read(out.join(name)).unwrap(), name.to_owned()));
            (notes, figures.collect::<Vec<_>>())
        };
        let (full, replayed) = (reported(LogLevel::Full), reported(level));
        let note = format!(
            "the run was logged with --log {}, so it was replayed for this report",
            level.as_str()
        );
        assert_eq!((full.0, replayed.0), (Vec::new(), vec![note]));
        assert!(full.1 == replayed.1, "{allocator}, {}", level.as_str());
    }
}

/// The tables of every tick of a large log are not read. A short run is replayed for them.
#[test]
fn tables_above_the_bound_are_not_read() {
    for level in [LogLevel::Full, LogLevel::Compact] {
        let folder = run(level);
        let shown = |bytes_max| {
            let (look, mut notes) = (FigureOptions::default(), Vec::new());
            let shown = Shown::of(folder.path(), bytes_max, &look, &mut notes).unwrap();
            (shown, notes)
        };
        let ((whole, none), (part, notes)) = (shown(u64::MAX), shown(100_000));
        let size = DecimalBytes(part.logged.unread.unwrap());
        let note = format!("the run has a log of {size}, so it was replayed for this report");
        assert_eq!((none, notes), (Vec::new(), vec![note]));
        assert!(part.logged.table(Table::Poses).is_empty());
        assert_eq!(part.logged.last, whole.logged.last);
        let metrics = [part.metrics, whole.metrics].map(|metrics| format!("{metrics:?}"));
        assert_eq!(metrics[0], metrics[1]);
        let unread = History::read(&part.logged).unwrap();
        assert!(unread.is_summary && !whole.history.is_summary);
        // Damage of the other tables is found.
        let events = folder.path().join("events.csv");
        let bytes = fs::read(&events).unwrap();
        fs::write(&events, &bytes[..bytes.len() / 2]).unwrap();
        let refused = open_undamaged(folder.path(), 100_000).unwrap_err();
        let refused = format!("{refused:#}");
        assert!(
            refused.contains("events.csv agrees with its seals for "),
            "{refused}"
        );
    }
}

/// A summary contains the same work as a full log. The report says what it does not contain.
#[test]
fn a_summary_alone_has_the_same_work_and_names_what_it_lacks() {
    for allocator in ["alliance", "cbba"] {
        let read = |level| {
            let folder = run_of(allocator, level);
            let log = RunLog::open(folder.path(), &Registry::built_in().vocabulary()).unwrap();
            let history = History::read(&log).unwrap();
            let metrics = Metrics::compute(&history, &log.run);
            (log.run.clone(), history, metrics)
        };
        let ((_, full, of_full), (run, summary, metrics)) =
            (read(LogLevel::Full), read(LogLevel::Summary));
        let work = |history: &History, metrics: &Metrics| {
            let robots = history.robots.iter().map(|robot| {
                let sets = robot.sets.iter();
                let sets = sets.map(|set| (set.active.clone(), set.waiting.clone()));
                (robot.present.clone(), sets.collect::<Vec<_>>())
            });
            let robots = robots.collect::<Vec<_>>();
            let tasks = metrics.tasks.iter().map(|task| &task.duplicate);
            let tasks = tasks.collect::<Vec<_>>();
            let (stints, takeovers) = (&metrics.stints, &metrics.takeovers);
            format!(
                "{robots:?}\n{tasks:?}\n{stints:?}\n{takeovers:?}\n{:?}",
                metrics.robots
            )
        };
        assert_eq!(
            work(&full, &of_full),
            work(&summary, &metrics),
            "{allocator}"
        );
        assert!(summary.is_summary && !full.is_summary);
        let wanted = FigureSelection {
            sheet: SizeOptions::default().sheet().unwrap(),
            from_s: None,
            to_s: None,
            end_s: 80.0,
            only: Vec::new(),
            rooms: Vec::new(),
            max_bytes: None,
        };
        let DrawnFigures { figures, .. } = figures(&summary, &metrics, &wanted).unwrap();
        let names = figures.iter().map(|figure| figure.name.as_str());
        assert_eq!(
            names.collect::<Vec<_>>(),
            ["gantt", "mission", "every-reported"]
        );
        assert!(!figures[0].svg.contains("orphan"));
        let (text, _) = page(&RunSection {
            run: &run,
            history: &summary,
            metrics: &metrics,
            figures,
            undrawn: Vec::new(),
            made: RunOrigin::of(Path::new("run"), Path::new("run/report"), &wanted),
        });
        assert!(text.contains("<td>unknown</td>"));
        assert!(
            !text.contains("was without a productive robot"),
            "{allocator}"
        );
    }
}

#[test]
fn two_runs_stand_side_by_side() {
    let full = run(LogLevel::Full);
    let short = run_until("nearest", 40.0, LogLevel::Full);
    let out = full.path().join("two");
    let folders = [&full, &short].map(|folder| folder.path().to_owned());
    let notes = report_of_two(folders.each_ref(), &out, &with_svg()).unwrap();
    assert_eq!(notes, [""; 0]);
    assert_eq!(files(&out), "a b report.html");
    assert_eq!(files(&out.join("a")), FILES.replace(" report.html", ""));
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    // The verdicts come first, then the setup difference, then the first tick that differs.
    let cause = page.find("scenario: allocator: ").unwrap();
    let verdicts: Vec<_> = page.match_indices("<ul class=\"answer\"><li>").collect();
    assert_eq!(verdicts.len(), 2);
    assert!(verdicts.iter().all(|(place, _)| *place < cause));
    assert!(cause < page.find("differs first in tick").unwrap());
    assert!(cause < page.find("id=\"a-gantt\"").unwrap());
    assert!(page.find("id=\"a-gantt\"") < page.find("id=\"b-gantt\""));
    let differs = |fact: &str| page.contains(&format!("<tr class=\"differs\"><td>{fact}</td>"));
    for same in ["unscripted stalls or losses", "version"] {
        assert!(
            !differs(same) && page.contains(&format!("><td>{same}")),
            "{same}"
        );
    }
    for other in ["hash", "scenario", "makespan"] {
        assert!(differs(other), "{other}");
    }
    // Equal times have equal positions in both figures.
    for side in SIDES {
        let gantt = fs::read_to_string(out.join(side).join("gantt.svg")).unwrap();
        assert!(gantt.contains(">\n80\n</text>"), "{side}");
    }
    let error = report_of_two([&folders[0], &out], &out, &FigureOptions::default());
    let error = error.unwrap_err().to_string();
    assert!(
        error.starts_with(&format!("{} is not", out.display())),
        "{error}"
    );
}

#[test]
fn a_part_of_a_run_and_only_some_figures() {
    let folder = run(LogLevel::Full);
    let look = FigureOptions {
        only: vec!["gantt".to_owned(), "room-at-50s".to_owned()],
        from: Some(40.0),
        to: Some(60.0),
        snapshot: vec![50.02],
        size: SizeOptions {
            width: Some(500.0),
            font_size: Some(9.0),
        },
        ..FigureOptions::default()
    };
    let out = folder.path().join("report");
    report(folder.path(), &out, &look).unwrap();
    assert_eq!(files(&out), "gantt.svg report.html room-at-50s.svg");
    for name in ["gantt.svg", "room-at-50s.svg"] {
        let svg = fs::read_to_string(out.join(name)).unwrap();
        assert!(svg.starts_with("<svg width=\"500\""), "{name}: {svg}");
    }
    let gantt = fs::read_to_string(out.join("gantt.svg")).unwrap();
    let labels = [30, 40, 60, 70].map(|at| gantt.contains(&format!(">\n{at}\n</text>")));
    assert_eq!(labels, [false, true, true, false]);
    let room = fs::read_to_string(out.join("room-at-50s.svg")).unwrap();
    for robot in ["blue", "gold", "green", ": "] {
        assert!(room.contains(robot), "{robot}");
    }
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert_eq!(page.matches("<svg ").count(), 2);
    assert!(page.contains("from 40 s to 60 s"));
}

#[test]
fn an_impossible_option_is_refused_in_one_line() {
    let folder = run(LogLevel::Full);
    let refusal = |change: fn(&mut FigureOptions)| {
        let mut look = FigureOptions::default();
        change(&mut look);
        let out = TempDir::new().unwrap();
        let error = report(folder.path(), out.path(), &look).unwrap_err();
        format!("{error:#}")
    };
    let none = refusal(|look| look.only = vec!["gant".to_owned()]);
    let start =
        "--only: there is no figure 'gant'; did you mean 'gantt'? (there are gantt, mission, ";
    assert!(none.starts_with(start), "{none}");
    let answers = [
        refusal(|look| look.from = Some(80.0)),
        refusal(|look| (look.from, look.to) = (Some(50.0), Some(40.0))),
        refusal(|look| look.snapshot = vec![80.05]),
        refusal(|look| look.size.width = Some(300.0)),
        refusal(|look| look.size.width = Some(f64::NAN)),
        refusal(|look| look.size.font_size = Some(2.0)),
    ];
    insta::assert_snapshot!(answers.join("\n"), @r"
    --from 80: the run ended at 80 s
    --to 40: must be later than --from, 50 s
    --snapshot 80.05: the run ended at 80.000 s
    --width 300: must be from 396 (at font size 12 px) to 10000
    --width NaN: must be from 396 (at font size 12 px) to 10000
    --font-size 2: must be from 4 to 72
    ");
}
