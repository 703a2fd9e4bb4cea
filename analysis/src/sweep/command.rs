//! Command line, output files and terminal output of `alliance sweep`.

use std::path::Path;
use std::process::ExitCode;

use clap::Args;
use comfy_table::Table;
use terminal::{counted, stderr_line};
use world_server::mission_args::Known;

use super::execution::{Arguments, FAILURES, PlanCommand, repeat_command};
use super::figures::{draw, numbers};
use super::journal::Header;
use super::page::{LATEX, Page};
use super::results::results_table;
use super::run::{FaultCount, Row, RunResult};
use super::statistics::Estimate;
use super::summary::{Summary, by_column, by_condition, failed_by_reason, faults_by_kind};
use crate::controllers::ControllerFiles;
use crate::figures::canvas::Sheet;
use crate::figures::{Figure, files};
use crate::new_file::write_atomically;
use crate::page::number;
use crate::shell::shell_quoted;
use crate::{exit_status, table};

const FAULTS: &str = "faults";

/// The largest number of table rows and of failed runs that the terminal shows.
const SHOWN: usize = 20;

/// Run many variants of a mission with many seeds
// An interrupted sweep resumes where it stopped.
#[derive(Args, Clone, Debug)]
pub struct SweepCommand {
    #[command(flatten)]
    arguments: Arguments,
}

impl SweepCommand {
    /// Returns the controllers in Python that the plan names.
    pub fn controllers(&mut self) -> &mut ControllerFiles {
        self.arguments.controllers()
    }

    /// Runs the command. Exit status: 0 all runs are done, 1 failed runs, 2 invalid input or missing runs, 3 a file cannot be written,
    /// 130 an interruption. Incomplete missions are not failures.
    #[must_use]
    pub fn run(&self, known: &Known) -> ExitCode {
        match self.arguments.strategies() {
            Ok(Some(strategies)) => {
                exit_status("sweep", strategies.run().map(|()| ExitCode::SUCCESS), 3)
            }
            Ok(None) => self.arguments.run(known, &STUDY),
            Err(error) => exit_status("sweep", Err(error), 2),
        }
    }
}

const STUDY: PlanCommand = PlanCommand {
    name: "sweep",
    folder: "sweeps",
    prepare: |_, _| Ok(None),
    remarks: |_| Vec::new(),
    finish,
};

/// Writes and shows the results. Returns `true` if no run failed.
fn finish(
    folder: &Path,
    header: &Header,
    rows: &[Row],
    _plan: Option<&str>,
    sheet: &Sheet,
) -> anyhow::Result<bool> {
    let design = &header.design;
    results_table(design, rows).write(folder, "results")?;

    let overall = Summary::of(rows);
    let conditions = by_condition(design, rows);
    let mut figures = Vec::new();
    let columns = by_column(design, rows);
    let columns = columns.chunk_by(|a, b| a.column == b.column);
    // A chunk is never empty.
    for (number, of_column) in columns.enumerate() {
        let column = &of_column[0].column;
        let figure = Figure {
            about: Vec::new(),
            name: format!("by-{number}-{}", plain(column)),
            caption: format!(
                "The measures against {column}, separately for each class of faults and over all values of the other keys. A measure \
                 that is constant is left out. Bars are 95 % intervals. Numbers are to scale; time axes may not start at 0."
            ),
            svg: draw(of_column, sheet)?,
            numbers: Some(numbers(of_column)),
        };
        files::write(&figure, folder)?;
        figures.push(figure);
    }
    let page = Page {
        sweep: &header.sweep,
        design,
        rows,
        overall: &overall,
        conditions: &conditions,
        figures: &figures,
    };
    page.table().write_csv(folder, "summary")?;
    write_atomically(&folder.join(LATEX), page.latex().as_bytes())?;
    files::write_script(folder)?;
    let faults = page.fault_table();
    if faults.rows() > 0 {
        faults.write_csv(folder, FAULTS)?;
    }
    write_atomically(&folder.join("summary.html"), page.html().as_bytes())?;
    show(folder, header, &page);
    Ok(overall.failed == 0)
}

