//! Command line of `alliance report`.

use missions::Registry;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use alliance_proto::log::{LogLevel, RunLog};
use alliance_proto::tell;
use alliance_proto::time::{SimTime, seconds};
use anyhow::{Context, anyhow, bail};
use clap::Args;

use super::figures::canvas::{Sheet, TEXT_PX, WIDTH_PX};
use super::figures::{Figure, Room, Wanted, figures};
use super::history::History;
use super::made::Made;
use super::metrics::Metrics;
use super::page::{Part, page};
use super::page_of_two::{SIDES, page_of_two};
use super::pdf;
use crate::diff::compare;
use crate::retrace::retrace;

/// A figure is so many times as wide as its letters are high, at least: with less room names and axes would leave none for the rest.
const LEAST_LETTERS: f64 = 33.0;

/// Show what happened in a run: a page with figures and metrics, for any browser, and the figures as SVG files.
#[derive(Args, Clone, Debug)]
pub struct ReportCommand {
    /// Folder of the run
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Folder of another run, to show both side by side, with what differs first
    #[arg(value_name = "OTHER")]
    other: Option<PathBuf>,
    /// Where to write report.html and the figures [default: DIR/report; of two runs OTHER/report-of-two]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    #[command(flatten)]
    look: Look,
}

/// What of a run is shown, and how large.
#[derive(Args, Clone, Debug, Default)]
pub struct Look {
    /// Figures begin at this simulated time, such as 60s, 1.5s or 2min [default: the start]
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    pub from: Option<f64>,
    /// Figures end at this simulated time [default: the end]
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    pub to: Option<f64>,
    /// Width of the figures, px [default: 960]
    #[arg(long, value_name = "PX")]
    pub width: Option<f64>,
    /// Size of the lettering, px; lines and marks go with it [default: 12]
    #[arg(long, value_name = "PX")]
    pub font_size: Option<f64>,
    /// Only these figures, by the names of their files without ending
    #[arg(long, value_name = "FIGURE,…", value_delimiter = ',')]
    pub only: Vec<String>,
    /// The room at these simulated times, a figure for each
    #[arg(long, value_name = "TIME,…", value_delimiter = ',', value_parser = seconds)]
    pub snapshot: Vec<f64>,
    /// Each figure as PDF, too, beside its SVG
    #[arg(long)]
    pub pdf: bool,
}

impl Look {
    /// # Errors
    /// One line, when nothing can look like this.
    fn check(&self) -> anyhow::Result<()> {
        self.sheet()?;
        if self.pdf { pdf::is_there() } else { Ok(()) }
    }

    /// # Errors
    /// One line, when there would be no room for the figure in it.
    fn sheet(&self) -> anyhow::Result<Sheet> {
        let width = self.width.unwrap_or(WIDTH_PX);
        let font = self.font_size.unwrap_or(TEXT_PX);
        if !(4.0..=72.0).contains(&font) {
            bail!("--font-size {font}: must be from 4 to 72");
        }
        let least = (font * LEAST_LETTERS).ceil();
        if !(least..=10_000.0).contains(&width) {
            bail!("--width {width}: must be from {least}, with lettering of {font} px, to 10000");
        }
        Ok(Sheet::new(width, font))
    }
}

impl ReportCommand {
    /// Exit status 0, or 2 for a folder of which no report can be made, or options that ask for what is not there.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let (folder, name) = match &self.other {
            Some(other) => (other, "report-of-two"),
            None => (&self.folder, "report"),
        };
        let out = self.out.clone().unwrap_or_else(|| folder.join(name));
        let made = match &self.other {
            Some(other) => report_of_two([&self.folder, other], &out, &self.look),
            None => report(&self.folder, &out, &self.look),
        };
        match made {
            Ok(notes) => {
                for note in notes {
                    tell!("note: {note}");
                }
                tell!("report  {}", out.join("report.html").display());
                ExitCode::SUCCESS
            }
            Err(error) => {
                tell!("alliance report: {error:#}");
                ExitCode::from(2)
            }
        }
    }
}

/// A run, and what is made of it.
struct Shown {
    log: RunLog,
    rooms: Vec<Room>,
    history: History,
    metrics: Metrics,
}

impl Shown {
    fn of(folder: &Path, look: &Look, notes: &mut Vec<String>) -> anyhow::Result<Self> {
        // The error says why by itself: its source would say it twice.
        let logged = RunLog::open(folder, &Registry::of_this_program().vocabulary())
            .map_err(|error| anyhow!("{} is not the folder of a run: {error}", folder.display()))?;
        let (log, rooms) = see(logged, &look.snapshot, notes)?;
        let history = History::read(&log).map_err(|error| anyhow!("{error}"))?;
        let metrics = Metrics::of(&history, &log.run);
        Ok(Self {
            log,
            rooms,
            history,
            metrics,
        })
    }

