//! The points of a run. A point waits, is open, and is then done or expired, until it comes back.

use std::collections::BTreeSet;

use arrayvec::ArrayVec;
use glam::Vec2;
use proto::tick::Outcome;
use proto::view::{Mark, MarkRole, View, Work};
use scenario::Room;
use scenario::ids::RobotId;
use scenario::time::SimTime;
use serde::{Serialize, Serializer};
use world_server::mission::{FigureValue, TeamFigures};
use world_server::world::Grid;

use crate::geometry::nearest;
use crate::service::bus::{LEAST_LEFT_S, LOAD_LEFT_S, MAX_SENSED, PointFact};
use crate::service::data::{
    PointSpec, ServiceSection, VALUE_COLLECTED, VALUE_LOST, predecessors, successors,
};

use super::limits::TeamLimits;
use super::point::{Counts, Phase, Point};

/// The radius of a displayed point, m. It is larger than a robot, so that the point stays visible.
const SHOWN_M: f32 = 0.28;
/// The work left that can be an error of rounding, s. Steps such as 0.05 s are no binary fractions.
const ROUNDING_S: f64 = 1e-7;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    Arrived,
    Done,
    Expired,
}

/// The values of the points that are done and of those that expired.
#[derive(Clone, Copy, Debug, Default)]
struct Values {
    collected: f64,
    lost: f64,
}

#[derive(Clone, Debug)]
pub(super) struct Points {
    points: Vec<Point>,
    open: Grid,
    open_of_kind: Vec<u32>,
    kept: Vec<bool>,
    /// The times of the next change of each point that time causes.
    scheduled_changes: BTreeSet<(SimTime, u32)>,
    counts: Counts,
    values: Values,
    /// The points that wait for each point, by number. Empty if no point has predecessors.
    successors: Vec<Vec<u32>>,
    /// The time from which no drawn point arrives and no point comes back.
    until: SimTime,
    /// The combined hash of the variable data of all points. Covers points that faults have added.
    hash: u64,
}

/// Serializes only the data that identifies the state.
impl Serialize for Points {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let counts = &self.counts;
        (self.hash, self.points.len(), counts.done, counts.expired).serialize(serializer)
    }
}

impl Points {
    pub fn new(section: &ServiceSection, specs: Vec<PointSpec>, room: &Room) -> Self {
        let until = section.duration_s.map(SimTime::from_secs_f64);
        let cell_m = section.sight_m.max(0.5);
        let mut points = Self {
            open: Grid::new(room, cell_m, specs.len()),
            points: Vec::with_capacity(specs.len()),
            open_of_kind: vec![0; section.kinds.len()],
            kept: section.kinds.iter().map(|kind| kind.kept).collect(),
            scheduled_changes: BTreeSet::new(),
            counts: Counts::default(),
            values: Values::default(),
            successors: Vec::new(),
            until: until.unwrap_or(SimTime(u64::MAX)),
            hash: 0,
        };
        let stated = section.points.len();
        for (number, spec) in specs.into_iter().enumerate() {
            let is_cut = number >= stated && spec.arrives >= points.until;
            points.insert(Point {
                is_cut,
                ..Point::new(spec)
            });
        }
        points.order(&predecessors(section));
        points
    }

    /// Lets points wait for their predecessors.
    fn order(&mut self, before: &[Vec<u32>]) {
        self.successors = successors(before);
        for (before, number) in before.iter().zip(0..) {
            self.change(number, |point| point.blocked_by = before.len() as u32);
        }
    }

    /// Adds a point, which arrives at its arrival time. Returns its number.
    pub fn add(&mut self, spec: PointSpec) -> u32 {
        self.insert(Point::new(spec))
    }

    fn insert(&mut self, point: Point) -> u32 {
        let number = self.points.len() as u32;
        self.hash ^= point.hash(number);
        point.count_in(&mut self.counts, |sum, by| *sum += by);
        self.scheduled_changes
            .extend(point.next(self.until).map(|next| (next, number)));
        self.points.push(point);
        number
    }

    pub fn len(&self) -> usize {
        self.points.len()
    }

    pub fn at(&self, point: u32) -> Vec2 {
        self.points[point as usize].place()
    }

    /// Returns the robot that carries the load of a point.
    pub fn carrier(&self, point: u32) -> Option<RobotId> {
        self.points[point as usize].carrier
    }

    /// Gives the load of a point to a robot, which then delivers it.
    pub fn pick_up(&mut self, number: u32, robot: RobotId) {
        self.change(number, |point| point.carrier = Some(robot));
    }

