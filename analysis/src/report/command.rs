//! Command line of `alliance report`.

#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, bail};
use clap::Args;
use indicatif::DecimalBytes;
use missions::Registry;
use run_log::{LogLevel, MemoryLog, RunFile, RunLog};
use scenario::Setup;
use scenario::time::{SimTime, seconds};
use terminal::stderr_line;
use world_server::simulation::Simulation;

use super::comparison_page::{SIDES, page_of_two};
use super::figures::{DrawnFigures, FigureSelection, Room, figures};
use super::files;
use super::history::History;
use super::made::RunOrigin;
use super::metrics::Metrics;
use super::page::{INLINE_BYTES, RunSection, page};
use super::stream::HistorySink;
use crate::diff::compare;
use crate::figures::size::SizeOptions;
use crate::figures::{Figure, pdf};
use crate::new_file::{make_folder, write_atomically};
use crate::progress::Progress;
use crate::replay_views::retrace_into;
use crate::{LATEST, SHOWN_BYTES_MAX, exit_status, open_undamaged};

const LEFT_OUT: &str = "only in separate files because the page would be too large";
const UNDRAWN: &str =
    "not on the page because it would be too large; --only NAME draws one, --svg draws all";

/// Create a page with figures and metrics of one or two runs
#[derive(Args, Clone, Debug)]
pub struct ReportCommand {
    /// Folder of the run
    #[arg(value_name = "RUN", default_value = LATEST)]
    folder: PathBuf,
    /// Folder of another run, to show both side by side
    #[arg(value_name = "OTHER")]
    other: Option<PathBuf>,
    /// Folder of the results [default: RUN/report, or OTHER/report-of-two]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    #[command(flatten)]
    look: FigureOptions,
}

/// Options for the content and the size of figures.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Figures")]
pub struct FigureOptions {
    /// Figures begin at this simulated time, such as 60s, 1.5s or 2min [default: the start]
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    pub from: Option<f64>,
    /// Figures end at this simulated time [default: the end]
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    pub to: Option<f64>,
    #[command(flatten)]
    pub size: SizeOptions,
    /// Only these figures, also as SVG files, by file name without extension
    #[arg(long, value_name = "FIGURE,…", value_delimiter = ',')]
    pub only: Vec<String>,
    /// Additional figures of the room at these simulated times
    #[arg(long, value_name = "TIME,…", value_delimiter = ',', value_parser = seconds)]
    pub snapshot: Vec<f64>,
    /// Also write each figure as an SVG file
    #[arg(long)]
    pub svg: bool,
    /// Also write each figure as PDF and SVG files
    #[arg(long)]
    pub pdf: bool,
}

impl FigureOptions {
    /// Returns `true` if each figure is also a file. Figures that the user names are for use outside of the page.
    fn with_files(&self) -> bool {
        self.svg || self.pdf || !self.only.is_empty()
    }
}

impl ReportCommand {
    /// Writes the report. Returns exit status 0, or 2 if the folder or the options are invalid.
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
        let made = made.map(|notes| {
            for note in notes {
                stderr_line!("note: {note}");
            }
            stderr_line!("report  {}", out.join("report.html").display());
            ExitCode::SUCCESS
        });
        exit_status("report", made, 2)
    }
}

struct Shown {
    logged: RunLog,
    /// The run.json of the replay, if the log does not contain all rows.
    run: RunFile,
    rooms: Vec<Room>,
    history: History,
    metrics: Metrics,
}

impl Shown {
    /// Reads a run, without the tables of every tick if they are larger than `bytes_max`.
    fn of(
        folder: &Path,
        bytes_max: u64,
        look: &FigureOptions,
        notes: &mut Vec<String>,
    ) -> anyhow::Result<Self> {
        let logged = open_undamaged(folder, bytes_max)?;
        let (run, history, rooms) = full_history(&logged, &look.snapshot, notes)?;
        let metrics = Metrics::compute(&history, &run);
        Ok(Self {
            logged,
            run,
            rooms,
            history,
            metrics,
        })
    }