    /// Its part of a page, with axes as long as those of a run that ended then.
    fn part(&mut self, folder: &Path, look: &Look, end: SimTime) -> anyhow::Result<Part<'_>> {
        let wanted = Wanted {
            sheet: look.sheet()?,
            from_s: look.from,
            to_s: look.to,
            end_s: end.as_secs_f64(),
            only: look.only.clone(),
            rooms: std::mem::take(&mut self.rooms),
        };
        Ok(Part {
            run: &self.log.run,
            history: &self.history,
            metrics: &self.metrics,
            figures: figures(&self.history, &self.metrics, &wanted)?,
            made: Made::of(folder, &wanted),
        })
    }
}

/// Makes the report, and says what whoever reads it should know.
///
/// # Errors
/// When there is no run, or none that could be shown, or not what was asked for, or the files cannot be written.
pub fn report(folder: &Path, out: &Path, look: &Look) -> anyhow::Result<Vec<String>> {
    look.check()?;
    let mut notes = Vec::new();
    let mut shown = Shown::of(folder, look, &mut notes)?;
    let end = shown.history.end;
    let part = shown.part(folder, look, end)?;
    let (text, left_out) = page(&part);
    tell_left_out(left_out, &mut notes);
    write_figures(out, &part.figures, look.pdf)?;
    write(&out.join("report.html"), text.as_bytes())?;
    Ok(notes)
}

/// Makes a report of two runs, side by side, and says what whoever reads it should know.
///
/// # Errors
/// As [`report`].
fn report_of_two(folders: [&PathBuf; 2], out: &Path, look: &Look) -> anyhow::Result<Vec<String>> {
    look.check()?;
    let mut notes = Vec::new();
    let mut a = Shown::of(folders[0], look, &mut notes)?;
    let mut b = Shown::of(folders[1], look, &mut notes)?;
    let difference = compare(&a.log, &b.log).map_err(|error| anyhow!("{error}"))?;
    let end = a.history.end.max(b.history.end);
    let parts = [
        a.part(folders[0], look, end)?,
        b.part(folders[1], look, end)?,
    ];
    let names = folders.map(|folder| folder.display().to_string());
    let (text, left_out) = page_of_two(&names, &parts, &difference.to_string());
    tell_left_out(left_out, &mut notes);
    for (part, side) in parts.iter().zip(SIDES) {
        write_figures(&out.join(side), &part.figures, look.pdf)?;
    }
    write(&out.join("report.html"), text.as_bytes())?;
    Ok(notes)
}

fn tell_left_out(figures: usize, notes: &mut Vec<String>) {
    if figures > 0 {
        notes.push(format!(
            "{figures} figures are in their own files only, for the page would be too large"
        ));
    }
}

/// The full log of a run, and the room at those times, s. Where either is not in the log, the run is run again.
fn see(
    logged: RunLog,
    times: &[f64],
    notes: &mut Vec<String>,
) -> anyhow::Result<(RunLog, Vec<Room>)> {
    let level = logged.run.log;
    if level == LogLevel::Full && times.is_empty() {
        return Ok((logged, Vec::new()));
    }
    let step = SimTime(logged.run.setup.scenario.step_ms);
    let wanted: Vec<SimTime> = times
        .iter()
        .map(|at| SimTime(SimTime::from_secs_f64(*at).0 / step.0 * step.0))
        .collect();
    let mut rooms = Vec::new();
    let mut end = SimTime::ZERO;
    let again = retrace(&logged, LogLevel::Full, |view| {
        end = view.now;
        if wanted.contains(&view.now) {
            rooms.push(Room { view });
        }
    })?;
    if let Some(at) = wanted.iter().find(|at| **at > end) {
        bail!("--snapshot {}: the run was over at {end}", at.as_secs_f64());
    }
    notes.extend(again.differs);
    if level == LogLevel::Full {
        return Ok((logged, rooms));
    }
    notes.push(format!(
        "logged with --log {}, so the run was run again for this",
        level.as_str()
    ));
    Ok((again.log, rooms))
}

fn write_figures(out: &Path, figures: &[Figure], with_pdf: bool) -> anyhow::Result<()> {
    fs::create_dir_all(out).with_context(|| format!("cannot make {}", out.display()))?;
    for Figure { name, svg, .. } in figures {
        write(&out.join(format!("{name}.svg")), svg.as_bytes())?;
        if with_pdf {
            let bytes = pdf::of(svg).with_context(|| name.clone())?;
            write(&out.join(format!("{name}.pdf")), &bytes)?;
        }
    }
    Ok(())
}

