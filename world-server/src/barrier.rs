//! The barrier: which agents take part in a tick, which of their reports count, and what each of them will hear
//! (DESIGN §4). Knows neither physics nor sockets nor the wall clock.
//!
//! A robot's place goes through these states:
//!
//! ```text
//! Empty --invite--> Invited --arrive--> Entering --next tick--> Present --stall--> Silent
//!   ^                  |                    ^                      |                 |
//!   +- gone, give up --+--------------------|------- gone ---------+-----------------+
//!                                           +------------- speaks again -------------+
//! ```
//!
//! One that was given up may still arrive, as long as nobody else was invited to its place.
//!
//! What the scenario asks of a process happens at a tick, and the tick waits for it: a robot that is [to be killed](Barrier::kill_after_tick)
//! counts once more and is not listed; one that is [suspended](Barrier::suspend) is out until it is
//! [readmitted](Barrier::readmit); one that is [expected](Barrier::expect) holds the tick back until it has arrived.

mod place;

use std::cell::Cell;
use std::collections::{BTreeSet, VecDeque};

use alliance_proto::ids::{Incarnation, RobotId, Tick};
use alliance_proto::join::Refusal;
use alliance_proto::log::Input;
use alliance_proto::scenario::{Robot, StepOrder};
use alliance_proto::tick::{ManifestEntry, Report};

pub use place::Presence;
use place::{Listing, Place};

/// Most broadcasts that one robot may send in one tick; a report that claims more is malformed.
pub(crate) const MAX_BROADCASTS: u16 = 256;

/// What became of a report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It counts, unless the world decides otherwise before the tick ends.
    Counted,
    /// A silent agent spoke: it comes back with the next tick.
    BackAgain,
    /// From another incarnation than the one that has the robot: that agent must end.
    Superseded,
    /// Not an answer to the current tick, or a second one, or of a robot that is not there: ignored.
    Stale,
    /// Contents that no agent sends: ignored.
    Malformed,
}

/// Whom a tick is to be sent to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Question {
    /// To whom.
    pub robot: RobotId,
    /// Which incarnation of it.
    pub incarnation: Incarnation,
    /// Latest tick in which it counted.
    pub last_counted: Option<Tick>,
}

/// Whose reports count in a tick, and who died in it.
#[derive(Clone, Debug, Default)]
pub struct Gathered {
    /// By rank: whether the robot counted.
    pub counted: Vec<bool>,
    /// Robots whose agents died in this tick, by rank.
    pub dead: Vec<RobotId>,
    /// What came from outside during this tick.
    pub inputs: Vec<Input>,
}

/// How far radios reach.
pub trait Air {
    /// Calls this with every robot that is in range of the sender, once.
    fn for_each_hearer(&self, sender: RobotId, hear: impl FnMut(RobotId));
}

/// The barrier of one run.
#[derive(Clone, Debug)]
pub struct Barrier {
    places: Vec<Place>,
    order: StepOrder,
    tick: Tick,
    started: bool,
    /// The clock goes on even when nobody takes part: time will bring somebody back.
    runs_on: bool,
    /// Where the last look found a place that the tick waits for: it begins there, lest each report make it look at all.
    open: Cell<usize>,
    /// Who takes part in the current tick and has not been sent it yet.
    to_ask: VecDeque<RobotId>,
    /// Whom the scenario starts in the current tick, which waits for them.
    expected: BTreeSet<RobotId>,
    inputs: Vec<Input>,
    /// What moment of the tick it is, but while reports are gathered.
    moment: Option<u32>,
    /// How much has come from outside at this moment.
    came: u32,
    /// Who died before the current tick was asked for.
    dead: Vec<RobotId>,
}

