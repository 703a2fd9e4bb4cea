//! `alliance export`: a run in the formats of other tools.
//!
//! - `mcap`: the visible state of the run and its tables, as one recording.
//! - `rosbag`: the same as a bag of ROS 2, for `ros2 bag play`.
//! - `parquet`: the tables of its log, one file each.
//! - `instance`: tasks, robots, assignment, times and value, as JSON.
//! - `scenario`: the run as a scenario with all external influences, to run, change or sweep again.
//! - `svg`, `png`, `video`: the room as pictures and as a film.
//!
//! The page of the run as a file (`--html`) comes from the caller, which has the page.

#[cfg(any(feature = "mcap", feature = "rosbag"))]
pub(crate) mod look;
#[cfg(feature = "mcap")]
mod mcap;
#[cfg(not(feature = "mcap"))]
#[path = "without_mcap.rs"]
mod mcap;
mod parquet;
#[cfg(feature = "rosbag")]
mod rosbag;
#[cfg(not(feature = "rosbag"))]
#[path = "without_rosbag.rs"]
mod rosbag;
mod scenario;

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, bail};
use clap::{Args, Command};
use missions::Registry;
use run_log::{RunLog, RunOutcome};
use terminal::stderr_line;

use crate::instance::from_scenario::{Extracted, readable};
use crate::instance::result::of_run;
use crate::new_file::{NewFile, without_repetition, write_atomically};
use crate::picture::command::{Moments, PictureOptions, Wanted};
use crate::{LATEST, exit_status, open_undamaged, optional};

#[cfg(feature = "mcap")]
pub use mcap::messages as recorded_messages;

/// The file in the folder of a run with its page.
pub const PAGE: &str = "run.html";

/// Export a run to other formats
#[derive(Args, Clone, Debug)]
#[command(override_usage = "alliance export [RUN] <--FORMAT>... [OPTIONS]")]
pub struct ExportCommand {
    /// Folder of the run
    #[arg(value_name = "RUN", default_value = LATEST)]
    folder: PathBuf,
    #[command(flatten)]
    formats: Formats,
    #[command(flatten)]
    pictures: PictureOptions,
}

/// The formats to write, at least one.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Formats")]
struct Formats {
    /// MCAP for Foxglove, Lichtblick and PlotJuggler [default: RUN/run.mcap]
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, hide = !cfg!(feature = "mcap"))]
    mcap: Option<Option<PathBuf>>,
    /// A new folder for `ros2 bag play` and RViz [default: RUN/rosbag]
    #[arg(long, value_name = "FOLDER", num_args = 0..=1, require_equals = true, hide = !cfg!(feature = "rosbag"))]
    rosbag: Option<Option<PathBuf>>,
    /// Each table of the log as a Parquet file [default: RUN/parquet]
    #[arg(long, value_name = "FOLDER", num_args = 0..=1, require_equals = true)]
    parquet: Option<Option<PathBuf>>,
    /// The scenario with all faults, to run again [default: RUN/scenario.toml]
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true)]
    scenario: Option<Option<PathBuf>>,
    /// The page of the run, to open without a server or a network [default: RUN/run.html]
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true)]
    html: Option<Option<PathBuf>>,
    /// Tasks, robots and result of a run of service as JSON [default: RUN/instance.json]
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true)]
    instance: Option<Option<PathBuf>>,
    /// The room as SVG at these times, such as 60s,90s or end [default: end]
    #[arg(long, value_name = "TIME,…", num_args = 0..=1, default_missing_value = "end")]
    svg: Option<Moments>,
    /// The room as PNG at these times, two pixels per px [default: end]
    #[arg(long, value_name = "TIME,…", num_args = 0..=1, default_missing_value = "end")]
    png: Option<Moments>,
    /// A film of the room: an animated WebP (.webp) with all colors, or a GIF (.gif) for slides
    #[arg(long, value_name = "FILE")]
    video: Option<PathBuf>,
}

impl Formats {
    /// Returns the options of the formats that this program can write.
    fn options() -> Vec<String> {
        let all = Self::augment_args(Command::new("export"));
        let all = all.get_arguments().filter(|option| !option.is_hide_set());
        all.map(|option| format!("--{}", option.get_id())).collect()
    }

    fn has_any(&self) -> bool {
        let Self {
            mcap,
            rosbag,
            parquet,
            scenario,
            html,
            instance,
            svg,
            png,
            video,
        } = self;
        let files = [mcap, rosbag, parquet, scenario, html, instance];
        let moments = [svg, png];
        files.iter().any(|file| file.is_some())
            || moments.iter().any(|moments| moments.is_some())
            || video.is_some()
    }
}

/// The error for a run that this program does not reproduce exactly, with its reason.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Differs(pub String);

/// Writes the page of the run in a folder.
pub type WriteHtml = fn(&Path, &mut dyn Write) -> anyhow::Result<()>;

impl ExportCommand {
    /// Writes the export. Returns exit status 0; 1 if this program does not reproduce the run exactly; 2 if the folder
    /// contains no run or a file cannot be written.
    #[must_use]
    pub fn run(&self, write_html: WriteHtml) -> ExitCode {
        let done = self.export(write_html);
        let is_other = done.as_ref().is_err_and(|error| error.is::<Differs>());
        let on_error = if is_other { 1 } else { 2 };
        exit_status("export", done.map(|()| ExitCode::SUCCESS), on_error)
    }