fn write(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use alliance_proto::log::{RunFile, Table};
    use alliance_proto::scenario::{Scenario, Setup};
    use missions::waste::data::{default_scenario, default_setup};
    use tempfile::TempDir;
    use world_server::recorder::Folder;

    use super::*;
    use crate::visit;
    use in_process::Team;

    const FILES: [&str; 14] = [
        "every-reported.svg",
        "gantt.svg",
        "map-by-robot.svg",
        "map.svg",
        "mission.svg",
        "report.html",
        "robot-blue.svg",
        "robot-gold.svg",
        "robot-green.svg",
        "task-0-find-locations-applicable.svg",
        "task-0-find-locations.svg",
        "task-1-move-spill-top.svg",
        "task-2-move-spill-bottom.svg",
        "task-3-report-progress.svg",
    ];

    /// A folder with the log of the default mission's first 80 s.
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
        let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
        let sink = Folder::create(folder.path()).unwrap();
        Team::new(setup, log, sink).unwrap().run().unwrap();
        folder
    }

    fn files(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let name = |entry: std::io::Result<fs::DirEntry>| entry.unwrap().file_name();
        let mut names: Vec<String> = entries
            .map(|entry| name(entry).into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_page_that_needs_no_other_file() {
        let folder = run(LogLevel::Full);
        let out = folder.path().join("elsewhere/report");
        assert_eq!(
            report(folder.path(), &out, &Look::default()).unwrap(),
            [""; 0]
        );
        assert_eq!(files(&out), FILES);
        let page = fs::read_to_string(out.join("report.html")).unwrap();
        assert_eq!(page.matches("<svg ").count(), FILES.len() - 1);
        let place = |text: &str| page.find(text).unwrap();
        assert!(place("id=\"gantt\"") < place(">outcome<"));
        assert!(place("<h2>Figures") < place("id=\"map\""));
        let page = page.replace("http://www.w3.org/2000/svg", "");
        for reference in ["http", "src=", "href=", "url(", "@import"] {
            assert!(!page.contains(reference), "{reference}");
        }
    }

    #[test]
    fn a_torn_log_is_reported_up_to_its_last_whole_tick() {
        for (allocator, table) in [
            ("alliance", "motivations.csv"),
            ("nearest", "allocation.csv"),
        ] {
            let folder = run_of(allocator, LogLevel::Full);
            let table = folder.path().join(table);
            let bytes = fs::read(&table).unwrap();
            fs::write(&table, &bytes[..bytes.len() / 2]).unwrap();
            let log = RunLog::open(folder.path(), &Registry::built_in().vocabulary()).unwrap();
            let end = History::read(&log).unwrap().end;
            assert_eq!(end.0, log.last.unwrap().now.0 + 50);
            assert!((10_000..70_000).contains(&end.0), "{allocator}: {end}");
            report(
                folder.path(),
                &folder.path().join("report"),
                &Look::default(),
            )
            .unwrap();
        }
    }

    /// As one is that an older program wrote: whole, and no table of this program.
    #[test]
    fn a_table_with_other_columns_is_told_in_one_line() {
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
    fn what_is_no_run_or_no_full_log_is_refused_in_one_line() {
        let refusal = |folder: &Path| {
            let error = report(folder, &folder.join("report"), &Look::default()).unwrap_err();
            assert!(!folder.join("report").exists());
            format!("{error:#}")
        };
        let nothing = TempDir::new().unwrap();
        let name = nothing.path().display();
        assert_eq!(
            refusal(nothing.path()),
            format!(
                "{name} is not the folder of a run: cannot read {name}/run.json: No such file or directory (os error 2)"
            )
        );
    }

    #[test]
    fn what_was_not_logged_is_run_again() {
        let [full, off] = [LogLevel::Full, LogLevel::Off].map(|level| {
            let folder = run(level);
            let out = folder.path().join("report");
            let notes = report(folder.path(), &out, &Look::default()).unwrap();
            let gantt = fs::read_to_string(out.join("gantt.svg")).unwrap();
            assert_eq!(files(&out), FILES);
            (notes, gantt)
        });
        assert_eq!(full.0, [""; 0]);
        let note = "logged with --log off, so the run was run again for this";
        assert_eq!(off.0, [note]);
        assert_eq!(full.1, off.1);
    }

    #[test]
    fn two_runs_stand_side_by_side() {
        let full = run(LogLevel::Full);
        let short = run_until("nearest", 40.0, LogLevel::Full);
        let out = full.path().join("two");
        let folders = [&full, &short].map(|folder| folder.path().to_owned());
        let notes = report_of_two(folders.each_ref(), &out, &Look::default()).unwrap();
        assert_eq!(notes, [""; 0]);
        assert_eq!(files(&out), ["a", "b", "report.html"]);
        let figures = FILES.into_iter().filter(|file| file.ends_with(".svg"));
        assert_eq!(files(&out.join("a")), figures.collect::<Vec<_>>());
        let page = fs::read_to_string(out.join("report.html")).unwrap();
        // What they were given comes first, then the first tick that differs.
        let said = page.find("scenario: allocator: ").unwrap();
        assert!(said < page.find("differs first in tick").unwrap());
        assert!(said < page.find("id=\"a-gantt\"").unwrap());
        assert!(page.find("id=\"a-gantt\"") < page.find("id=\"b-gantt\""));
        for same in ["stalls or losses", "version"] {
            assert!(
                !page.contains(&format!("<tr class=\"differs\"><td>{same}")),
                "{same}"
            );
            assert!(page.contains(&format!("><td>{same}")), "{same}");
        }
        for other in ["hash", "scenario", "makespan"] {
            assert!(
                page.contains(&format!("<tr class=\"differs\"><td>{other}</td>")),
                "{other}"
            );
        }
        // Of both the same time is in the same place.
        for side in SIDES {
            let gantt = fs::read_to_string(out.join(side).join("gantt.svg")).unwrap();
            assert!(gantt.contains(">\n80\n</text>"), "{side}");
        }
        let error = report_of_two([&folders[0], &out], &out, &Look::default()).unwrap_err();
        assert!(
            error
                .to_string()
                .starts_with(&format!("{} is not", out.display()))
        );
    }

    fn seen(folder: &TempDir, look: &Look) -> Result<Vec<String>, String> {
        let out = TempDir::new().unwrap();
        match report(folder.path(), out.path(), look) {
            Ok(_) => Ok(files(out.path())),
            Err(error) => Err(format!("{error:#}")),
        }
    }

    #[test]
    fn a_part_of_a_run_and_only_some_figures() {
        let folder = run(LogLevel::Full);
        let look = Look {
            only: vec!["gantt".to_owned(), "room-at-50s".to_owned()],
            from: Some(40.0),
            to: Some(60.0),
            snapshot: vec![50.02],
            width: Some(500.0),
            font_size: Some(9.0),
            ..Look::default()
        };
        let out = folder.path().join("report");
        report(folder.path(), &out, &look).unwrap();
        let names = ["gantt.svg", "report.html", "room-at-50s.svg"];
        assert_eq!(files(&out), names);
        for name in ["gantt.svg", "room-at-50s.svg"] {
            let svg = fs::read_to_string(out.join(name)).unwrap();
            assert!(svg.starts_with("<svg width=\"500\""), "{name}: {svg}");
        }
        let gantt = fs::read_to_string(out.join("gantt.svg")).unwrap();
        for (number, is_there) in [("40", true), ("60", true), ("70", false), ("30", false)] {
            assert_eq!(
                gantt.contains(&format!(">\n{number}\n</text>")),
                is_there,
                "{number}"
            );
        }
        let room = fs::read_to_string(out.join("room-at-50s.svg")).unwrap();
        for robot in ["blue", "gold", "green", ": "] {
            assert!(room.contains(robot), "{robot}");
        }
        let page = fs::read_to_string(out.join("report.html")).unwrap();
        assert_eq!(page.matches("<svg ").count(), 2);
        assert!(page.contains("from 40 s to 60 s"));
    }

    #[test]
    fn what_is_not_there_is_told_in_one_line() {
        let folder = run(LogLevel::Full);
        let asked = |change: &dyn Fn(&mut Look)| {
            let mut look = Look::default();
            change(&mut look);
            seen(&folder, &look).unwrap_err()
        };
        let none = asked(&|look| look.only = vec!["gant".to_owned()]);
        let start =
            "--only: there is no figure 'gant'; did you mean 'gantt'? (there are gantt, map, ";
        assert!(none.starts_with(start), "{none}");
        let cases = [
            (
                asked(&|look| look.from = Some(80.0)),
                "--from 80: the run was over at 80 s",
            ),
            (
                asked(&|look| (look.from, look.to) = (Some(50.0), Some(40.0))),
                "--to 40: must be later than --from, 50 s",
            ),
            (
                asked(&|look| look.snapshot = vec![80.05]),
                "--snapshot 80.05: the run was over at 80.000 s",
            ),
            (
                asked(&|look| look.width = Some(300.0)),
                "--width 300: must be from 396, with lettering of 12 px, to 10000",
            ),
            (
                asked(&|look| look.width = Some(f64::NAN)),
                "--width NaN: must be from 396, with lettering of 12 px, to 10000",
            ),
            (
                asked(&|look| look.font_size = Some(2.0)),
                "--font-size 2: must be from 4 to 72",
            ),
        ];
        for (told, expected) in cases {
            assert_eq!(told, expected);
        }
    }
}
