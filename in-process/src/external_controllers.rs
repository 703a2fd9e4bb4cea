//! Robots with external controllers. Another source, such as the log, supplies their answers.

use std::collections::VecDeque;
use std::error::Error;
use std::sync::Arc;

use proto::team::Broadcast;
use proto::tick::{Report, TickMessage};
use run_log::recorder::RecordError;
use run_log::{ExternalAnswer, ReadError, RunLog};
use scenario::Setup;
use scenario::ids::{Incarnation, RobotId, Tick};

/// A source of answers for robots whose controllers are not part of this program.
pub trait AnswerSource: Send {
    fn start_incarnation(&mut self, _robot: RobotId, _incarnation: Incarnation) {}

    fn end_incarnation(&mut self, _robot: RobotId) {}

    /// Computes the robot's answer to a tick and overwrites `report` and `broadcasts` with it. `arrived` has one entry for each
    /// broadcast of the tick's manifest; `None` stands for a lost one.
    ///
    /// # Errors
    /// Fails if the answer is unknown.
    fn answer(
        &mut self,
        robot: RobotId,
        tick: &TickMessage,
        arrived: &[Option<Arc<Broadcast>>],
        report: &mut Report,
        broadcasts: &mut Vec<Broadcast>,
    ) -> Result<(), AnswerError>;
}

#[derive(Debug, thiserror::Error)]
pub enum AnswerError {
    /// An answer that the log does not contain.
    #[error(
        "foreign.bin has no answer of {robot} in tick {tick}: the file is missing or truncated, or the run is from another version"
    )]
    Missing { robot: String, tick: Tick },
    /// An error of another source of answers.
    #[error(transparent)]
    Other(Box<dyn Error + Send + Sync>),
}

/// An error that ends a run in one process early.
#[derive(Debug, thiserror::Error)]
pub enum TickError {
    #[error(transparent)]
    Log(#[from] RecordError),
    #[error(transparent)]
    Foreign(#[from] AnswerError),
}

/// The logged answers of external controllers.
pub struct LoggedAnswers {
    /// The remaining answers of each robot, by rank and in order of ticks.
    answers: Vec<VecDeque<ExternalAnswer>>,
    names: Vec<String>,
}

impl LoggedAnswers {
    /// Reads the answers of a logged run. Returns `None` if the run has no external controllers.
    pub fn of(logged: &RunLog) -> Result<Option<Self>, ReadError> {
        let setup = &logged.run.setup;
        if setup.scenario.external_controllers().is_empty() {
            return Ok(None);
        }
        Ok(Some(Self::new(setup, logged.external_answers()?)))
    }

    fn new(setup: &Setup, answers: Vec<ExternalAnswer>) -> Self {
        let robots = &setup.scenario.robots;
        let mut source = Self {
            answers: robots.iter().map(|_| VecDeque::new()).collect(),
            names: robots.iter().map(|robot| robot.name.clone()).collect(),
        };
        for answer in answers {
            // Answers of unknown robots are never requested.
            if let Some(of_robot) = source.answers.get_mut(answer.report.robot.index()) {
                of_robot.push_back(answer);
            }
        }
        source
    }
}

impl AnswerSource for LoggedAnswers {
    fn answer(
        &mut self,
        robot: RobotId,
        tick: &TickMessage,
        _: &[Option<Arc<Broadcast>>],
        report: &mut Report,
        broadcasts: &mut Vec<Broadcast>,
    ) -> Result<(), AnswerError> {
        let (wanted, answers) = (tick.tick, &mut self.answers[robot.index()]);
        let matches_tick = |answer: &mut ExternalAnswer| {
            (answer.report.tick, answer.report.incarnation) == (wanted, tick.incarnation)
        };
        let Some(answer) = answers.pop_front_if(matches_tick) else {
            return Err(AnswerError::Missing {
                robot: self.names[robot.index()].clone(),
                tick: wanted,
            });
        };
        *report = answer.report;
        broadcasts.clear();
        // A broadcast that the world did not receive is lost, and so are those after it.
        broadcasts.extend(
            answer
                .broadcasts
                .into_iter()
                .map_while(|broadcast| broadcast),
        );
        Ok(())
    }
}