    /// Returns a lost load to its first place. The work begins again, as a new round.
    pub fn drop_load(&mut self, number: u32) {
        self.change(number, |point| {
            point.carrier = None;
            point.round = point.round.saturating_add(1);
            point.left_s = point.spec.work_s;
        });
    }

    /// Returns the work of a point for a robot of skill 1, s, and the arrival time of its round.
    pub fn work_and_arrival(&self, point: u32) -> (f64, SimTime) {
        let point = &self.points[point as usize];
        (point.spec.work_s, point.arrives)
    }

    /// Returns the kind of an open point. `None` if the point is not open or does not exist.
    pub fn open_kind(&self, point: u32) -> Option<usize> {
        let point = self.points.get(point as usize)?;
        (point.phase == Phase::Open).then_some(point.spec.kind)
    }

    /// Returns the time from which robots can work on the current round of a point.
    pub fn opens(&self, point: u32) -> SimTime {
        let point = &self.points[point as usize];
        point.due + point.spec.opens_after
    }

    /// Returns whether a window of a point opened within the last step, and robots can work for the first time at `now`.
    pub fn opens_in(&self, point: u32, now: SimTime, step: SimTime) -> bool {
        let opens = self.opens(point);
        self.spec(point).opens_after > SimTime::ZERO && opens <= now && now < opens + step
    }

    /// Returns whether robots could work on a point in the step before `now`.
    pub fn was_open(&self, point: u32, now: SimTime, step: SimTime) -> bool {
        self.spec(point).opens_after == SimTime::ZERO || now >= self.opens(point) + step
    }

    /// Returns the constants of a point.
    pub fn spec(&self, point: u32) -> &PointSpec {
        &self.points[point as usize].spec
    }

    pub fn round(&self, point: u32) -> u32 {
        self.points[point as usize].round
    }

    pub fn open_of_kind(&self, kind: usize) -> u32 {
        self.open_of_kind[kind]
    }

    /// Returns the number of quarters of a point's work that are left, rounded up.
    pub fn quarters_left(&self, point: u32) -> u64 {
        self.points[point as usize].quarters_left()
    }

    /// Returns the fact that robots can sense about a point. Kept work is reported in quarters.
    pub fn fact(&self, point: u32) -> PointFact {
        let state = &self.points[point as usize];
        let quarters = if self.kept[state.spec.kind] {
            state.quarters_left() as f64
        } else {
            4.0
        };
        let left_s = match state.phase {
            // The load is on the way.
            Phase::Open if state.carrier.is_some() => LOAD_LEFT_S,
            Phase::Open => ((quarters / 4.0 * state.spec.work_s) as f32).max(LEAST_LEFT_S),
            _ => 0.0,
        };
        PointFact {
            point,
            kind: state.spec.kind as u32,
            round: state.round,
            at: state.place(),
            left_s,
        }
    }

    /// Edits a point and updates all data derived from it.
    fn change(&mut self, number: u32, edit: impl FnOnce(&mut Point)) {
        let point = &mut self.points[number as usize];
        let (was, place) = (point.phase, point.place());
        let had = point.next(self.until);
        self.hash ^= point.hash(number);
        point.count_in(&mut self.counts, |sum, by| *sum -= by);
        edit(point);
        point.count_in(&mut self.counts, |sum, by| *sum += by);
        self.hash ^= point.hash(number);
        let is = point.phase;
        if (was == Phase::Open) != (is == Phase::Open) {
            let of_kind = &mut self.open_of_kind[point.spec.kind];
            if is == Phase::Open {
                *of_kind += 1;
                self.open.insert(number as usize, point.place());
            } else {
                *of_kind -= 1;
                self.open.remove(number as usize);
            }
        }
        if was == Phase::Open && is == Phase::Open && place != point.place() {
            self.open.remove(number as usize);
            self.open.insert(number as usize, point.place());
        }
        let has = point.next(self.until);
        if had != has {
            if let Some(had) = had {
                self.scheduled_changes.remove(&(had, number));
            }
            self.scheduled_changes.extend(has.map(|has| (has, number)));
        }
    }