impl Barrier {
    /// A barrier at tick 0 for these robots, by rank; nobody is there yet.
    #[must_use]
    pub fn new<'r>(robots: impl IntoIterator<Item = &'r Robot>, order: StepOrder) -> Self {
        let places = robots.into_iter().map(Place::new).collect();
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
            came: 0,
            dead: Vec::new(),
        }
    }

    /// The tick whose reports are being gathered.
    #[must_use]
    pub fn tick(&self) -> Tick {
        self.tick
    }

    /// Whether the clock runs: every robot of the scenario has been there.
    #[must_use]
    pub fn started(&self) -> bool {
        self.started
    }

    /// State of a robot's place.
    #[must_use]
    pub fn presence(&self, robot: RobotId) -> Presence {
        self.places[robot.index()].presence
    }

    /// The incarnation that has the robot, if any.
    #[must_use]
    pub fn incarnation(&self, robot: RobotId) -> Option<Incarnation> {
        let place = &self.places[robot.index()];
        (place.presence != Presence::Empty).then_some(place.incarnation)
    }

    /// Whether an agent has ever been invited to be that robot, or would have been if it had not died before.
    #[must_use]
    pub fn has_lived(&self, robot: RobotId) -> bool {
        let place = &self.places[robot.index()];
        place.incarnation > 0 || place.missed
    }

    /// All robots, by rank.
    pub fn robots(&self) -> impl Iterator<Item = RobotId> + use<> {
        (0..self.places.len() as u16).map(RobotId)
    }

    /// Offers a robot to an agent: its incarnation and the earliest tick that it can take part in.
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
        // While nobody takes part no tick ends, so that whoever comes enters the current one; so does whom the tick waits for.
        let expected = self.expected.contains(&RobotId(index as u16));
        let later = self.started && !self.is_idle() && !expected;
        let first_tick = self.tick + Tick::from(later);
        let place = &mut self.places[index];
        if place.absent {
            return Err(Refusal::Absent {
                robot: name.to_owned(),
            });
        }
        // An agent that died in this tick has left already, though the tick still has to record it.
        if place.presence != Presence::Empty && !place.gone {
            return Err(Refusal::Taken {
                robot: name.to_owned(),
                incarnation: place.incarnation,
            });
        }
        place.presence = Presence::Invited;
        place.missed &= self.started;
        place.late = false;
        place.incarnation += 1;
        place.last_counted = None;
        Ok((RobotId(index as u16), place.incarnation, first_tick))
    }

    /// The liveliness token of an incarnation has appeared.
    pub fn arrive(&mut self, robot: RobotId, incarnation: Incarnation) {
        let place = &mut self.places[robot.index()];
        let is_due = match place.presence {
            Presence::Invited => true,
            Presence::Empty => place.late,
            _ => false,
        };
        if is_due && place.incarnation == incarnation {
            place.late = false;
            place.presence = Presence::Entering { again: false };
            if self.expected.remove(&robot) {
                place.enter(true, None, &mut self.inputs);
            }
            self.enter_if_idle();
        }
    }

    /// An invited agent has not shown its token in time: its place is free for another one. If none has taken it, the agent may
    /// still come: on a busy machine a large team takes long to start.
    pub fn give_up(&mut self, robot: RobotId, incarnation: Incarnation) {
        let place = &mut self.places[robot.index()];
        if place.presence == Presence::Invited && place.incarnation == incarnation {
            place.presence = Presence::Empty;
            place.late = true;
        }
    }

    /// How much has come from outside since this was asked last: whatever comes after it comes at a later moment.
    pub fn take_came(&mut self) -> u32 {
        std::mem::take(&mut self.came)
    }

    /// What moment of the tick it is, for whatever comes from outside now; `None` while reports are gathered, which may come in
    /// any order.
    pub fn set_moment(&mut self, moment: Option<u32>) {
        self.moment = moment;
    }

    /// The liveliness token of an incarnation has gone: that agent is dead. `asked_for`: just that is being done to it.
    pub fn gone(&mut self, robot: RobotId, incarnation: Incarnation, asked_for: bool) {
        let place = &mut self.places[robot.index()];
        if place.incarnation != incarnation {
            return;
        }
        match place.presence {
            Presence::Empty => {}
            Presence::Invited | Presence::Entering { again: false } => {
                place.presence = Presence::Empty;
            }
            _ if place.gone => {}
            Presence::Present | Presence::Silent | Presence::Entering { again: true } => {
                place.suspended = false;
                place.manifest.clear();
                let counted_now = place.answer.is_some().then_some(self.tick);
                // One that has reported dies in this tick anyway; before, it has died of something else.
                let owes = place.presence == Presence::Present && place.asked;
                let scripted =
                    place.dies_after_tick && (counted_now.is_some() || (asked_for && !owes));
                self.came += u32::from(self.moment.is_some() && !scripted);
                self.inputs.push(Input::Gone {
                    robot: place.name.clone(),
                    incarnation,
                    last_counted: counted_now.or(place.last_counted),
                    listed: !place.dies_after_tick || counted_now.is_none(),
                    moment: self.moment.filter(|_| !scripted),
                    scripted,
                });
                // Its place is free at once for a successor that the scenario starts in the same tick. While reports are gathered in
                // order, it means nothing whether it had been asked.
                if place.dies_after_tick && !place.asked && self.moment.is_some() {
                    place.dies_after_tick = false;
                    place.presence = Presence::Empty;
                    self.dead.push(robot);
                } else {
                    place.gone = true;
                }
            }
        }
    }

    /// The agent did not answer the current tick in time; it is out until it speaks.
    pub fn stall(&mut self, robot: RobotId) {
        if self.is_awaited(robot) {
            let place = &mut self.places[robot.index()];
            place.fall_silent(self.tick, false, &mut self.inputs);
        }
    }

    /// The scenario kills the robot's agent in this tick: what it does in it still counts, but nobody hears of it.
    pub fn kill_after_tick(&mut self, robot: RobotId) {
        self.places[robot.index()].dies_after_tick = true;
    }

    /// The killing could not be done.
    pub fn cancel_kill(&mut self, robot: RobotId) {
        self.places[robot.index()].dies_after_tick = false;
    }

    /// The scenario stops the robot's agent before it is asked in this tick: it is out until it is readmitted.
    pub fn suspend(&mut self, robot: RobotId) {
        let place = &mut self.places[robot.index()];
        if place.presence == Presence::Present && !place.asked && !place.gone {
            place.suspended = true;
            place.fall_silent(self.tick, true, &mut self.inputs);
        }
    }

    /// Whether the scenario has stopped the robot's agent.
    #[must_use]
    pub fn is_suspended(&self, robot: RobotId) -> bool {
        self.places[robot.index()].suspended
    }

    /// A suspended agent goes on: it takes part in this tick.
    pub fn readmit(&mut self, robot: RobotId) {
        let place = &mut self.places[robot.index()];
        if std::mem::take(&mut place.suspended) && place.presence == Presence::Silent && !place.gone
        {
            place.presence = Presence::Entering { again: true };
            place.enter(true, None, &mut self.inputs);
        }
    }

    /// A suspended agent could not be told to go on: it comes back when it speaks.
    pub fn release(&mut self, robot: RobotId) {
        self.places[robot.index()].suspended = false;
    }

    /// The scenario starts an agent for the robot in this tick, which waits for it. One that has arrived anyway is let in.
    pub fn expect(&mut self, robot: RobotId) {
        let place = &mut self.places[robot.index()];
        place.absent = false;
        if place.presence == (Presence::Entering { again: false }) {
            place.enter(true, None, &mut self.inputs);
        } else {
            self.expected.insert(robot);
        }
    }

    /// Whether an agent is on its way that has taken no part yet.
    #[must_use]
    pub fn is_coming(&self, robot: RobotId) -> bool {
        let presence = self.places[robot.index()].presence;
        matches!(
            presence,
            Presence::Invited | Presence::Entering { again: false }
        )
    }

    /// In a replay: the next incarnation of the robot is this one; those before it ended before they took part.
    pub fn skip_to(&mut self, robot: RobotId, incarnation: Incarnation) {
        self.places[robot.index()].incarnation = incarnation - 1;
    }

    /// The agent that was expected does not come.
    pub fn expect_no_more(&mut self, robot: RobotId) {
        self.expected.remove(&robot);
    }

    /// The robot is not in the mission from now on.
    pub fn dismiss(&mut self, robot: RobotId) {
        self.places[robot.index()].absent = true;
    }

    /// Whether the robot is not in the mission.
    #[must_use]
    pub fn is_absent(&self, robot: RobotId) -> bool {
        self.places[robot.index()].absent
    }

    /// In a replay: the agent that the log knows takes part again, in that incarnation, from the next tick on, or from this moment of
    /// the current one.
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
            self.came += 1;
        } else {
            self.enter_if_idle();
        }
    }

    /// An agent's report.
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
        // Only the answer to what it was asked last shows that it is back: an older report is one that somebody put again.
        if place.presence == Presence::Silent
            && !place.gone
            && !place.suspended
            && report.tick == place.unanswered
        {
            place.presence = Presence::Entering { again: true };
            self.enter_if_idle();
            return Verdict::BackAgain;
        }
        if place.presence != Presence::Present
            || place.gone
            || !place.asked
            || place.answer.is_some()
            || report.tick != self.tick
        {
            return Verdict::Stale;
        }
        if report.broadcasts > MAX_BROADCASTS {
            return Verdict::Malformed;
        }
        place.answer = Some(Listing {
            incarnation: report.incarnation,
            broadcasts: report.broadcasts,
        });
        Verdict::Counted
    }

    /// Whether a report of the robot counts in the current tick.
    #[must_use]
    pub fn has_answered(&self, robot: RobotId) -> bool {
        self.places[robot.index()].answer.is_some()
    }

    /// Whether the robot's agent has died in the current tick.
    #[must_use]
    pub fn is_gone(&self, robot: RobotId) -> bool {
        self.places[robot.index()].gone
    }

    /// Whether the robot's agent has died in the current tick, in which it was to be killed.
    #[must_use]
    pub fn is_killed(&self, robot: RobotId) -> bool {
        let place = &self.places[robot.index()];
        place.gone && place.dies_after_tick
    }

    /// Whether the clock goes on when nobody takes part.
    pub fn run_on(&mut self, runs_on: bool) {
        self.runs_on = runs_on;
    }

    /// Whether the current tick waits for this robot's report.
    #[must_use]
    pub fn is_awaited(&self, robot: RobotId) -> bool {
        let place = &self.places[robot.index()];
        self.started
            && place.presence == Presence::Present
            && place.asked
            && !place.gone
            && place.answer.is_none()
    }

    /// Before the clock has started: it shall not wait for this robot, whose process has ended or is stopped, unless one comes.
    pub fn start_without(&mut self, robot: RobotId) {
        let place = &mut self.places[robot.index()];
        place.missed |= !self.started && place.presence == Presence::Empty && !place.absent;
    }

    /// Starts the clock if every robot has arrived, those left out that it [shall not wait for](Self::start_without); says whether it
    /// runs. Somebody must be there.
    pub fn start_if_all_here(&mut self) -> bool {
        if self.started {
            return true;
        }
        let is_here = |place: &Place| matches!(place.presence, Presence::Entering { .. });
        let is_due = |place: &Place| !place.absent && !place.missed && !is_here(place);
        // Robots mostly come by rank: who is still due is found soonest from the last.
        if !self.places.iter().rev().any(is_due)
            && (self.places.iter().any(is_here) || self.places.iter().all(|place| !place.missed))
        {
            self.started = true;
            for place in self.places.iter().filter(|place| place.missed) {
                self.inputs.push(Input::Gone {
                    robot: place.name.clone(),
                    // None of its incarnations has taken part.
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

    /// Whom the current tick is to be sent to next. In order, the next robot is asked when the one before it has answered.
    pub fn next_question(&mut self, air: &impl Air) -> Option<Question> {
        if self.to_ask.is_empty() {
            self.line_up(air);
        }
        let robot = self.to_ask.pop_front()?;
        let place = &self.places[robot.index()];
        Some(Question {
            robot,
            incarnation: place.incarnation,
            last_counted: place.last_counted,
        })
    }

    /// Moves what a robot that is asked may hear into `manifest`, by (sender, tick), instead of what is there.
    #[inline]
    pub fn hand_over(&mut self, robot: RobotId, manifest: &mut Vec<ManifestEntry>) {
        let listed = &mut self.places[robot.index()].manifest;
        // In most ticks both are empty.
        if !(listed.is_empty() && manifest.is_empty()) {
            Self::exchange(listed, manifest);
        }
    }

    fn exchange(listed: &mut Vec<ManifestEntry>, manifest: &mut Vec<ManifestEntry>) {
        std::mem::swap(listed, manifest);
        listed.clear();
        // They are listed like that, but for those of a sender that was asked before it.
        if !manifest.is_sorted() {
            manifest.sort_unstable();
        }
    }

    /// Those who are to be asked now: all at once, so that what happens meanwhile finds them asked.
    fn line_up(&mut self, air: &impl Air) {
        if !self.started || !self.expected.is_empty() {
            return;
        }
        // In order, who has answered is heard by those who are asked after it.
        if self.order == StepOrder::InOrder {
            self.list_all(air);
        }
        for (index, place) in self.places.iter_mut().enumerate() {
            if place.presence != Presence::Present || place.gone || place.answer.is_some() {
                continue;
            }
            if !std::mem::replace(&mut place.asked, true) {
                self.to_ask.push_back(RobotId(index as u16));
            }
            if self.order == StepOrder::InOrder {
                break;
            }
        }
    }

    /// Whether nobody could act in the current tick: the clock then stands still until somebody comes. While robots are suspended it goes
    /// on: somebody may let them go on at any time of the mission.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        !self.runs_on
            && self.inputs.is_empty()
            && self
                .places
                .iter()
                .all(|place| place.presence != Presence::Present && !place.is_suspended())
    }

    /// Whether no agent is left that could ever act, be it silent or on its way.
    #[must_use]
    pub fn is_deserted(&self) -> bool {
        self.places
            .iter()
            .all(|place| place.presence == Presence::Empty || place.gone)
    }

    /// Whether the current tick waits for nobody any more.
    #[inline]
    #[must_use]
    pub fn is_complete(&self) -> bool {
        let (before, after) = self.places.split_at(self.open.get());
        let open = match after.iter().position(Place::is_open) {
            Some(ahead) => Some(before.len() + ahead),
            None => before.iter().position(Place::is_open),
        };
        self.open.set(open.unwrap_or_default());
        self.started && open.is_none() && !self.is_idle()
    }

    /// Ends the current tick: what counts in it is written to `gathered`. The next one begins, with whoever has arrived
    /// meanwhile.
    pub fn finish(&mut self, air: &impl Air, gathered: &mut Gathered) {
        gathered.counted.clear();
        gathered.dead.clear();
        gathered.dead.append(&mut self.dead);
        gathered.inputs.clear();
        gathered.inputs.append(&mut self.inputs);
        self.to_ask.clear();
        // By rank, so that the order in which they came means nothing; a robot's own stay in theirs.
        let rank = |input: &Input| {
            let named = |place: &Place| input.robot() == Some(&place.name);
            self.places.iter().position(named)
        };
        gathered.inputs.sort_by_cached_key(rank);
        self.list_all(air);
        for (index, place) in self.places.iter_mut().enumerate() {
            let answer = place.answer.take();
            gathered.counted.push(answer.is_some());
            match answer {
                // A report of an incarnation that has been succeeded in this very tick counts, but not for its successor.
                Some(answer) if answer.incarnation == place.incarnation => {
                    place.last_counted = Some(self.tick);
                }
                Some(_) => {}
                // A robot is deaf in ticks in which it did not count.
                None => place.manifest.clear(),
            }
            if place.end_tick() {
                gathered.dead.push(RobotId(index as u16));
            }
            place.enter(false, None, &mut self.inputs);
        }
        self.tick += 1;
    }

    /// Puts the broadcasts of all reports into the manifests of all teammates in range that take part, those of robots to be killed
    /// left out.
    fn list_all(&mut self, air: &impl Air) {
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
            air.for_each_hearer(entry.sender, |hearer| {
                let place = &mut self.places[hearer.index()];
                if hearer != entry.sender && place.presence == Presence::Present && !place.gone {
                    place.manifest.push(entry.clone());
                }
            });
        }
    }

    /// While nobody takes part no tick ends, so a robot that comes enters the current one.
    fn enter_if_idle(&mut self) {
        if self.started && self.is_idle() {
            self.enter();
        }
    }

    /// Each at a moment of its own, but at the beginning of a tick.
    fn enter(&mut self) {
        let begun = self.moment.filter(|moment| *moment > 0);
        for place in &mut self.places {
            if matches!(place.presence, Presence::Entering { .. }) {
                let moment = begun.map(|moment| moment + self.came);
                place.enter(false, moment, &mut self.inputs);
                self.came += u32::from(begun.is_some());
            }
        }
    }
}

#[cfg(test)]
mod tests;
