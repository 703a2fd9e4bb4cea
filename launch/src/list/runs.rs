//! `alliance list runs`: the live runs of this user and the recorded runs in a folder.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use analysis::table;
use anyhow::{Context, bail};
use clap::Args;
use cluster::os_process::OsProcess;
use cluster::rendezvous::{self, Rendezvous};
use proto::control::{ControlCommand, Reply};
use scenario::Problem;
use scenario::time::SimTime;
use serde::{Deserialize, Serialize};
use tokio::runtime::Runtime;

use crate::control::send_command;
use crate::runtime;

const FOLDER: &str = "runs";

/// List live and recorded runs, newest first
#[derive(Args, Clone, Debug)]
pub struct RunsCommand {
    /// Folder that contains the run folders
    #[arg(value_name = "DIR", default_value = FOLDER)]
    folder: PathBuf,
    /// Print the list as JSON on stdout
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
struct Listed {
    /// The id of a live run, or the folder of a recorded run.
    run: String,
    /// `live` with the state of the clock, or the outcome.
    state: String,
    scenario: Option<String>,
    seed: Option<u64>,
    sim_time_ms: Option<SimTime>,
    hash: Option<String>,
    /// The folder of a live run that has answered.
    #[serde(skip)]
    folder: Option<PathBuf>,
}

impl Listed {
    /// Creates an entry of a run of which only the state is known.
    fn new(run: String, state: String) -> Self {
        Self {
            run,
            state,
            scenario: None,
            seed: None,
            sim_time_ms: None,
            hash: None,
            folder: None,
        }
    }
}

#[derive(Deserialize)]
struct Log {
    outcome: String,
    hash: Option<String>,
    seed: u64,
    scenario: Named,
    result: Length,
}

#[derive(Deserialize)]
struct Named {
    name: String,
}

#[derive(Deserialize)]
struct Length {
    sim_time_ms: SimTime,
}

impl Default for RunsCommand {
    fn default() -> Self {
        Self {
            folder: FOLDER.into(),
            json: false,
        }
    }
}

impl RunsCommand {
    /// Returns the list as text or as JSON.
    pub fn text(&self) -> anyhow::Result<String> {
        let mut runs = live()?;
        let mut recorded = logs(&self.folder)?;
        // The log of a live run is not a second run.
        recorded.retain(|log| {
            let folder = fs::canonicalize(&log.run).ok();
            folder.is_none() || runs.iter().all(|live| live.folder != folder)
        });
        runs.append(&mut recorded);
        if self.json {
            return Ok(serde_json::to_string_pretty(&runs)? + "\n");
        }
        Ok(in_words(&runs, &self.folder))
    }
}

fn live() -> anyhow::Result<Vec<Listed>> {
    let runs = rendezvous::live()?;
    // Without a live run no runtime is needed.
    let runtime = (!runs.is_empty())
        .then(runtime::start_runtime)
        .transpose()?;
    let described = runtime.iter().flat_map(|runtime| {
        let runs = runs.iter();
        runs.map(|run| describe(run, runtime))
    });
    Ok(described.collect())
}

fn describe(run: &Rendezvous, runtime: &Runtime) -> Listed {
    let unknown = |state: &str| Listed::new(run.run.clone(), state.to_owned());
    if OsProcess::find(run.pid).is_some_and(|world| world.is_stopped) {
        return unknown("live, its world is stopped");
    }
    match runtime.block_on(send_command(run.clone(), ControlCommand::Status)) {
        Ok(Reply::Status(status)) => Listed {
            scenario: Some(status.scenario),
            seed: Some(status.seed),
            sim_time_ms: Some(status.t_ms),
            folder: fs::canonicalize(status.folder).ok(),
            ..unknown(["live", "live, paused"][usize::from(status.clock.paused)])
        },
        _ => unknown("live, does not answer"),
    }
}

/// Returns the recorded runs in a folder, newest first. The default folder exists only after the first run.
fn logs(folder: &Path) -> anyhow::Result<Vec<Listed>> {
    if !folder.is_dir() && folder != Path::new(FOLDER) {
        let name = folder.display().to_string();
        let remedy = "name the folder that contains the run folders";
        bail!(Problem::with_source(
            name,
            "there is no such folder",
            remedy
        ));
    }
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.with_context(|| folder.display().to_string())?,
    };
    let mut found: Vec<(SystemTime, Listed)> = Vec::new();
    for entry in entries.flatten() {
        // `latest` is a link to one of the other folders.
        if !entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            continue;
        }
        let path = entry.path();
        let Ok(text) = fs::read(path.join("run.json")) else {
            continue;
        };
        let changed = entry.metadata().and_then(|data| data.modified());
        found.push((changed.unwrap_or(SystemTime::UNIX_EPOCH), log(&path, &text)));
    }
    found.sort_by(|(a, x), (b, y)| b.cmp(a).then_with(|| x.run.cmp(&y.run)));
    Ok(found.into_iter().map(|(_, run)| run).collect())
}

fn log(path: &Path, text: &[u8]) -> Listed {
    let listed = |state| Listed::new(path.display().to_string(), state);
    let Ok(log) = serde_json::from_slice::<Log>(text) else {
        return listed("run.json cannot be read".to_owned());
    };
    let state = match log.outcome.as_str() {
        // Its world was killed, or it is live and does not answer.
        "running" => "without an end".to_owned(),
        _ => log.outcome,
    };
    Listed {
        scenario: Some(log.scenario.name),
        seed: Some(log.seed),
        sim_time_ms: Some(log.result.sim_time_ms),
        hash: log.hash,
        ..listed(state)
    }
}

fn in_words(runs: &[Listed], folder: &Path) -> String {
    if runs.is_empty() {
        return format!(
            "no live run, and no recorded run in {}; start one with `alliance run`\n",
            folder.display()
        );
    }
    let mut table = table::new(["run", "state", "scenario", "seed", "simulated", "hash"]);
    let or_dash = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
    for run in runs {
        let cells = [
            run.run.clone(),
            run.state.clone(),
            or_dash(run.scenario.clone()),
            or_dash(run.seed.map(|seed| seed.to_string())),
            or_dash(run.sim_time_ms.map(|time| time.to_string())),
            or_dash(run.hash.clone()),
        ];
        // Names of folders and texts of logs can contain any character.
        table.add_row(cells.map(|cell| terminal::in_one_line(&cell).into_owned()));
    }
    table::hide_instead_of_wrap(&mut table, &[2, 5]);
    table.trim_fmt() + "\n"
}
