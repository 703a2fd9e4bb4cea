//! `alliance replay --mind`: minds that are programs of their own are started once more and asked what they were asked in the logged
//! run, tick by tick. What they answer must be what they answered then.
//!
//! The run itself is made again in this process, from the answers that the log has kept: so the minds are asked as they were, whatever
//! stalled, died or got lost then. To them this process is the world (`stage`).

mod stage;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use alliance_proto::codec::encode;
use alliance_proto::ids::{Incarnation, RobotId};
use alliance_proto::join::Welcome;
use alliance_proto::log::RunLog;
use alliance_proto::scenario::Setup;
use alliance_proto::team::Broadcast;
use alliance_proto::tick::{Report, TickMessage, ToAgent};
use anyhow::bail;
use in_process::{Foreign, ForeignError, Kept};
use nix::sys::signal::Signal;
use serde_json::Value;
use study::diff::Difference;
use study::replay::OtherAnswer;
use tokio::runtime::Runtime;
use tokio::time::timeout;

use crate::run::children::Process;
use crate::run::minds::MindCommand;
use crate::runtime;
use stage::{Stage, State};

/// Starts the minds that `words`, those of `--mind`, have commands for, and asks them beside the log.
///
/// # Errors
/// When a word is none, nobody has that mind, or the bus fails.
pub fn ask(logged: &RunLog, words: &[String], kept: Kept) -> anyhow::Result<Box<dyn Foreign>> {
    let setup = logged.run.setup.clone();
    let minds = setup.scenario.minds();
    let mut commands = BTreeMap::new();
    for word in words {
        let mind =
            MindCommand::parse(word).map_err(|why| anyhow::anyhow!("--mind {word}: {why}"))?;
        if !minds.contains(mind.name.as_str()) {
            let names: Vec<&str> = minds.iter().copied().collect();
            bail!(
                "--mind {}: no robot of this run has that mind; there are {}",
                mind.name,
                names.join(", ")
            );
        }
        commands.insert(mind.name, mind.command);
    }
    let runtime = runtime::start()?;
    let stage = runtime.block_on(Stage::open(&setup))?;
    Ok(Box::new(Asked {
        kept,
        commands,
        lives: BTreeMap::new(),
        failed: None,
        stage,
        setup,
        runtime,
    }))
}

/// Minds that are asked, and what they must answer.
struct Asked {
    kept: Kept,
    /// By mind.
    commands: BTreeMap<String, String>,
    lives: BTreeMap<RobotId, Process>,
    /// Why a mind could not be started.
    failed: Option<String>,
    stage: Stage,
    setup: Setup,
    runtime: Runtime,
}

impl Asked {
    fn name(&self, robot: RobotId) -> &str {
        self.setup.roster.name(robot)
    }

    /// The command of a robot's mind, if that is to be asked.
    fn command(&self, robot: RobotId) -> Option<&String> {
        let robot = self.setup.scenario.robots.get(robot.index())?;
        self.commands.get(robot.mind.as_ref()?)
    }

    /// Starts a life, and waits until it is there.
    fn start(&mut self, robot: RobotId, incarnation: Incarnation) -> Result<(), String> {
        let Some(command) = self.command(robot).cloned() else {
            return Ok(());
        };
        let name = self.name(robot).to_owned();
        let setup = self.setup.briefing_of(&name).to_json();
        let welcome = Welcome {
            robot,
            incarnation,
            first_tick: 0,
            setup: setup.map_err(|error| error.to_string())?,
            pairs: None,
        };
        self.stage
            .heard
            .lock()
            .invited
            .insert(name.clone(), welcome);
        let log = self.stage.logs.join(format!("{name}.log"));
        let started = Process::start_mind(&name, &log, &command, &self.stage.run);
        let mut life = started.map_err(|error| format!("{name}: {error:#}"))?;
        let is_there =
            |state: &mut State| (state.present.get(&name) == Some(&incarnation)).then_some(());
        let came = self.stage.wait_for(&mut life, is_there);
        let came = self.runtime.block_on(came);
        self.lives.insert(robot, life);
        came.map_err(|why| format!("{name}: {why}"))
    }

