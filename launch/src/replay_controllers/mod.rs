//! `alliance replay --controller`: starts external controllers again with the inputs of the logged run, tick by tick, and compares their
//! answers with the log.
//!
//! The run is replayed in this process from the answers in the log. Thus the controllers receive the same inputs, including stalls,
//! crashes and message loss. For the controllers, this process is the world (`stage`).

mod stage;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use analysis::diff::Difference;
use analysis::replay::AnswerDifference;
use anyhow::bail;
use in_process::{AnswerError, AnswerSource, LoggedAnswers};
use nix::sys::signal::Signal;
use proto::codec::encode;
use proto::join::Welcome;
use proto::team::{Broadcast, EncodedBroadcast};
use proto::tick::{Report, TickMessage, ToAgent};
use run_log::RunLog;
use scenario::Setup;
use scenario::ids::{Incarnation, RobotId};
use serde_json::Value;
use tokio::runtime::Runtime;
use tokio::time::timeout;

use crate::run::child_processes::Process;
use crate::run::controllers::ControllerCommand;
use crate::runtime;
use stage::{Stage, State};

/// Creates a source of answers that compares the logged ones with those of the controllers in `words`, the values of `--controller`.
///
/// # Errors
/// If a value is invalid, no robot has that controller, or the bus fails.
pub fn compare(
    logged: &RunLog,
    words: &[String],
    kept: LoggedAnswers,
) -> anyhow::Result<Box<dyn AnswerSource>> {
    let setup = logged.run.setup.clone();
    let controllers = setup.scenario.external_controllers();
    let mut commands = BTreeMap::new();
    for word in words {
        let command = ControllerCommand::parse(word)
            .map_err(|why| anyhow::anyhow!("--controller {word}: {why}"))?;
        if !controllers.contains(command.name.as_str()) {
            let names: Vec<&str> = controllers.iter().copied().collect();
            bail!(
                "--controller {}: no robot of this run has that controller; there are {}",
                command.name,
                names.join(", ")
            );
        }
        commands.insert(command.name, command.command);
    }
    let runtime = runtime::start_runtime()?;
    let stage = runtime.block_on(Stage::open(&setup))?;
    Ok(Box::new(Comparison {
        kept,
        commands,
        processes: BTreeMap::new(),
        failed: None,
        stage,
        setup,
        runtime,
    }))
}

struct Comparison {
    kept: LoggedAnswers,
    /// The commands, by name of the controller.
    commands: BTreeMap<String, String>,
    processes: BTreeMap<RobotId, Process>,
    /// The reason why a controller could not be started.
    failed: Option<String>,
    stage: Stage,
    setup: Setup,
    runtime: Runtime,
}

impl Comparison {
    fn name(&self, robot: RobotId) -> &str {
        self.setup.roster.name(robot)
    }

    /// Returns the command of a robot's controller if it is compared.
    fn command(&self, robot: RobotId) -> Option<&String> {
        let robot = self.setup.scenario.robots.get(robot.index())?;
        self.commands.get(robot.controller.as_ref()?)
    }

    /// Starts an incarnation and waits until it has joined.
    fn start(&mut self, robot: RobotId, incarnation: Incarnation) -> Result<(), String> {
        let Some(command) = self.command(robot).cloned() else {
            return Ok(());
        };
        let name = self.name(robot).to_owned();
        let setup = self.setup.for_robot(&name).to_json();
        let welcome = Welcome {
            robot,
            incarnation,
            first_tick: 0,
            setup: setup.map_err(|error| error.to_string())?,
        };
        self.stage
            .received
            .lock()
            .welcomes
            .insert(name.clone(), welcome);
        let log = self.stage.logs.path().join(format!("{name}.log"));
        let started = Process::start_controller(&name, &log, &command, &self.stage.run);
        let mut process = started.map_err(|error| format!("{name}: {error:#}"))?;
        let has_joined =
            |state: &mut State| (state.present.get(&name) == Some(&incarnation)).then_some(());
        let joined = self.stage.wait_for(&mut process, has_joined);
        let joined = self.runtime.block_on(joined);
        self.processes.insert(robot, process);
        joined.map_err(|why| format!("{name}: {why}"))
    }

    /// Returns the answer of the running controller.
    fn compare(
        &mut self,
        robot: RobotId,
        tick: &TickMessage,
        arrived: &[Option<Arc<Broadcast>>],
    ) -> Result<(Report, Vec<Broadcast>), String> {
        let (stage, setup) = (&self.stage, &self.setup);
        let Some(process) = self.processes.get_mut(&robot) else {
            return Err("its controller is not running".to_owned());
        };
        stage.received.lock().broadcasts.remove(&robot);
        let encoded = arrived.iter().map(|arrived| {
            let encoded = arrived.as_deref().map(EncodedBroadcast::of);
            encoded.transpose().map_err(|error| error.to_string())
        });
        let message = ToAgent::Tick {
            tick,
            ground_truth: tick.ground_truth.clone(),
            broadcasts: encoded.collect::<Result<Vec<_>, _>>()?,
        };
        stage.send_to_robot(setup.roster.name(robot), &message)?;
        let is_current =
            |report: &Report| (report.tick, report.incarnation) == (tick.tick, tick.incarnation);
        let report = stage.wait_for(process, |state| {
            let report = state
                .reports
                .get(&robot)
                .filter(|report| is_current(report))?;
            Some(report.clone())
        });
        let report = self.runtime.block_on(report)?;
        // The broadcasts of a tick arrive before its report.
        let broadcasts = stage.received.lock().broadcasts.remove(&robot);
        let mut broadcasts = broadcasts.unwrap_or_default();
        broadcasts.retain(|broadcast| {
            (broadcast.tick, broadcast.incarnation) == (tick.tick, tick.incarnation)
        });
        broadcasts.sort_by_key(|broadcast| broadcast.index);
        Ok((report, broadcasts))
    }