    /// Returns the page part of this run, with axes that reach to `end`.
    fn part(
        &mut self,
        folder: &Path,
        out: &Path,
        look: &FigureOptions,
        end: SimTime,
    ) -> anyhow::Result<RunSection<'_>> {
        let wanted = FigureSelection {
            sheet: look.size.sheet()?,
            from_s: look.from,
            to_s: look.to,
            end_s: end.as_secs_f64(),
            only: look.only.clone(),
            rooms: std::mem::take(&mut self.rooms),
            max_bytes: (!look.with_files()).then_some(INLINE_BYTES),
        };
        let DrawnFigures { figures, undrawn } = figures(&self.history, &self.metrics, &wanted)?;
        Ok(RunSection {
            run: &self.run,
            history: &self.history,
            metrics: &self.metrics,
            figures,
            undrawn,
            made: RunOrigin::of(folder, out, &wanted),
        })
    }
}

/// Writes the report of a run and returns notes for the reader.
///
/// # Errors
/// Returns an error when the folder contains no readable run, the options do not fit, or a file cannot be written.
pub fn report(folder: &Path, out: &Path, look: &FigureOptions) -> anyhow::Result<Vec<String>> {
    look.size.sheet()?;
    let mut notes = Vec::new();
    let mut shown = Shown::of(folder, SHOWN_BYTES_MAX, look, &mut notes)?;
    let end = shown.history.end;
    let part = shown.part(folder, out, look, end)?;
    let (text, left_out) = page(&part);
    note_figures(left_out, LEFT_OUT, &mut notes);
    note_figures(part.undrawn.len(), UNDRAWN, &mut notes);
    write_figures(out, &part.figures, look)?;
    files::write(out, part.history, part.metrics)?;
    write_atomically(&out.join("report.html"), text.as_bytes())?;
    Ok(notes)
}

/// Writes a report of two runs side by side and returns notes for the reader.
fn report_of_two(
    folders: [&PathBuf; 2],
    out: &Path,
    look: &FigureOptions,
) -> anyhow::Result<Vec<String>> {
    look.size.sheet()?;
    let mut notes = Vec::new();
    let mut a = Shown::of(folders[0], SHOWN_BYTES_MAX, look, &mut notes)?;
    let mut b = Shown::of(folders[1], SHOWN_BYTES_MAX, look, &mut notes)?;
    let difference = compare(&a.logged, &b.logged)?;
    let end = a.history.end.max(b.history.end);
    let parts = [
        a.part(folders[0], out, look, end)?,
        b.part(folders[1], out, look, end)?,
    ];
    let names = folders.map(|folder| folder.display().to_string());
    let (text, left_out) = page_of_two(&names, &parts, &difference.to_string());
    note_figures(left_out, LEFT_OUT, &mut notes);
    for (part, side) in parts.iter().zip(SIDES) {
        note_figures(part.undrawn.len(), UNDRAWN, &mut notes);
        write_figures(&out.join(side), &part.figures, look)?;
        files::write(&out.join(side), part.history, part.metrics)?;
    }
    make_folder(out)?;
    write_atomically(&out.join("report.html"), text.as_bytes())?;
    Ok(notes)
}

/// Adds a note about figures that are not on the page, if there are any.
fn note_figures(number: usize, what: &str, notes: &mut Vec<String>) {
    match number {
        0 => {}
        1 => notes.push(format!("1 figure is {what}")),
        _ => notes.push(format!("{number} figures are {what}")),
    }
}

/// The largest number of motivations or utilities for which a run without a log of every tick is replayed with all of
/// them. Above, they take minutes to hours.
const REPLAYED_ROWS_MAX: u64 = 5_000_000;

