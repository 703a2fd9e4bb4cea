//! A run with a clock, orders of a person, and frames for the page; and a second run beside it, for a comparison.

use std::collections::VecDeque;
use std::hint::black_box;
use std::time::Duration;

use in_process::{StartError, TickError};
use observation::about::about;
use proto::control::{ControlCommand, Reply};
use proto::tick::Outcome;
use proto::view::View;
use scenario::fault::Order;
use scenario::ids::Tick;
use scenario::{Problem, Setup};
use serde_json::{Value, json};
use world_server::pace::{Pace, Speed};

use crate::choice::{Choice, GivenOrder};
use crate::run::Run;

/// The memory of a run without its team, and for each pair of robots, which exchange messages, bytes.
const RUN_BYTES: usize = 32 << 20;
const PAIR_BYTES: usize = 512;
/// The largest memory that is reserved in advance, bytes. A module has at most 4 GiB.
const RESERVED_MAX: usize = 1 << 30;

/// Begins each frame of the second run. `launch/page/source/engine.js` reads it.
const BESIDE: &str = "+";

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
    run: Run,
    /// A run with another allocator, which has the same clock and the same orders.
    beside: Option<Run>,
    pace: Pace<Duration>,
    about: Value,
    /// Orders of the choice whose ticks have not begun.
    planned: VecDeque<GivenOrder>,
    /// The orders so far.
    given: Vec<GivenOrder>,
    has_sent_end: bool,
}

impl Engine {
    /// Creates a run that is paused before its first tick.
    ///
    /// # Errors
    /// If the choice is invalid.
    pub fn open(choice: &Choice, now: Duration) -> Result<Self, OpenError> {
        let setup = choice.setup()?;
        let second = choice.second();
        let runs = 1 + usize::from(second.is_some());
        reserve_memory(runs, setup.scenario.robots.len());
        let mut about = describe(choice, &setup);
        let mut pace = Pace::new(Speed::Factor(1.0), setup.scenario.step_ms, now);
        pace.pause();
        let mut run = Run::new(setup)?;
        let mut beside = None;
        if let Some(choice) = second {
            let setup = choice.setup()?;
            about["beside"] = describe(&choice, &setup);
            let mut second = Run::new(setup)?;
            run.count_messages();
            second.count_messages();
            beside = Some(second);
        }
        Ok(Self {
            run,
            beside,
            pace,
            about,
            planned: choice.orders.iter().cloned().collect(),
            given: Vec::new(),
            has_sent_end: false,
        })
    }

    /// Returns the description of the run for the page.
    #[must_use]
    pub fn about(&self) -> &Value {
        &self.about
    }

    /// Returns the present view of the first run.
    pub fn view(&mut self) -> View {
        self.run.view()
    }

    /// Returns the next tick. The run that is over first keeps its last one.
    fn next_tick(&self) -> Tick {
        let beside = self.beside.as_ref().map(Run::next_tick);
        self.run.next_tick().max(beside.unwrap_or_default())
    }