    /// Applies the next change that is due by `now`, and returns it.
    pub fn next_change(&mut self, now: SimTime) -> Option<(u32, Change)> {
        let (at, number) = *self.scheduled_changes.first()?;
        if at > now {
            return None;
        }
        let phase = self.points[number as usize].phase;
        let change = match phase {
            Phase::Waiting if !self.points[number as usize].is_blocked() => {
                self.change(number, |point| point.phase = Phase::Open);
                Change::Arrived
            }
            Phase::Waiting | Phase::Open => {
                self.change(number, |point| {
                    (point.phase, point.carrier) = (Phase::Expired, None);
                });
                self.counts.expired += 1;
                self.values.lost += self.spec(number).value;
                self.lose_successors(number);
                Change::Expired
            }
            Phase::Done | Phase::Expired => {
                self.change(number, |point| {
                    point.phase = Phase::Open;
                    point.round = point.round.saturating_add(1);
                    (point.arrives, point.due) = (at, at);
                    point.left_s = point.spec.work_s;
                });
                Change::Arrived
            }
        };
        Some((number, change))
    }

    /// Takes work off an open point in a step that ends at `end`, s at skill 1. Returns whether none is left.
    pub fn reduce_work(&mut self, number: u32, work_s: f64, end: SimTime) -> bool {
        let left_s = self.points[number as usize].left_s - work_s;
        let left_s = self.without_rounding(number, left_s, end);
        self.change(number, |point| point.left_s = left_s.max(0.0));
        left_s <= 0.0
    }

    /// Returns the work left, s, or 0 if the last step before the expiration leaves only an error of rounding.
    fn without_rounding(&self, number: u32, left_s: f64, end: SimTime) -> f64 {
        let next = || self.points[number as usize].next(self.until);
        if left_s < ROUNDING_S && next().is_some_and(|next| next <= end) {
            0.0
        } else {
            left_s
        }
    }

    /// Records the progress of a robot's own attempt in a step that ends at `end`, s left. Returns whether the attempt is
    /// complete.
    pub fn attempt(&mut self, number: u32, left_s: f64, end: SimTime) -> bool {
        let left_s = self.without_rounding(number, left_s, end);
        if left_s < self.points[number as usize].left_s {
            self.change(number, |point| point.left_s = left_s.max(0.0));
        }
        left_s <= 0.0
    }

    pub fn finish(&mut self, number: u32, now: SimTime) -> Change {
        self.change(number, |point| {
            (point.phase, point.carrier) = (Phase::Done, None)
        });
        for next in self.successors_of(number) {
            self.change(next, |point| {
                point.blocked_by -= 1;
                point.arrives = point.due.max(now);
            });
        }
        self.counts.done += 1;
        self.values.collected += self.spec(number).value;
        Change::Done
    }

    fn successors_of(&self, number: u32) -> Vec<u32> {
        let successors = self.successors.get(number as usize);
        successors.cloned().unwrap_or_default()
    }

    /// Lets the points that wait for a point expire, because the point will never be done.
    fn lose_successors(&mut self, number: u32) {
        for next in self.successors_of(number) {
            self.change(next, |point| point.lost = point.lost.or(Some(number)));
        }
    }

    /// Returns the predecessor because of which a point has expired.
    pub fn lost_predecessor(&self, point: u32) -> Option<u32> {
        self.points[point as usize].lost
    }

    pub fn start_over(&mut self, number: u32) {
        self.change(number, |point| point.left_s = point.spec.work_s);
    }

    /// Returns the open points within sight of a place with their squared distances, nearest first, by number at equal
    /// distance.
    pub fn open_near(&self, place: Vec2, sight_m: f32) -> ArrayVec<(f32, u32), MAX_SENSED> {
        let near = self.open.near(place, sight_m);
        let near = near.map(|(point, at)| (at.distance_squared(place), point as u32));
        nearest(near.filter(|(squared, _)| *squared <= sight_m * sight_m))
    }

    /// Returns the end of the mission once no point is open now or later. The mission is complete if none expired. A
    /// mission that has not had any point continues, because an order can add one.
    pub fn outcome(&self) -> Option<Outcome> {
        let had_points = self.counts.done + self.counts.expired > 0;
        let is_over = had_points && self.counts.open == 0 && self.scheduled_changes.is_empty();
        is_over.then_some(match self.counts.expired {
            0 => Outcome::Complete,
            _ => Outcome::Expired,
        })
    }

    /// Returns the number of points that are neither done nor expired, whether they have arrived or not.
    fn unfinished(&self) -> u64 {
        self.counts.open + self.counts.pending
    }

    pub fn write_row(&self, row: &mut Vec<FigureValue>) {
        let counts = &self.counts;
        let open = self.unfinished();
        row.extend([open, counts.started, counts.done, counts.expired].map(FigureValue::from));
        row.push((counts.left_ms as f64 / 1000.0).into());
        row.push(counts.pending.into());
    }

