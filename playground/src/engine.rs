//! A run with a clock, orders of a person, and frames for the page.

use std::collections::VecDeque;
use std::time::Duration;

use in_process::{StartError, Team, TickError};
use observation::about::about;
use observation::feed::Feed;
use proto::control::{ControlCommand, Reply};
use proto::event::TickEvents;
use proto::tick::Outcome;
use proto::view::View;
use run_log::{LogLevel, MemoryLog};
use scenario::Problem;
use serde_json::{Value, json};
use world_server::pace::{Pace, Speed};

use crate::choice::{Choice, GivenOrder};

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
    /// Orders of the choice whose ticks have not begun.
    planned: VecDeque<GivenOrder>,
    /// The orders so far.
    given: Vec<GivenOrder>,
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
            planned: choice.orders.iter().cloned().collect(),
            given: Vec::new(),
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

    /// Returns the present view of the run.
    pub fn view(&mut self) -> View {
        self.team.observe()
    }

    /// Executes a command of the page.
    pub fn execute(&mut self, command: ControlCommand, now: Duration) -> Reply {
        let tick = self.team.simulation().tick();
        let given = command.clone();
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
        if matches!(reply, Ok(Reply::Armed(_) | Reply::Cleared(_))) {
            self.given.push((tick, given));
        }
        reply.unwrap_or_else(|problem| Reply::Refused(problem.to_string()))
    }

    /// Returns the orders so far, with which a [`Choice`] repeats the run.
    #[must_use]
    pub fn orders(&self) -> &[GivenOrder] {
        &self.given
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
        while let Some((_, command)) = self.planned.pop_front_if(|(at, _)| *at <= tick) {
            // A refused order has no effect, as when it was given.
            self.execute(command, Duration::ZERO);
        }
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
        let mut view = self.view();
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

#[cfg(test)]
mod tests {
    use proto::control::ClockCommand;
    use scenario::fault::{Fault, Order};

    use super::*;

    const NOW: Duration = Duration::from_secs(9);

    fn engine() -> Engine {
        Engine::open(&Choice::default(), Duration::ZERO).unwrap()
    }

    fn clock(engine: &mut Engine, command: ClockCommand) -> Reply {
        engine.execute(ControlCommand::Clock(command), NOW)
    }

    fn parsed(frames: &[String]) -> Vec<Value> {
        let frames = frames.iter();
        frames
            .map(|frame| serde_json::from_str(frame).unwrap())
            .collect()
    }

    fn kinds(frames: &[Value]) -> Vec<&str> {
        let frames = frames.iter();
        frames
            .map(|frame| frame.as_object().unwrap().keys().next().unwrap().as_str())
            .collect()
    }

    #[test]
    fn a_run_waits_at_its_start_and_follows_its_clock() {
        let mut engine = engine();
        assert_eq!(engine.advance(NOW, 100).unwrap(), None);
        let start = parsed(&engine.frames());
        assert_eq!(kinds(&start), ["view", "hash"]);
        assert_eq!(start[0]["view"]["tick"], 0);

        // One tick of real time, and the next one 50 ms later.
        let reply = clock(&mut engine, ClockCommand::Resume);
        assert!(matches!(reply, Reply::Clock(status) if !status.paused));
        let next = engine.advance(NOW, 100).unwrap();
        assert_eq!(next, Some(Duration::from_millis(50)));
        assert_eq!(engine.team.simulation().tick(), 1);

        clock(&mut engine, ClockCommand::Step(3));
        clock(&mut engine, ClockCommand::Speed(None));
        assert_eq!(engine.advance(NOW, 2).unwrap(), Some(Duration::ZERO));
        assert_eq!(engine.advance(NOW, 100).unwrap(), None);
        assert_eq!(engine.team.simulation().tick(), 4);
        let refused = clock(&mut engine, ClockCommand::Step(0));
        assert_eq!(
            refused,
            Reply::Refused("step: 0 is no step; use at least 1".to_owned())
        );
    }

    #[test]
    fn orders_become_events_and_the_end_is_sent_once() {
        let mut engine = engine();
        let kill = |robot: &str| ControlCommand::Fault(Order::now(Fault::Kill(robot.to_owned())));
        engine.tick().unwrap();
        let reply = engine.execute(kill("gold"), NOW);
        assert!(matches!(reply, Reply::Armed(armed) if armed.tick == Some(1)));
        engine.tick().unwrap();
        let frames = parsed(&engine.frames());
        let events = frames.iter().filter_map(|frame| frame["events"].as_array());
        let is_death = |event: &&Value| event["kind"] == "gone" && event["robot"] == "gold";
        assert_eq!(events.flatten().filter(is_death).count(), 1);
        let Reply::Refused(reason) = engine.execute(kill("gold"), NOW) else {
            panic!("a dead robot is killed");
        };
        assert!(reason.starts_with("'gold' has no process"), "{reason}");

        for robot in ["blue", "green"] {
            engine.execute(kill(robot), NOW);
        }
        while engine.tick().unwrap().is_none() {}
        let frames = parsed(&engine.frames());
        assert_eq!(frames.last().unwrap()["ended"]["outcome"], "no-robot-left");
        assert_eq!(engine.advance(NOW, 1).unwrap(), None);
        assert_eq!(kinds(&parsed(&engine.frames())), ["view", "hash"]);
    }

    /// A person kills and restarts a robot while the run goes on. The choice with the same orders has the same hash.
    #[test]
    fn a_choice_with_the_orders_of_a_run_repeats_it() {
        let mut first = engine();
        let ordered = |fault| ControlCommand::Fault(Order::now(fault));
        for _ in 0..2000 {
            match first.team.simulation().tick() {
                500 | 501 => first.execute(ordered(Fault::Kill("gold".to_owned())), NOW),
                900 => first.execute(ordered(Fault::Restart("gold".to_owned())), NOW),
                901 => first.execute(ControlCommand::Clear(None), NOW),
                _ => Reply::Faults(Vec::new()),
            };
            first.tick().unwrap();
        }
        // The second kill is refused. The kill is cleared last.
        let ticks: Vec<u64> = first.orders().iter().map(|(tick, _)| *tick).collect();
        assert_eq!(ticks, [500, 900, 901]);
        let choice = json!({"orders": first.orders()});
        let choice: Choice = serde_json::from_value(choice).unwrap();
        let mut again = Engine::open(&choice, Duration::ZERO).unwrap();
        let mut plain = engine();
        for _ in 0..2000 {
            again.tick().unwrap();
            plain.tick().unwrap();
        }
        assert_eq!(again.hash(), first.hash());
        assert_eq!(again.orders(), first.orders());
        assert_ne!(plain.hash(), first.hash());
    }
}
