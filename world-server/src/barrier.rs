//! The barrier of the step clock. It decides which agents take part in a tick, which of their reports count, and which
//! broadcasts each agent receives. It contains no physics, no sockets and no wall clock.
//!
//! States of a robot's place:
//!
//! ```text
//! Empty --invite--> Invited --arrive--> Entering --next tick--> Present --stall--> Silent
//!   ^                  |                    ^                      |                 |
//!   +- gone, give up --+--------------------|------- gone ---------+-----------------+
//!   |                                       +------------- reports again ------------+
//! ```
//!
//! An agent that was given up may still arrive if no other agent was invited in the meantime.
//!
//! Process faults of the scenario take effect at a tick, and the tick waits for them:
//! - A robot that is [to be killed](Barrier::kill_after_tick) counts once more, but its broadcasts are not listed.
//! - A [suspended](Barrier::suspend) robot is out until it is [readmitted](Barrier::readmit).
//! - An [expected](Barrier::expect) robot holds the tick back until it has arrived.
//!
//! `place`: the state of one robot. `joining`: arrivals and departures. `process_faults`: the faults above. `manifests`: the
//! broadcasts of a tick.

mod joining;
mod manifests;
mod place;
mod process_faults;

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

use prefetch::prefetch;
use proto::tick::Report;
use run_log::Input;
use scenario::ids::{Incarnation, RobotId, Tick};
use scenario::{Robot, StepOrder};

pub use manifests::RadioReach;
pub(crate) use manifests::sort_manifest;
pub use place::Presence;
pub(crate) use place::RobotSlot;

/// The maximum number of broadcasts of one robot in one tick. A report with more is malformed.
pub(crate) const MAX_BROADCASTS: u16 = 256;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The report counts, unless the world decides otherwise before the tick ends.
    Counted,
    /// The report ends the silence of an agent, which takes part again from the next tick on.
    SilenceEnded,
    /// The report is from an older incarnation of the robot. That agent must end.
    Superseded,
    /// The report is ignored: not for the current tick, a duplicate, or from a robot without an agent.
    Stale,
    /// The report is ignored: no correct agent sends such contents.
    Malformed,
}

#[derive(Clone, Debug, Default)]
pub struct TickResult {
    /// By rank: `true` if the robot counted.
    pub counted: Vec<bool>,
    pub dead: Vec<RobotId>,
    /// The external inputs of this tick.
    pub inputs: Vec<Input>,
}

#[derive(Clone, Debug)]
pub struct Barrier {
    places: Vec<RobotSlot>,
    order: StepOrder,
    tick: Tick,
    started: bool,
    /// Keeps the clock running without participants, because a later event brings a robot back.
    runs_on: bool,
    /// Index where the last search found a place that the tick waits for. The next search starts here, which keeps reports cheap.
    open: Cell<usize>,
    /// Participants of the current tick that it has not been sent to.
    to_ask: VecDeque<RobotId>,
    /// Robots that the scenario starts in the current tick. The tick waits for them.
    expected: BTreeSet<RobotId>,
    inputs: Vec<Input>,
    /// Order index of the next external input within the tick; `None` while reports are gathered.
    moment: Option<u32>,
    /// Number of external inputs at this order index.
    external_count: u32,
    /// Robots that died before the current tick was sent.
    dead: Vec<RobotId>,
}

