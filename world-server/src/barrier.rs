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

mod place;

use std::cell::Cell;
use std::collections::{BTreeSet, VecDeque};

use proto::join::Refusal;
use proto::tick::{ManifestEntry, Report};
use run_log::Input;
use scenario::ids::{Incarnation, RobotId, Tick};
use scenario::{Robot, StepOrder};

pub use place::Presence;
use place::{CountedAnswer, RobotSlot};

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

/// A robot that the current tick is to be sent to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TickRecipient {
    pub robot: RobotId,
    pub incarnation: Incarnation,
    /// The latest tick in which this incarnation counted.
    pub last_counted: Option<Tick>,
}

#[derive(Clone, Debug, Default)]
pub struct TickResult {
    /// By rank: `true` if the robot counted.
    pub counted: Vec<bool>,
    pub dead: Vec<RobotId>,
    /// The external inputs of this tick.
    pub inputs: Vec<Input>,
}

/// The range of the robots' radios.
pub trait RadioReach {
    /// Calls `hear` once for each robot in range of the sender.
    fn for_each_receiver(&self, sender: RobotId, hear: impl FnMut(RobotId));
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
        (0..self.places.len() as u16).map(RobotId)
    }

    /// Offers a robot to an agent. Returns the robot, its incarnation and the earliest tick that it can take part in.
    ///
    /// # Errors
    /// [`Refusal::UnknownRobot`] and [`Refusal::Taken`].
    pub fn invite(&mut self, name: &str) -> Result<(RobotId, Incarnation, Tick), Refusal> {
        let Some(index) = self.places.iter().position(|place| place.name == name) else {
            return Err(Refusal::UnknownRobot {
                robot: name.to_owned(),
                known: self.places.iter().map(|place| place.name.clone()).collect(),
            });
        };
        // Without participants no tick ends, so a new agent enters the current tick. So does an expected agent.
        let expected = self.expected.contains(&RobotId(index as u16));
        let later = self.started && !self.is_idle() && !expected;
        let first_tick = self.tick + Tick::from(later);
        let place = &mut self.places[index];
        if place.absent {
            return Err(Refusal::Absent {
                robot: name.to_owned(),
            });
        }
        // An agent that died in this tick has left already, though its death is recorded only when the tick ends.
        if place.presence != Presence::Empty && !place.lost {
            return Err(Refusal::Taken {
                robot: name.to_owned(),
                incarnation: place.incarnation,
            });
        }
        place.presence = Presence::Invited;
        place.start_without &= self.started;
        place.may_still_arrive = false;
        place.incarnation += 1;
        place.last_counted = None;
        Ok((RobotId(index as u16), place.incarnation, first_tick))
    }

    /// Registers that the liveliness token of an incarnation has appeared.
    pub fn arrive(&mut self, robot: RobotId, incarnation: Incarnation) {
        let place = &mut self.places[robot.index()];
        let is_due = match place.presence {
            Presence::Invited => true,
            Presence::Empty => place.may_still_arrive,
            _ => false,
        };
        if is_due && place.incarnation == incarnation {
            place.may_still_arrive = false;
            place.presence = Presence::Entering { again: false };
            if self.expected.remove(&robot) {
                place.enter(true, None, &mut self.inputs);
            }
            self.enter_if_idle();
        }
    }

    /// Frees the place of an invited agent whose token has not appeared in time. The agent may still arrive later if no other
    /// agent takes the place, because a large team starts slowly on a busy machine.
    pub fn give_up(&mut self, robot: RobotId, incarnation: Incarnation) {
        let place = &mut self.places[robot.index()];
        if place.presence == Presence::Invited && place.incarnation == incarnation {
            place.presence = Presence::Empty;
            place.may_still_arrive = true;
        }
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

    /// Registers that the liveliness token of an incarnation has disappeared, so its agent is dead. `asked_for` is `true` if the
    /// scenario is killing this agent.
    pub fn agent_lost(&mut self, robot: RobotId, incarnation: Incarnation, asked_for: bool) {
        let place = &mut self.places[robot.index()];
        if place.incarnation != incarnation {
            return;
        }
        match place.presence {
            Presence::Empty => {}
            Presence::Invited | Presence::Entering { again: false } => {
                place.presence = Presence::Empty;
            }
            _ if place.lost => {}
            Presence::Present | Presence::Silent | Presence::Entering { again: true } => {
                place.suspended = false;
                place.manifest.clear();
                let counted_now = place.answer.is_some().then_some(self.tick);
                // An agent that has reported dies in this tick as ordered. One that has not must have died of another cause.
                let owes_report = place.presence == Presence::Present && place.tick_sent;
                let scripted =
                    place.dies_after_tick && (counted_now.is_some() || (asked_for && !owes_report));
                self.external_count += u32::from(self.moment.is_some() && !scripted);
                self.inputs.push(Input::Gone {
                    robot: place.name.clone(),
                    incarnation,
                    last_counted: counted_now.or(place.last_counted),
                    listed: !place.dies_after_tick || counted_now.is_none(),
                    moment: self.moment.filter(|_| !scripted),
                    scripted,
                });
                // The place is free at once for a successor that the scenario starts in the same tick. While reports are gathered in
                // order, `asked` has no meaning here.
                if place.dies_after_tick && !place.tick_sent && self.moment.is_some() {
                    place.dies_after_tick = false;
                    place.presence = Presence::Empty;
                    self.dead.push(robot);
                } else {
                    place.lost = true;
                }
            }
        }
    }

    /// Excludes an agent that did not answer the current tick in time. It is out until it reports again.
    pub fn stall(&mut self, robot: RobotId) {
        if self.is_awaited(robot) {
            let place = &mut self.places[robot.index()];
            place.fall_silent(self.tick, false, &mut self.inputs);
        }
    }

    /// Marks the robot's agent to be killed in this tick: its report still counts, but its broadcasts are not delivered.
    pub fn kill_after_tick(&mut self, robot: RobotId) {
        self.places[robot.index()].dies_after_tick = true;
    }

    pub fn cancel_kill(&mut self, robot: RobotId) {
        self.places[robot.index()].dies_after_tick = false;
    }

    /// Suspends the robot's agent for the scenario before the tick is sent to it. It is out until it is readmitted.
    pub fn suspend(&mut self, robot: RobotId) {
        let place = &mut self.places[robot.index()];
        if place.presence == Presence::Present && !place.tick_sent && !place.lost {
            place.suspended = true;
            place.fall_silent(self.tick, true, &mut self.inputs);
        }
    }

    #[must_use]
    pub fn is_suspended(&self, robot: RobotId) -> bool {
        self.places[robot.index()].suspended
    }

    /// Readmits a suspended agent to the current tick.
    pub fn readmit(&mut self, robot: RobotId) {
        let place = &mut self.places[robot.index()];
        if std::mem::take(&mut place.suspended) && place.presence == Presence::Silent && !place.lost
        {
            place.presence = Presence::Entering { again: true };
            place.enter(true, None, &mut self.inputs);
        }
    }

    /// Ends the suspension of an agent that could not be resumed. It takes part again after its next report.
    pub fn release(&mut self, robot: RobotId) {
        self.places[robot.index()].suspended = false;
    }

    /// Makes the current tick wait for an agent that the scenario starts. An agent that has already arrived is admitted at once.
    pub fn expect(&mut self, robot: RobotId) {
        let place = &mut self.places[robot.index()];
        place.absent = false;
        if place.presence == (Presence::Entering { again: false }) {
            place.enter(true, None, &mut self.inputs);
        } else {
            self.expected.insert(robot);
        }
    }

    /// Returns `true` if an agent is joining but has not taken part yet.
    #[must_use]
    pub fn is_joining(&self, robot: RobotId) -> bool {
        let presence = self.places[robot.index()].presence;
        matches!(
            presence,
            Presence::Invited | Presence::Entering { again: false }
        )
    }

    /// Sets the next incarnation of a robot in a replay. The skipped incarnations ended before they took part.
    pub fn skip_to(&mut self, robot: RobotId, incarnation: Incarnation) {
        self.places[robot.index()].incarnation = incarnation - 1;
    }

    /// Stops waiting for an expected agent that will not arrive.
    pub fn cancel_expected(&mut self, robot: RobotId) {
        self.expected.remove(&robot);
    }

    pub fn mark_absent(&mut self, robot: RobotId) {
        self.places[robot.index()].absent = true;
    }

    #[must_use]
    pub fn is_absent(&self, robot: RobotId) -> bool {
        self.places[robot.index()].absent
    }

    /// Admits the logged incarnation of an agent in a replay: from the next tick on, or with `at_once` from the current order
    /// index of this tick on.
    pub fn admit(&mut self, robot: RobotId, incarnation: Incarnation, at_once: bool) {
        let place = &mut self.places[robot.index()];
        let again = place.presence != Presence::Empty && place.incarnation == incarnation;
        if !again {
            place.last_counted = None;
        }
        place.incarnation = incarnation;
        place.presence = Presence::Entering { again };
        if at_once {
            let moment = self.moment;
            place.enter(false, moment, &mut self.inputs);
            self.external_count += 1;
        } else {
            self.enter_if_idle();
        }
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
        place.answer = Some(CountedAnswer {
            incarnation: report.incarnation,
            broadcasts: report.broadcasts,
        });
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

    /// Returns `true` if the robot's agent has died in the current tick in which it was to be killed.
    #[must_use]
    pub fn is_killed(&self, robot: RobotId) -> bool {
        let place = &self.places[robot.index()];
        place.lost && place.dies_after_tick
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

    /// Starts the clock without this robot, whose process has ended or is stopped, unless an agent for it arrives before.
    pub fn start_without(&mut self, robot: RobotId) {
        let place = &mut self.places[robot.index()];
        place.start_without |= !self.started && place.presence == Presence::Empty && !place.absent;
    }

    /// Starts the clock if every robot has arrived, except robots to [start without](Self::start_without). At least one robot must
    /// be present. Returns `true` if the clock runs.
    pub fn start_if_all_arrived(&mut self) -> bool {
        if self.started {
            return true;
        }
        let is_here = |place: &RobotSlot| matches!(place.presence, Presence::Entering { .. });
        let is_due = |place: &RobotSlot| !place.absent && !place.start_without && !is_here(place);
        // Robots mostly arrive by rank, so a search from the end finds a missing one soonest.
        if !self.places.iter().rev().any(is_due)
            && (self.places.iter().any(is_here)
                || self.places.iter().all(|place| !place.start_without))
        {
            self.started = true;
            for place in self.places.iter().filter(|place| place.start_without) {
                self.inputs.push(Input::Gone {
                    robot: place.name.clone(),
                    // No incarnation of this robot has taken part.
                    incarnation: 0,
                    last_counted: None,
                    listed: true,
                    moment: None,
                    scripted: false,
                });
            }
            self.enter();
        }
        self.started
    }

    /// Returns the next robot to send the current tick to. In order, a robot is next after its predecessor has answered.
    pub fn next_recipient(&mut self, radio: &impl RadioReach) -> Option<TickRecipient> {
        if self.to_ask.is_empty() {
            self.line_up(radio);
        }
        let robot = self.to_ask.pop_front()?;
        let place = &self.places[robot.index()];
        Some(TickRecipient {
            robot,
            incarnation: place.incarnation,
            last_counted: place.last_counted,
        })
    }

    /// Moves the manifest of a robot that is sent the tick into `manifest`, sorted by (sender, tick). Replaces its contents.
    #[inline]
    pub fn take_manifest(&mut self, robot: RobotId, manifest: &mut Vec<ManifestEntry>) {
        let listed = &mut self.places[robot.index()].manifest;
        // Both are empty in most ticks.
        if !(listed.is_empty() && manifest.is_empty()) {
            Self::exchange(listed, manifest);
        }
    }

    fn exchange(listed: &mut Vec<ManifestEntry>, manifest: &mut Vec<ManifestEntry>) {
        std::mem::swap(listed, manifest);
        listed.clear();
        // The entries are already sorted, except those of a sender that answered before this robot was sent the tick.
        if !manifest.is_sorted() {
            manifest.sort_unstable();
        }
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
                self.to_ask.push_back(RobotId(index as u16));
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
        let rank = |input: &Input| {
            let named = |place: &RobotSlot| input.robot() == Some(&place.name);
            self.places.iter().position(named)
        };
        gathered.inputs.sort_by_cached_key(rank);
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
                gathered.dead.push(RobotId(index as u16));
            }
            place.enter(false, None, &mut self.inputs);
        }
        self.tick += 1;
    }

    /// Adds the broadcasts of all reports to the manifests of the participants in range. Leaves out robots to be killed.
    fn list_all(&mut self, radio: &impl RadioReach) {
        for sender in 0..self.places.len() {
            let place = &mut self.places[sender];
            let Some(answer) = place.answer else {
                continue;
            };
            if std::mem::replace(&mut place.listed, true)
                || place.dies_after_tick
                || answer.broadcasts == 0
            {
                continue;
            }
            let entry = ManifestEntry {
                sender: RobotId(sender as u16),
                tick: self.tick,
                incarnation: answer.incarnation,
                count: answer.broadcasts,
                link: None,
            };
            radio.for_each_receiver(entry.sender, |hearer| {
                let place = &mut self.places[hearer.index()];
                if hearer != entry.sender && place.presence == Presence::Present && !place.lost {
                    place.manifest.push(entry.clone());
                }
            });
        }
    }

    /// Admits arrived agents to the current tick if it has no participants, because such a tick does not end.
    fn enter_if_idle(&mut self) {
        if self.started && self.is_idle() {
            self.enter();
        }
    }

    /// Admits arrived agents. Each gets its own order index, except at the beginning of a tick.
    fn enter(&mut self) {
        let order_index = self.moment.filter(|moment| *moment > 0);
        for place in &mut self.places {
            if matches!(place.presence, Presence::Entering { .. }) {
                let moment = order_index.map(|moment| moment + self.external_count);
                place.enter(false, moment, &mut self.inputs);
                self.external_count += u32::from(order_index.is_some());
            }
        }
    }
}

#[cfg(test)]
mod tests;