/// Returns the history of a run with its run.json, and the room at `times`, s. Replays the run if its log does not contain
/// them.
fn full_history(
    logged: &RunLog,
    times: &[f64],
    notes: &mut Vec<String>,
) -> anyhow::Result<(RunFile, History, Vec<Room>)> {
    let Setup {
        scenario, catalog, ..
    } = &logged.run.setup;
    let sets = scenario.robots.iter();
    let sets: usize = sets.map(|robot| catalog.behaviors_of(robot).count()).sum();
    let ticks = logged
        .last
        .map_or(logged.run.result.ticks, |last| last.tick + 1);
    let level = logged.run.log;
    let is_long = ticks * sets as u64 > REPLAYED_ROWS_MAX;
    let has_tables = logged.has_every_tick() || (is_long && level != LogLevel::Off);
    let mut rooms = Vec::new();
    let mut replayed = None;
    if !has_tables || !times.is_empty() {
        let step = SimTime(scenario.step_ms);
        let wanted: Vec<SimTime> = times
            .iter()
            .map(|at| SimTime(SimTime::from_secs_f64(*at).0 / step.0 * step.0))
            .collect();
        let see = |simulation: &mut Simulation| {
            if wanted.contains(&SimTime(simulation.tick() * step.0)) {
                let view = simulation.view();
                rooms.push(Room { view });
            }
        };
        let end = if has_tables || is_long {
            let level = match has_tables {
                true => LogLevel::Off,
                false => LogLevel::Summary,
            };
            let again = retrace_into(logged, level, MemoryLog::default(), see)?;
            notes.extend(again.differs);
            if !has_tables {
                let log = RunLog::from_memory(&again.sink, &Registry::current().vocabulary())?;
                replayed = Some((again.run, History::read(&log)?));
            }
            again.end.now
        } else {
            let history = History::new(logged.run.setup.clone(), SimTime::ZERO);
            let again = retrace_into(logged, LogLevel::Full, HistorySink::new(history), see)?;
            notes.extend(again.differs);
            let mut history = again.sink.history;
            history.finish(&again.run);
            replayed = Some((again.run, history));
            again.end.now
        };
        if let Some(at) = wanted.iter().find(|at| **at > end) {
            bail!("--snapshot {}: the run ended at {end}", at.as_secs_f64());
        }
    }
    let level = level.as_str();
    let (run, history) = match replayed {
        Some(replayed) => {
            let why = match logged.unread {
                None => format!("was logged with --log {level}"),
                Some(bytes) => format!("has a log of {}", DecimalBytes(bytes)),
            };
            notes.push(format!("the run {why}, so it was replayed for this report"));
            replayed
        }
        None => {
            let rows = History::count_rows(logged) as u64;
            let mut progress = Progress::new("reading the log", "rows", rows);
            let history = History::read_with(logged, || progress.step())?;
            (logged.run.clone(), history)
        }
    };
    if history.is_summary {
        let why = match logged.unread {
            None => format!("--log {level} and {sets} behavior sets"),
            Some(bytes) => format!("a log of {}", DecimalBytes(bytes)),
        };
        notes.push(format!(
            "with {why} the report has no levels, ways, messages and detections, and not the time in which tasks were \
             applicable; a run whose log with --log compact is smaller than {} has them",
            DecimalBytes(SHOWN_BYTES_MAX)
        ));
    }
    Ok((run, history, rooms))
}

/// Writes the wanted figures as files, and those that are too large for the page.
fn write_figures(out: &Path, figures: &[Figure], look: &FigureOptions) -> anyhow::Result<()> {
    let wanted = figures
        .iter()
        .filter(|figure| look.with_files() || figure.svg.len() > INLINE_BYTES);
    for figure in wanted {
        make_folder(out)?;
        figure.write(out)?;
        if look.pdf {
            let bytes = pdf::from_svg(&figure.svg).with_context(|| figure.name.clone())?;
            write_atomically(&out.join(format!("{}.pdf", figure.name)), &bytes)?;
        }
    }
    Ok(())
}