    pub(crate) fn export(&self, write_html: WriteHtml) -> anyhow::Result<()> {
        if !self.formats.has_any() {
            bail!("name a format: {}", Formats::options().join(", "));
        }
        if self.formats.mcap.is_some() {
            mcap_is_there()?;
        }
        let html = self.formats.html.as_ref().map(|file| {
            let file = file.clone();
            file.unwrap_or_else(|| self.folder.join(PAGE))
        });
        if let Some(file) = html.as_ref().filter(|file| file.exists()) {
            bail!(
                "{} exists; delete it, or name another file with --html=FILE",
                file.display()
            );
        }
        if self.formats.rosbag.is_some() {
            rosbag_is_there()?;
        }
        let wanted = Wanted {
            svg: self.formats.svg.as_ref(),
            png: self.formats.png.as_ref(),
            video: self.formats.video.as_deref(),
        };
        self.pictures.check(&wanted)?;
        let log = open_undamaged(&self.folder, u64::MAX)?;
        let bag = self.formats.rosbag.as_ref();
        let bag = bag.map(|folder| folder.clone().unwrap_or_else(|| self.folder.join("rosbag")));
        if let Some(folder) = &bag {
            // Before the other formats, which replace older files.
            rosbag::check(&log, folder)?;
        }
        if let Some(folder) = &self.formats.parquet {
            let folder = folder
                .clone()
                .unwrap_or_else(|| self.folder.join("parquet"));
            let left_out = parquet::write(&log, &folder)?;
            if !left_out.is_empty() {
                stderr_line!(
                    "note: --log {} keeps no {}",
                    log.run.log.as_str(),
                    left_out.join(", ")
                );
            }
            stderr_line!("parquet {}", folder.display());
        }
        if let Some(file) = &self.formats.scenario {
            let file = file
                .clone()
                .unwrap_or_else(|| self.folder.join("scenario.toml"));
            let (text, notes) = scenario::from_log(&log)?;
            for note in notes {
                stderr_line!("note: {note}");
            }
            write_atomically(&file, text.as_bytes())?;
            stderr_line!("scenario {} (seed {})", file.display(), log.run.setup.seed);
        }
        if let Some(file) = &self.formats.instance {
            let file = file
                .clone()
                .unwrap_or_else(|| self.folder.join("instance.json"));
            let (text, notes) = instance_of(&log)?;
            for note in notes {
                stderr_line!("note: {note}");
            }
            write_atomically(&file, text.as_bytes())?;
            stderr_line!("instance {}", file.display());
        }
        if let Some(file) = &self.formats.mcap {
            let file = file.clone().unwrap_or_else(|| mcap_file(&self.folder));
            write_mcap(&log, &file)?;
        }
        if let Some(path) = html {
            let mut file = NewFile::create(&path)?;
            let at = || path.display().to_string();
            file.write(|output| write_html(&self.folder, output).with_context(at))?;
            file.put_in_place()?;
            let bytes = fs::metadata(&path).map_or(0, |file| file.len());
            stderr_line!("html    {} ({:.1} MB)", path.display(), bytes as f64 / 1e6);
        }
        if let Some(folder) = &bag {
            rosbag::write(&log, folder).map_err(without_repetition)?;
            stderr_line!("rosbag  {}", folder.display());
        }
        self.pictures.write(&log, &self.folder, &wanted)
    }
}

/// Returns the instance of a run as JSON, and notes about facts that it does not contain.
fn instance_of(log: &RunLog) -> anyhow::Result<(String, Vec<String>)> {
    let scenario = &log.run.setup.scenario;
    let world = Registry::current().worlds().find(scenario)?;
    let starts = world.start_poses(scenario)?;
    let places: Vec<[f64; 2]> = starts
        .iter()
        .map(|pose| pose.position.to_array().map(readable))
        .collect();
    let Extracted { instance, notes } = of_run(log, &places)?;
    Ok((serde_json::to_string_pretty(&instance)? + "\n", notes))
}

/// Checks that this program can write MCAP files.
///
/// # Errors
/// Returns an error that names the required feature.
pub fn mcap_is_there() -> anyhow::Result<()> {
    optional::check("--mcap", "mcap", cfg!(feature = "mcap"))
}

/// Checks that this program can write bags of ROS 2.
fn rosbag_is_there() -> anyhow::Result<()> {
    optional::check("--rosbag", "rosbag", cfg!(feature = "rosbag"))
}

/// Writes the run in `folder` as DIR/run.mcap.
///
/// # Errors
/// Returns an error when this program does not reproduce the run exactly or the file cannot be written.
pub fn export_mcap(folder: &Path) -> anyhow::Result<()> {
    write_mcap(&open_undamaged(folder, u64::MAX)?, &mcap_file(folder))
}

fn mcap_file(folder: &Path) -> PathBuf {
    folder.join("run.mcap")
}

fn write_mcap(log: &RunLog, path: &Path) -> anyhow::Result<()> {
    let mut file = NewFile::create(path)?;
    let at = || path.display().to_string();
    file.write(|output| mcap::write(log, output).with_context(at))?;
    file.put_in_place()?;
    stderr_line!("mcap    {}", path.display());
    Ok(())
}

/// Returns the facts about the source run that an export contains.
fn facts(log: &RunLog) -> BTreeMap<String, String> {
    let run = &log.run;
    let hash = run
        .hash
        .clone()
        .or_else(|| log.last.map(|seal| format!("{:016x}", seal.hash)));
    let outcome = match run.outcome {
        RunOutcome::Running => "running",
        RunOutcome::Ended(outcome) => outcome.as_str(),
    };
    [
        ("seed", run.setup.seed.to_string()),
        ("scenario", run.setup.scenario.name.clone()),
        ("hash", hash.unwrap_or_default()),
        ("outcome", outcome.to_owned()),
        ("version", run.version.clone()),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .into()
}