    /// What the mind itself answers.
    fn ask(
        &mut self,
        robot: RobotId,
        tick: &TickMessage,
        arrived: &[Option<Arc<Broadcast>>],
    ) -> Result<(Report, Vec<Broadcast>), String> {
        let (stage, setup) = (&self.stage, &self.setup);
        let Some(life) = self.lives.get_mut(&robot) else {
            return Err("its mind does not live".to_owned());
        };
        stage.heard.lock().broadcasts.remove(&robot);
        let bulletins = setup.catalog.mission.terms().bulletins;
        for broadcast in arrived.iter().flatten() {
            let kind = broadcast.body.kind().name(bulletins);
            let sender = setup.roster.name(broadcast.sender);
            stage.say(&stage.keys.team(sender, kind), &**broadcast)?;
        }
        let message = if tick.truth.is_empty() {
            ToAgent::Tick(tick)
        } else {
            ToAgent::Informed(tick, tick.truth.clone())
        };
        stage.tell(setup.roster.name(robot), &message)?;
        let is_it =
            |report: &Report| (report.tick, report.incarnation) == (tick.tick, tick.incarnation);
        let report = stage.wait_for(life, |state| {
            let report = state.reports.get(&robot).filter(|report| is_it(report))?;
            Some(report.clone())
        });
        let report = self.runtime.block_on(report)?;
        // They came before it.
        let said = stage.heard.lock().broadcasts.remove(&robot);
        let mut said = said.unwrap_or_default();
        said.retain(|it| (it.tick, it.incarnation) == (tick.tick, tick.incarnation));
        said.sort_by_key(|broadcast| broadcast.index);
        Ok((report, said))
    }

    /// The first field in which the two are not the same to the bit, with what each says.
    fn difference(
        &self,
        robot: RobotId,
        tick: &TickMessage,
        kept: (&Report, &[Broadcast]),
        now: (&Report, &[Broadcast]),
    ) -> Option<Difference> {
        let bytes =
            |(report, said): (&Report, &[Broadcast])| (encode(report).ok(), encode(&said).ok());
        if bytes(kept) == bytes(now) {
            return None;
        }
        let value = |(report, said): (&Report, &[Broadcast])| {
            let report = serde_json::to_value(report).unwrap_or_default();
            (report, serde_json::to_value(said).unwrap_or_default())
        };
        let ((report, said), (report_now, said_now)) = (value(kept), value(now));
        let found = first_difference("", &report, &report_now)
            .or_else(|| first_difference("broadcasts", &said, &said_now));
        // JSON has no NaN.
        let (field, a, b) = found.unwrap_or_else(|| {
            let text = |it: &Report| format!("{it:?}");
            ("report".to_owned(), text(kept.0), text(now.0))
        });
        Some(Difference {
            cause: None,
            tick: Some(tick.tick),
            t_ms: Some(tick.now),
            robot: self.name(robot).to_owned(),
            section: "mind".to_owned(),
            field: Some(field),
            a,
            b,
        })
    }
}

/// The first place where the two differ, with what stands there.
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

impl Foreign for Asked {
    fn spawn(&mut self, robot: RobotId, incarnation: Incarnation) {
        self.die(robot);
        if let Err(why) = self.start(robot, incarnation) {
            self.failed.get_or_insert(why);
        }
    }

    fn die(&mut self, robot: RobotId) {
        if let Some(mut life) = self.lives.remove(&robot) {
            end(&mut life);
        }
    }

    fn answer(
        &mut self,
        robot: RobotId,
        tick: &TickMessage,
        arrived: &[Option<Arc<Broadcast>>],
        report: &mut Report,
        broadcasts: &mut Vec<Broadcast>,
    ) -> Result<(), ForeignError> {
        if let Some(why) = self.failed.take() {
            return Err(ForeignError::Other(why.into()));
        }
        self.kept.answer(robot, tick, arrived, report, broadcasts)?;
        if self.command(robot).is_none() {
            return Ok(());
        }
        let (now, said) = self.ask(robot, tick, arrived).map_err(|why| {
            let name = self.name(robot);
            ForeignError::Other(format!("{name}: tick {}: {why}", tick.tick).into())
        })?;
        match self.difference(robot, tick, (report, broadcasts), (&now, &said)) {
            None => Ok(()),
            Some(found) => Err(ForeignError::Other(Box::new(OtherAnswer(found)))),
        }
    }
}

/// At once: what it did is known.
fn end(life: &mut Process) {
    life.signal(Signal::SIGKILL);
    while life.ending().is_none() && life.poll().is_ok() {
        std::thread::sleep(Duration::from_millis(1));
    }
}

impl Drop for Asked {
    fn drop(&mut self) {
        self.lives.values_mut().for_each(end);
        let _ = std::fs::remove_dir_all(&self.stage.logs);
        // Teardown may hang; the process ends whether or not it does.
        let close = self.stage.session.close();
        let _ = self
            .runtime
            .block_on(async { timeout(Duration::from_secs(1), close).await });
    }
}
