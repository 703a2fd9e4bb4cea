//! A run with a clock, orders of a person, and frames for the page.

use std::time::Duration;

use in_process::{StartError, Team, TickError};
use observation::about::about;
use observation::feed::Feed;
use proto::control::{ControlCommand, Reply};
use proto::event::TickEvents;
use proto::tick::Outcome;
use run_log::{LogLevel, MemoryLog};
use scenario::Problem;
use serde_json::{Value, json};
use world_server::pace::{Pace, Speed};

use crate::choice::Choice;

/// The reason why a chosen run does not start.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    #[error(transparent)]
    Choice(#[from] Problem),
    #[error(transparent)]
    Start(#[from] StartError),
}

/// A run in one process. Times of the wall clock are durations since any fixed moment.
pub struct Engine {
    team: Team<MemoryLog>,
    feed: Feed,
    pace: Pace<Duration>,
    about: Value,
    /// Frames of events since the last call of [`Engine::frames`].
    news: Vec<String>,
    outcome: Option<Outcome>,
    has_sent_end: bool,
}

impl Engine {
    /// Creates a run that is paused before its first tick.
    ///
    /// # Errors
    /// If the choice is invalid.
    pub fn open(choice: &Choice, now: Duration) -> Result<Self, OpenError> {
        let setup = choice.setup()?;
        let mut about = about("live", &setup.scenario.name, "", &setup, Value::Null);
        about["command"] = choice.command().into();
        let mut pace = Pace::new(Speed::Factor(1.0), setup.scenario.step_ms, now);
        pace.pause();
        let feed = Feed::new(&setup);
        // The log has only the inputs, which the hash does not depend on.
        let mut team = Team::new(setup, LogLevel::Off, MemoryLog::default())?;
        // The first calls start the collection of events, messages and curves.
        team.take_events();
        team.observe();
        let outcome = team.simulation().outcome();
        Ok(Self {
            team,
            feed,
            pace,
            about,
            news: Vec::new(),
            outcome,
            has_sent_end: false,
        })
    }

    /// Returns the description of the run for the page.
    #[must_use]
    pub fn about(&self) -> &Value {
        &self.about
    }

    /// Executes a command of the page.
    pub fn execute(&mut self, command: ControlCommand, now: Duration) -> Reply {
        let reply = match command {
            ControlCommand::Fault(order) => self.team.order(order).map(Reply::Armed),
            ControlCommand::Clear(id) => self.team.clear(id.as_deref()).map(Reply::Cleared),
            ControlCommand::List => Ok(Reply::Faults(self.team.simulation().faults())),
            ControlCommand::Clock(command) => {
                let done = self.pace.execute(command, now);
                done.map(|()| Reply::Clock(self.pace.status(self.team.simulation().tick())))
            }
            ControlCommand::Status | ControlCommand::Describe => {
                let what = "this run has no processes and no folder";
                Err(Problem::of_value(what, "use 'list'"))
            }
        };
        reply.unwrap_or_else(|problem| Reply::Refused(problem.to_string()))
    }

    /// Runs the ticks that are due, at most `ticks`. Returns the time until the next one, or `None` if the clock stands.
    ///
    /// # Errors
    /// If a tick cannot be recorded.
    pub fn advance(&mut self, now: Duration, ticks: u32) -> Result<Option<Duration>, TickError> {
        for _ in 0..ticks {
            if self.outcome.is_some() {
                return Ok(None);
            }
            if !self.pace.is_due(now) {
                break;
            }
            self.pace.tick_begun(now);
            self.tick()?;
        }
        if self.outcome.is_none() && self.pace.is_due(now) {
            return Ok(Some(Duration::ZERO));
        }
        let due = self.pace.due().filter(|_| self.outcome.is_none());
        Ok(due.map(|due| due.saturating_sub(now)))
    }

    /// Runs one tick, regardless of the clock.
    ///
    /// # Errors
    /// If the tick cannot be recorded.
    pub fn tick(&mut self) -> Result<Option<Outcome>, TickError> {
        let tick = self.team.simulation().tick();
        self.outcome = self.team.tick()?;
        let events = self.team.take_events();
        if !events.is_empty() {
            let frame = self.feed.add_events(&TickEvents { tick, events });
            self.news.extend(frame);
        }
        Ok(self.outcome)
    }

    /// Returns the frames since the last call: all news, the newest view, the hash so far, and the end of the run.
    pub fn frames(&mut self) -> Vec<String> {
        let mut frames = std::mem::take(&mut self.news);
        let mut view = self.team.observe();
        view.clock = Some(self.pace.status(view.tick));
        if let Some(shown) = self.feed.add_view(view) {
            frames.extend(shown.news);
            frames.push(shown.view);
        }
        frames.push(json!({"hash": self.hash()}).to_string());
        if let Some(outcome) = self.outcome
            && !self.has_sent_end
        {
            self.has_sent_end = true;
            frames.push(json!({"ended": {"outcome": outcome, "folder": ""}}).to_string());
        }
        frames
    }

    /// Returns the hash of the run so far.
    #[must_use]
    pub fn hash(&self) -> String {
        self.team.hash()
    }
}
