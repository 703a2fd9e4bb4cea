//! Robots whose minds are programs that this one does not have: what they answer is told by somebody else, such as the log.

use std::collections::VecDeque;
use std::error::Error;
use std::sync::Arc;

use alliance_proto::ids::{Incarnation, RobotId, Tick};
use alliance_proto::log::{ForeignAnswer, ReadError, RunLog};
use alliance_proto::scenario::Setup;
use alliance_proto::team::Broadcast;
use alliance_proto::tick::{Report, TickMessage};
use world_server::recorder::RecordError;

/// Answers for robots whose minds this program does not have.
pub trait Foreign: Send {
    /// A life of the robot begins.
    fn spawn(&mut self, _robot: RobotId, _incarnation: Incarnation) {}

    /// Its life has ended.
    fn die(&mut self, _robot: RobotId) {}

    /// What the robot does in that tick, for which it hears what has arrived of the tick's manifest: a place for each broadcast. Both are
    /// written to `report` and `broadcasts`, whatever is there.
    ///
    /// # Errors
    /// When nobody knows.
    fn answer(
        &mut self,
        robot: RobotId,
        tick: &TickMessage,
        arrived: &[Option<Arc<Broadcast>>],
        report: &mut Report,
        broadcasts: &mut Vec<Broadcast>,
    ) -> Result<(), ForeignError>;
}

/// Why a foreign mind's answer is not known.
#[derive(Debug, thiserror::Error)]
pub enum ForeignError {
    /// The log has none.
    #[error(
        "foreign.bin has no answer of {robot} in tick {tick}: it is missing or cut, or the run was made by another version"
    )]
    Missing {
        /// Whose.
        robot: String,
        /// When.
        tick: Tick,
    },
    /// Whoever is asked does not say, and tells why.
    #[error(transparent)]
    Other(Box<dyn Error + Send + Sync>),
}

/// What can end a run in one process before its time.
#[derive(Debug, thiserror::Error)]
pub enum TickError {
    /// The log cannot be written.
    #[error(transparent)]
    Log(#[from] RecordError),
    /// A foreign mind's answer is not known.
    #[error(transparent)]
    Foreign(#[from] ForeignError),
}

/// The answers that a log has kept.
pub struct Kept {
    /// By rank.
    answers: Vec<VecDeque<ForeignAnswer>>,
    names: Vec<String>,
}

impl Kept {
    /// Those of a logged run; `None`: all its minds are this program's.
    ///
    /// # Errors
    /// When foreign.bin cannot be read.
    pub fn of(logged: &RunLog) -> Result<Option<Self>, ReadError> {
        let setup = &logged.run.setup;
        if setup.scenario.minds().is_empty() {
            return Ok(None);
        }
        Ok(Some(Self::new(setup, logged.foreign()?)))
    }

    fn new(setup: &Setup, answers: Vec<ForeignAnswer>) -> Self {
        let robots = &setup.scenario.robots;
        let mut kept = Self {
            answers: robots.iter().map(|_| VecDeque::new()).collect(),
            names: robots.iter().map(|robot| robot.name.clone()).collect(),
        };
        for answer in answers {
            // Of a robot that there is not, nobody asks.
            if let Some(of_robot) = kept.answers.get_mut(answer.report.robot.index()) {
                of_robot.push_back(answer);
            }
        }
        kept
    }
}

impl Foreign for Kept {
    fn answer(
        &mut self,
        robot: RobotId,
        tick: &TickMessage,
        _: &[Option<Arc<Broadcast>>],
        report: &mut Report,
        broadcasts: &mut Vec<Broadcast>,
    ) -> Result<(), ForeignError> {
        let (wanted, answers) = (tick.tick, &mut self.answers[robot.index()]);
        let is_it = |answer: &mut ForeignAnswer| {
            (answer.report.tick, answer.report.incarnation) == (wanted, tick.incarnation)
        };
        let Some(answer) = answers.pop_front_if(is_it) else {
            return Err(ForeignError::Missing {
                robot: self.names[robot.index()].clone(),
                tick: wanted,
            });
        };
        *report = answer.report;
        broadcasts.clear();
        // What never came to the world is lost to those who hear it, and so is what follows it.
        broadcasts.extend(answer.broadcasts.into_iter().map_while(|it| it));
        Ok(())
    }
}