    /// Returns the first field in which the logged and the new answer differ in a bit, with both values.
    fn difference(
        &self,
        robot: RobotId,
        tick: &TickMessage,
        kept: (&Report, &[Broadcast]),
        now: (&Report, &[Broadcast]),
    ) -> Option<Difference> {
        let bytes = |(report, broadcasts): (&Report, &[Broadcast])| {
            (encode(report).ok(), encode(&broadcasts).ok())
        };
        if bytes(kept) == bytes(now) {
            return None;
        }
        let value = |(report, broadcasts): (&Report, &[Broadcast])| {
            let report = serde_json::to_value(report).unwrap_or_default();
            (report, serde_json::to_value(broadcasts).unwrap_or_default())
        };
        let ((report, broadcasts), (report_now, broadcasts_now)) = (value(kept), value(now));
        let found = first_difference("", &report, &report_now)
            .or_else(|| first_difference("broadcasts", &broadcasts, &broadcasts_now));
        // JSON cannot represent NaN.
        let (field, a, b) = found.unwrap_or_else(|| {
            let text = |report: &Report| format!("{report:?}");
            ("report".to_owned(), text(kept.0), text(now.0))
        });
        Some(Difference {
            cause: None,
            tick: Some(tick.tick),
            t_ms: Some(tick.now),
            robot: self.name(robot).to_owned(),
            section: "controller".to_owned(),
            field: Some(field),
            a,
            b,
        })
    }
}

/// Returns the first path at which the two values differ, with both values.
fn first_difference(path: &str, a: &Value, b: &Value) -> Option<(String, String, String)> {
    match (a, b) {
        (Value::Object(one), Value::Object(other)) if one.keys().eq(other.keys()) => {
            let dot = if path.is_empty() { "" } else { "." };
            let mut pairs = one.iter().zip(other.values());
            pairs.find_map(|((key, a), b)| first_difference(&format!("{path}{dot}{key}"), a, b))
        }
        (Value::Array(one), Value::Array(other)) => {
            let longest = one.len().max(other.len());
            (0..longest).find_map(|index| {
                let of = |list: &[Value]| list.get(index).cloned().unwrap_or(Value::Null);
                first_difference(&format!("{path}[{index}]"), &of(one), &of(other))
            })
        }
        _ => (a != b).then(|| (path.to_owned(), a.to_string(), b.to_string())),
    }
}

impl AnswerSource for Comparison {
    fn start_incarnation(&mut self, robot: RobotId, incarnation: Incarnation) {
        self.end_incarnation(robot);
        if let Err(why) = self.start(robot, incarnation) {
            self.failed.get_or_insert(why);
        }
    }

    fn end_incarnation(&mut self, robot: RobotId) {
        if let Some(mut process) = self.processes.remove(&robot) {
            end(&mut process);
        }
    }

    fn answer(
        &mut self,
        robot: RobotId,
        tick: &TickMessage,
        arrived: &[Option<Arc<Broadcast>>],
        report: &mut Report,
        broadcasts: &mut Vec<Broadcast>,
    ) -> Result<(), AnswerError> {
        if let Some(why) = self.failed.take() {
            return Err(AnswerError::Other(why.into()));
        }
        self.kept.answer(robot, tick, arrived, report, broadcasts)?;
        if self.command(robot).is_none() {
            return Ok(());
        }
        let (new_report, new_broadcasts) = self.compare(robot, tick, arrived).map_err(|why| {
            let name = self.name(robot);
            AnswerError::Other(format!("{name}: tick {}: {why}", tick.tick).into())
        })?;
        match self.difference(
            robot,
            tick,
            (report, broadcasts),
            (&new_report, &new_broadcasts),
        ) {
            None => Ok(()),
            Some(found) => Err(AnswerError::Other(Box::new(AnswerDifference(found)))),
        }
    }
}

/// Kills a controller and waits for its end.
fn end(process: &mut Process) {
    process.signal(Signal::SIGKILL);
    while process.ending().is_none() && process.poll().is_ok() {
        std::thread::sleep(Duration::from_millis(1));
    }
}

impl Drop for Comparison {
    fn drop(&mut self) {
        self.processes.values_mut().for_each(end);
        // Closing may hang; the process ends in any case.
        let close = self.stage.session.close();
        let _ = self
            .runtime
            .block_on(async { timeout(Duration::from_secs(1), close).await });
    }
}