impl Barrier {
    /// Creates a barrier at tick 0 without any agent. `robots` are in order of rank.
    #[must_use]
    pub fn new<'r>(robots: impl IntoIterator<Item = &'r Robot>, order: StepOrder) -> Self {
        let places = robots.into_iter().map(RobotSlot::new).collect();
        Self {
            places,
            order,
            tick: 0,
            started: false,
            runs_on: false,
            open: Cell::new(0),
            to_ask: VecDeque::new(),
            expected: BTreeSet::new(),
            inputs: Vec::new(),
            moment: None,
            external_count: 0,
            dead: Vec::new(),
        }
    }

    /// Requests the memory of the lists, see [`prefetch`](mod@prefetch).
    pub fn prefetch(&self) {
        prefetch(&*self.places);
    }

    #[must_use]
    pub fn tick(&self) -> Tick {
        self.tick
    }

    /// Returns `true` if the clock runs, which requires that every robot of the scenario has arrived.
    #[must_use]
    pub fn started(&self) -> bool {
        self.started
    }

    #[must_use]
    pub fn presence(&self, robot: RobotId) -> Presence {
        self.places[robot.index()].presence
    }

    /// Returns the incarnation that currently holds the robot.
    #[must_use]
    pub fn incarnation(&self, robot: RobotId) -> Option<Incarnation> {
        let place = &self.places[robot.index()];
        (place.presence != Presence::Empty).then_some(place.incarnation)
    }

    /// Returns `true` if the robot ever had an agent, or lost it before it arrived.
    #[must_use]
    pub fn was_ever_invited(&self, robot: RobotId) -> bool {
        let place = &self.places[robot.index()];
        place.incarnation > 0 || place.start_without
    }

    pub fn robots(&self) -> impl Iterator<Item = RobotId> + use<> {
        (0..self.places.len() as u32).map(RobotId)
    }

    /// Returns the number of external inputs since the last call, and resets it. Later inputs have larger order indexes.
    pub fn take_external_count(&mut self) -> u32 {
        std::mem::take(&mut self.external_count)
    }

    /// Sets the order index of the next external input within the tick. `None` while reports are gathered, because those arrive
    /// in any order.
    pub fn set_order_index(&mut self, moment: Option<u32>) {
        self.moment = moment;
    }

    pub fn report(&mut self, report: &Report) -> Verdict {
        let Some(place) = self.places.get_mut(report.robot.index()) else {
            return Verdict::Malformed;
        };
        if place.presence == Presence::Empty || report.incarnation > place.incarnation {
            return Verdict::Stale;
        }
        if report.incarnation < place.incarnation {
            return Verdict::Superseded;
        }
        // Only an answer to the latest tick that it was sent ends a silence. An older report is a replayed message.
        if place.presence == Presence::Silent
            && !place.lost
            && !place.suspended
            && report.tick == place.unanswered
        {
            place.presence = Presence::Entering { again: true };
            self.enter_if_idle();
            return Verdict::SilenceEnded;
        }
        if place.presence != Presence::Present
            || place.lost
            || !place.tick_sent
            || place.answer.is_some()
            || report.tick != self.tick
        {
            return Verdict::Stale;
        }
        if report.broadcasts > MAX_BROADCASTS {
            return Verdict::Malformed;
        }
        place.count(report);
        Verdict::Counted
    }

    /// Returns `true` if a report of the robot counts in the current tick.
    #[must_use]
    pub fn has_answered(&self, robot: RobotId) -> bool {
        self.places[robot.index()].answer.is_some()
    }

    #[must_use]
    pub fn is_lost(&self, robot: RobotId) -> bool {
        self.places[robot.index()].lost
    }

    pub fn set_runs_without_participants(&mut self, runs_on: bool) {
        self.runs_on = runs_on;
    }

    /// Returns `true` if the current tick waits for this robot's report.
    #[must_use]
    pub fn is_awaited(&self, robot: RobotId) -> bool {
        let place = &self.places[robot.index()];
        self.started
            && place.presence == Presence::Present
            && place.tick_sent
            && !place.lost
            && place.answer.is_none()
    }

    /// Returns the next robot to send the current tick to. In order, a robot is next after its predecessor has answered.
    pub fn next_recipient(&mut self, radio: &impl RadioReach) -> Option<RobotId> {
        if self.to_ask.is_empty() {
            self.line_up(radio);
        }
        self.to_ask.pop_front()
    }

    /// Moves all robots to send the current tick to into `recipients`, in order of rank. The team must not step in order.
    pub fn take_recipients(&mut self, radio: &impl RadioReach, recipients: &mut Vec<RobotId>) {
        debug_assert_ne!(
            self.order,
            StepOrder::InOrder,
            "a robot waits for the one before"
        );
        if self.to_ask.is_empty() {
            self.line_up(radio);
        }
        recipients.clear();
        recipients.extend(self.to_ask.drain(..));
    }

    /// Returns the places by rank.
    pub(crate) fn places_mut(&mut self) -> &mut [RobotSlot] {
        &mut self.places
    }

    /// Queues the robots that are to be sent the tick. All are marked at once, so that events in between find them marked.
    fn line_up(&mut self, radio: &impl RadioReach) {
        if !self.started || !self.expected.is_empty() {
            return;
        }
        // In order, later robots receive the broadcasts of robots that have already answered.
        if self.order == StepOrder::InOrder {
            self.list_all(radio);
        }
        for (index, place) in self.places.iter_mut().enumerate() {
            if place.presence != Presence::Present || place.lost || place.answer.is_some() {
                continue;
            }
            if !std::mem::replace(&mut place.tick_sent, true) {
                self.to_ask.push_back(RobotId(index as u32));
            }
            if self.order == StepOrder::InOrder {
                break;
            }
        }
    }

    /// Returns `true` if no agent can act in the current tick. The clock then stands still until an agent arrives. Suspended robots
    /// keep it running, because an operator may resume them at any time.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        !self.runs_on
            && self.inputs.is_empty()
            && self
                .places
                .iter()
                .all(|place| place.presence != Presence::Present && !place.is_suspended())
    }

    /// Returns `true` if no agent is left that could act later, including silent and joining ones.
    #[must_use]
    pub fn has_no_agents(&self) -> bool {
        self.places
            .iter()
            .all(|place| place.presence == Presence::Empty || place.lost)
    }

    /// Returns `true` if the current tick waits for no further report.
    #[inline]
    #[must_use]
    pub fn is_complete(&self) -> bool {
        let (before, after) = self.places.split_at(self.open.get());
        let open = match after.iter().position(RobotSlot::is_open) {
            Some(ahead) => Some(before.len() + ahead),
            None => before.iter().position(RobotSlot::is_open),
        };
        self.open.set(open.unwrap_or_default());
        self.started && open.is_none() && !self.is_idle()
    }

    /// Ends the current tick, writes its result to `gathered` and begins the next tick with all agents that have arrived.
    pub fn finish(&mut self, radio: &impl RadioReach, gathered: &mut TickResult) {
        gathered.counted.clear();
        gathered.dead.clear();
        gathered.dead.append(&mut self.dead);
        gathered.inputs.clear();
        gathered.inputs.append(&mut self.inputs);
        self.to_ask.clear();
        // Sorted by rank, so that the order of arrival has no effect. Inputs of one robot keep their order.
        if gathered.inputs.len() > 1 {
            let places = self.places.iter().zip(0..);
            let ranks: BTreeMap<&str, usize> = places
                .map(|(place, rank)| (place.name.as_str(), rank))
                .collect();
            let rank = |input: &Input| ranks.get(input.robot()?).copied();
            gathered.inputs.sort_by_cached_key(rank);
        }
        self.list_all(radio);
        for (index, place) in self.places.iter_mut().enumerate() {
            let answer = place.answer.take();
            gathered.counted.push(answer.is_some());
            match answer {
                // A report of an incarnation that was replaced in this tick counts, but not for its successor.
                Some(answer) if answer.incarnation == place.incarnation => {
                    place.last_counted = Some(self.tick);
                }
                Some(_) => {}
                // A robot receives nothing in ticks in which it did not count.
                None => place.manifest.clear(),
            }
            if place.end_tick() {
                gathered.dead.push(RobotId(index as u32));
            }
            place.enter(false, None, &mut self.inputs);
        }
        self.tick += 1;
    }
}

#[cfg(test)]
mod tests;