fn show(folder: &Path, header: &Header, page: &Page<'_>) {
    if page.conditions.len() <= SHOWN {
        stderr_line!(
            "{}\n95 % intervals: Wilson's for completion, bootstrap for medians",
            terminal_table(page).trim_fmt()
        );
    }
    let all = page.overall;
    stderr_line!(
        "{}: {} complete, {} not complete, {} failed",
        counted(all.runs, "run"),
        all.complete,
        all.runs - all.failed - all.complete,
        all.failed
    );
    let failed = page
        .rows
        .iter()
        .filter(|row| matches!(row.end, RunResult::Failed(_)));
    for row in failed.clone().take(SHOWN) {
        let scenario = folder.join(FAILURES).join(format!("{}.toml", row.run));
        let seed = header.design.seed(row.run);
        let again = repeat_command(&shell_quoted(&scenario), seed, header.check);
        stderr_line!("run {} failed; repeat it with: {again}", row.run);
    }
    if failed.count() > SHOWN {
        stderr_line!(
            "the other failed runs are in {}",
            folder.join(FAILURES).display()
        );
    }
    for (reason, runs) in failed_by_reason(page.rows) {
        stderr_line!("failed   {}: {reason}", counted(runs, "run"));
    }
    let faults = faults_by_kind(page.rows);
    if !faults.is_empty() {
        let mut all = FaultCount::default();
        for count in faults.values() {
            all.add(count);
        }
        let file = folder.join(format!("{FAULTS}.csv"));
        stderr_line!(
            "faults   {} armed, {} took effect ({}): {}",
            all.armed,
            all.hit,
            counted(faults.len(), "kind"),
            file.display()
        );
    }
    stderr_line!("rows     {}", folder.join("results.csv").display());
    stderr_line!("         {}", folder.join("results.parquet").display());
    stderr_line!("summary  {}", folder.join("summary.html").display());
}

/// Creates a table with one row per condition, with the scenario's own measure first. Intervals stand below their estimates and
/// long keys span several lines, so that the table fits a terminal.
fn terminal_table(page: &Page<'_>) -> Table {
    let settings = page.setting_columns();
    let settings = settings.iter().map(|key| key.replace('.', ".\n"));
    let own = page.primary().map(|own| own.metric.as_str());
    let lateness = page.has_lateness().then_some("lateness\nin s");
    let figures = own.into_iter().chain(["complete", "makespan\nin s"]);
    let figures = figures.chain(lateness).map(ToOwned::to_owned);
    let mut table = table::new(settings.chain(figures));
    for (cells, summary) in page.conditions {
        let (from, to) = summary.completion;
        let complete = format!(
            "{} of {}\n{:.0} – {:.0} %",
            summary.complete,
            runs(summary),
            100.0 * from,
            100.0 * to
        );
        let cells = cells.iter().map(|cell| cell.to_string());
        let own = own.and(summary.primary.as_ref());
        let own = own.map(|own| estimated(Some(own.median), number));
        let in_s = |found| estimated(found, |seconds| format!("{seconds:.1}"));
        let lateness = lateness.map(|_| match summary.without_lateness {
            0 => in_s(summary.lateness_s),
            some => format!("none in\n{}", counted(some, "run")),
        });
        let figures = own.into_iter().chain([complete, in_s(summary.makespan_s)]);
        table.add_row(cells.chain(figures).chain(lateness));
    }
    table::align_right(&mut table, page.setting_columns().len()..);
    table
}

fn runs(summary: &Summary) -> String {
    match summary.failed {
        0 => summary.runs.to_string(),
        failed => format!("{} ({failed} failed)", summary.runs),
    }
}

fn estimated(estimate: Option<Estimate>, shown: impl Fn(f64) -> String) -> String {
    match estimate {
        Some((median, (from, to))) => {
            format!("{}\n{} – {}", shown(median), shown(from), shown(to))
        }
        None => "–".to_owned(),
    }
}

fn plain(name: &str) -> String {
    let words = name.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_');
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    words.join("-")
}