    /// Returns the number of unfinished points for which `holds` is true.
    fn unfinished_for(&self, holds: impl Fn(u32, &PointSpec) -> bool) -> u64 {
        let unfinished = self
            .points
            .iter()
            .zip(0..)
            .filter(|(point, _)| point.is_pending() || point.phase == Phase::Open);
        let count = unfinished.filter(|(point, number)| holds(*number, &point.spec));
        count.count() as u64
    }

    /// Writes the outcomes. With the limits of the team, each unfinished point is uncovered, unreachable or open, so
    /// that all outcomes add up to the total.
    pub fn write_figures(&self, limits: Option<&TeamLimits>, figures: &mut TeamFigures) {
        let mission = &mut figures.mission;
        mission.add("done", self.counts.done);
        mission.add("expired", self.counts.expired);
        let Some(limits) = limits else {
            mission.add("open", self.unfinished());
            return;
        };
        let uncovered = self.unfinished_for(|number, spec| limits.is_uncovered(number, spec));
        let unreachable = self.unfinished_for(|number, spec| {
            !limits.is_uncovered(number, spec) && limits.is_unreachable(number)
        });
        let total = self.counts.done + self.counts.expired + self.unfinished();
        mission.add("open", self.unfinished() - uncovered - unreachable);
        mission.add("uncovered", uncovered);
        mission.add("unreachable", unreachable);
        mission.add("total", total);
        mission.add(VALUE_COLLECTED, self.values.collected);
        mission.add(VALUE_LOST, self.values.lost);
    }

    /// Returns the value of a point in words; `None` if the scenario states no properties.
    pub fn value_text(&self, number: u32) -> Option<String> {
        let spec = self.spec(number);
        spec.has_terms.then(|| format!("value {}", spec.value))
    }

    /// Returns the window and the value of a point's current round in words; `None` if they are the default.
    pub fn terms_text(&self, number: u32) -> Option<String> {
        let point = &self.points[number as usize];
        let spec = &point.spec;
        let mut parts = Vec::new();
        if spec.opens_after > SimTime::ZERO {
            parts.push(format!(
                "opens at {:.3} s",
                self.opens(number).as_secs_f64()
            ));
        }
        if let Some(after) = spec.expires_after.filter(|_| spec.has_terms) {
            let closes = point.due + after;
            parts.push(format!("closes at {:.3} s", closes.as_secs_f64()));
        }
        if let Some(to) = spec.deliver_to {
            parts.push(format!("for ({}, {})", to.x, to.y));
        }
        parts.extend(self.value_text(number));
        (!parts.is_empty()).then(|| parts.join(", "))
    }

    /// Adds a mark for each point that has arrived by `now`.
    pub fn show(&self, section: &ServiceSection, now: SimTime, view: &mut View) {
        for (number, point) in self.points.iter().enumerate() {
            if point.phase == Phase::Waiting && (point.arrives > now || point.is_blocked()) {
                continue;
            }
            let kind = &section.kinds[point.spec.kind].name;
            let id = format!("{}/p{number}", point.spec.kind);
            let terms = self
                .terms_text(number as u32)
                .map(|terms| format!(", {terms}"));
            view.mark(Mark {
                work: Work::new(point.left_s as f32, point.spec.work_s as f32, "s"),
                label: format!("p{number} {kind}{}", terms.unwrap_or_default()),
                ..Mark::disc(id, point.place(), SHOWN_M, MarkRole::Zone)
            });
        }
    }

    /// Checks that the derived data matches the points.
    pub fn holds(&self) -> Result<(), String> {
        let mut counts = Counts {
            done: self.counts.done,
            expired: self.counts.expired,
            ..Counts::default()
        };
        let mut hash = 0;
        for (point, number) in self.points.iter().zip(0..) {
            point.count_in(&mut counts, |sum, by| *sum += by);
            hash ^= point.hash(number);
            if !(0.0..=point.spec.work_s).contains(&point.left_s) {
                return Err(format!(
                    "{} s of {} s are left of p{number}",
                    point.left_s, point.spec.work_s
                ));
            }
            let next = point.next(self.until);
            let is_there = next.is_none_or(|next| self.scheduled_changes.contains(&(next, number)));
            if !is_there {
                return Err(format!("the next change of p{number} is not scheduled"));
            }
        }
        if counts != self.counts || hash != self.hash {
            return Err(format!(
                "the points give {counts:?}, but the record is {:?}",
                self.counts
            ));
        }
        Ok(())
    }
}
