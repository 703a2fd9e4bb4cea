//! Command line of `alliance report`.

use missions::Registry;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use alliance_proto::log::{LogLevel, RunLog};
use alliance_proto::tell;
use anyhow::{Context, anyhow, bail};
use clap::Args;

use super::figures::figures;
use super::history::History;
use super::metrics::Metrics;
use super::page::page;

/// Show what happened in a run: a page with figures and metrics, for any browser, and the figures as SVG files.
#[derive(Args, Clone, Debug)]
pub struct ReportCommand {
    /// Folder of the run
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Where to write report.html and the SVG files [default: DIR/report]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

impl ReportCommand {
    /// Exit status 0, or 2 for a folder of which no report can be made.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let out = self
            .out
            .clone()
            .unwrap_or_else(|| self.folder.join("report"));
        match report(&self.folder, &out) {
            Ok(left_out) => {
                if left_out > 0 {
                    tell!(
                        "note: {left_out} figures are in their own files only, for the page would be too large"
                    );
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

/// Makes the report, and says how many figures had no room in its page.
///
/// # Errors
/// When there is no run, or no full log of one, or the page cannot be written.
pub fn report(folder: &Path, out: &Path) -> anyhow::Result<usize> {
    // The error says why by itself: its source would say it twice.
    let log = RunLog::open(folder, &Registry::of_this_program().vocabulary())
        .map_err(|error| anyhow!("{} is not the folder of a run: {error}", folder.display()))?;
    if log.run.log != LogLevel::Full {
        let level = log.run.log.as_str();
        bail!(
            "{} was logged with --log {level}; a report needs motivations and poses: run it again with --log full",
            folder.display()
        );
    }
    let history = History::read(&log).map_err(|error| anyhow!("{error}"))?;
    let metrics = Metrics::of(&history, &log.run);
    let figures = figures(&history, &metrics)?;
    let (text, left_out) = page(&log.run, &history, &metrics, &figures);

    fs::create_dir_all(out).with_context(|| format!("cannot make {}", out.display()))?;
    let write = |file: String, text: &str| {
        let path = out.join(file);
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
    };
    for figure in &figures {
        write(format!("{}.svg", figure.name), &figure.svg)?;
    }
    write("report.html".to_owned(), &text)?;
    Ok(left_out)
}

#[cfg(test)]
mod tests {
    use alliance_proto::log::{RunFile, Table};
    use alliance_proto::scenario::{Scenario, Setup};
    use missions::waste::data::{default_scenario, default_setup};
    use tempfile::TempDir;
    use world_server::recorder::Folder;

    use super::*;
    use crate::in_process::Team;
    use crate::visit;

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
        let folder = TempDir::new().unwrap();
        let scenario = Scenario {
            limit_s: 80.0,
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
        assert_eq!(report(folder.path(), &out).unwrap(), 0);
        assert_eq!(files(&out), FILES);
        let page = fs::read_to_string(out.join("report.html")).unwrap();
        assert_eq!(page.matches("<svg ").count(), FILES.len() - 1);
        let place = |text: &str| page.find(text).unwrap();
        assert!(place("id=\"gantt\"") < place("<h2>Robots"));
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
            report(folder.path(), &folder.path().join("report")).unwrap();
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
            let error = report(folder, &folder.join("report")).unwrap_err();
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
        for level in [LogLevel::Summary, LogLevel::Off] {
            let folder = run(level);
            assert_eq!(
                refusal(folder.path()),
                format!(
                    "{} was logged with --log {}; a report needs motivations and poses: run it again with --log full",
                    folder.path().display(),
                    level.as_str()
                )
            );
        }
    }
}