    /// Executes a command of the page.
    pub fn execute(&mut self, command: ControlCommand, now: Duration) -> Reply {
        let tick = self.next_tick();
        let given = command.clone();
        let reply = match command {
            ControlCommand::Fault(order) => self.order(order),
            ControlCommand::Clear(id) => self.clear(id.as_deref()),
            ControlCommand::List => Ok(Reply::Faults(self.run.faults())),
            ControlCommand::Clock(command) => {
                let done = self.pace.execute(command, now);
                done.map(|()| Reply::Clock(self.pace.status(tick)))
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

    /// Orders a fault in both runs. An order that the first run refuses does not reach the second one. The second run may
    /// refuse it, for example because a robot is already dead there.
    fn order(&mut self, order: Order) -> Result<Reply, Problem> {
        let armed = self.run.order(order.clone())?;
        if let Some(beside) = &mut self.beside {
            // The same id, so that both faults are cleared together.
            let id = Some(armed.id.clone());
            let _ = beside.order(Order { id, ..order });
        }
        Ok(Reply::Armed(armed))
    }

    fn clear(&mut self, id: Option<&str>) -> Result<Reply, Problem> {
        let cleared = self.run.clear(id)?;
        if let Some(beside) = &mut self.beside {
            // The fault may be over there.
            let _ = beside.clear(id);
        }
        Ok(Reply::Cleared(cleared))
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
            if self.outcome().is_some() {
                return Ok(None);
            }
            if !self.pace.is_due(now) {
                break;
            }
            self.pace.tick_begun(now);
            self.tick()?;
        }
        if self.outcome().is_none() && self.pace.is_due(now) {
            return Ok(Some(Duration::ZERO));
        }
        let due = self.pace.due().filter(|_| self.outcome().is_none());
        Ok(due.map(|due| due.saturating_sub(now)))
    }

    /// Runs one tick, regardless of the clock. Returns the outcome as [`Engine::outcome`].
    ///
    /// # Errors
    /// If the tick cannot be recorded.
    pub fn tick(&mut self) -> Result<Option<Outcome>, TickError> {
        let tick = self.next_tick();
        while let Some((_, command)) = self.planned.pop_front_if(|(at, _)| *at <= tick) {
            // A refused order has no effect, as when it was given.
            self.execute(command, Duration::ZERO);
        }
        self.run.tick()?;
        if let Some(beside) = &mut self.beside {
            beside.tick()?;
        }
        Ok(self.outcome())
    }

    /// Returns the outcome of the run, or `None` until both runs are over.
    #[must_use]
    pub fn outcome(&self) -> Option<Outcome> {
        let is_over = |run: &Run| run.outcome().is_some();
        self.run
            .outcome()
            .filter(|_| self.beside.as_ref().is_none_or(is_over))
    }

    /// Returns the frames since the last call: all news, the newest view, the hash so far, and the end of the run. Frames of
    /// the second run begin with `+`.
    pub fn frames(&mut self) -> Vec<String> {
        let clock = self.pace.status(self.next_tick());
        let mut frames = self.run.frames(clock.clone());
        let mut beside = match &mut self.beside {
            Some(beside) => beside.frames(clock),
            None => Vec::new(),
        };
        if self.outcome().is_some() && !self.has_sent_end {
            self.has_sent_end = true;
            frames.push(self.run.end_frame());
            beside.extend(self.beside.as_ref().map(Run::end_frame));
        }
        frames.extend(beside.iter().map(|frame| format!("{BESIDE}{frame}")));
        frames
    }

    /// Returns the hash of the run so far.
    #[must_use]
    pub fn hash(&self) -> String {
        self.run.hash()
    }
}

/// Grows the module's memory once. Otherwise the first messages of a large team make it grow thousands of times by 64 KiB,
/// and a browser may collect garbage each time. Memory that is never written takes addresses only.
fn reserve_memory(runs: usize, robots: usize) {
    let team = PAIR_BYTES.saturating_mul(robots * robots);
    let bytes = team.saturating_add(RUN_BYTES).saturating_mul(runs);
    let mut space = Vec::<u8>::new();
    // Without so much memory, the run grows step by step. The memory stays with the module after this allocation.
    let _ = space.try_reserve_exact(bytes.min(RESERVED_MAX));
    black_box(&space);
}

/// Returns the description of a chosen run for the page.
fn describe(choice: &Choice, setup: &Setup) -> Value {
    let mut about = about("live", &setup.scenario.name, "", setup, Value::Null);
    about["command"] = json!(choice.command());
    about
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
        assert_eq!(engine.next_tick(), 1);

        clock(&mut engine, ClockCommand::Step(3));
        clock(&mut engine, ClockCommand::Speed(None));
        assert_eq!(engine.advance(NOW, 2).unwrap(), Some(Duration::ZERO));
        assert_eq!(engine.advance(NOW, 100).unwrap(), None);
        assert_eq!(engine.next_tick(), 4);
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
            match first.next_tick() {
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

    /// A person kills a robot in two runs beside each other. Each has the hash of a run alone with the same order.
    #[test]
    fn two_runs_beside_each_other_are_those_of_each_allocator() {
        let choice = |allocator: &str| Choice {
            allocator: Some(allocator.to_owned()),
            ..Choice::default()
        };
        let mut pair = choice("grape");
        pair.beside = Some("cbba".to_owned());
        let mut pair = Engine::open(&pair, NOW).unwrap();
        let alone = ["grape", "cbba"].map(|allocator| Engine::open(&choice(allocator), NOW));
        let mut alone = alone.map(Result::unwrap);
        while pair.outcome().is_none() {
            let is_due = pair.next_tick() == 1000;
            for engine in alone.iter_mut().chain([&mut pair]) {
                if is_due {
                    let kill = Order::now(Fault::Kill("gold".to_owned()));
                    let reply = engine.execute(ControlCommand::Fault(kill), NOW);
                    assert!(matches!(reply, Reply::Armed(_)), "{reply:?}");
                }
                engine.tick().unwrap();
            }
        }
        let frames = pair.frames();
        for (prefix, engine) in ["", BESIDE].into_iter().zip(&alone) {
            let hash = format!(r#"{prefix}{{"hash":"{}"}}"#, engine.hash());
            assert!(frames.contains(&hash), "{hash}");
            let end = format!(r#"{prefix}{{"ended":"#);
            let ends = frames.iter().filter(|frame| frame.starts_with(&end));
            assert_eq!(ends.count(), 1);
        }
        assert_ne!(alone[0].hash(), alone[1].hash());
        assert_eq!(pair.orders().len(), 1);
    }
}
