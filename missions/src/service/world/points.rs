//! The points of a run, and what becomes of each: it waits, is open, and is over, done or expired, until it comes back.

use std::collections::BTreeSet;

use alliance_proto::time::SimTime;
use alliance_proto::view::{Mark, MarkRole, View};
use arrayvec::ArrayVec;
use glam::Vec2;
use serde::{Serialize, Serializer};
use world_server::mission::{TeamFigures, Value};
use world_server::world::Grid;
use xxhash_rust::xxh3::xxh3_64;

use crate::service::bus::{Fact, LEAST_LEFT_S, SENSED_MOST};
use crate::service::data::{PointSpec, ServiceSection};

/// Radius of a point as it is shown, m: it can be seen round a robot that works there.
const SHOWN_M: f32 = 0.28;

/// What has become of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    /// It is open from now on.
    Arrived,
    /// All work on it is done.
    Done,
    /// It is over, with work left.
    Expired,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Waiting,
    Open,
    Done,
    Expired,
}

#[derive(Clone, Debug)]
struct Point {
    spec: PointSpec,
    phase: Phase,
    round: u16,
    /// When this round of it arrives.
    arrives: SimTime,
    /// Work left for a robot of skill 1, s.
    left_s: f64,
}

/// How many points are in which phase, and what is left of those that are open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Counts {
    open: u64,
    /// Open, and some work is done.
    started: u64,
    done: u64,
    expired: u64,
    /// In quarters of each point, rounded up, ms.
    left_ms: u64,
}

/// All of them, by number.
#[derive(Clone, Debug)]
pub(super) struct Points {
    points: Vec<Point>,
    /// The open ones, by place.
    open: Grid,
    /// By kind.
    open_of_kind: Vec<u32>,
    /// Whether unfinished work stays done, by kind.
    kept: Vec<bool>,
    /// When something happens to a point by itself.
    agenda: BTreeSet<(SimTime, u16)>,
    counts: Counts,
    /// None arrives or comes back from then on.
    until: SimTime,
    /// Of all points, each with its number: of what changes, and of those that faults have added.
    hash: u64,
}

/// The hash tells the state apart.
impl Serialize for Points {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let counts = &self.counts;
        (self.hash, self.points.len(), counts.done, counts.expired).serialize(serializer)
    }
}

impl Point {
    fn new(spec: PointSpec) -> Self {
        Self {
            phase: Phase::Waiting,
            round: 0,
            arrives: spec.arrives,
            left_s: spec.work_s,
            spec,
        }
    }

    /// When something happens to it by itself, and what it is then: it arrives, expires, or comes back, at the latest when it is still
    /// open.
    fn next(&self, until: SimTime) -> Option<SimTime> {
        let round_after = |by: SimTime| Some(self.arrives + by).filter(|next| *next < until);
        let comes_back = self.spec.comes_back_after.and_then(round_after);
        match self.phase {
            Phase::Waiting => Some(self.arrives).filter(|next| *next < until),
            Phase::Open => {
                let expires = self.spec.expires_after.map(|after| self.arrives + after);
                [expires, comes_back].into_iter().flatten().min()
            }
            Phase::Done | Phase::Expired => comes_back,
        }
    }

    /// Quarters of its work that are left, rounded up.
    fn quarters_left(&self) -> u64 {
        (4.0 * self.left_s / self.spec.work_s).ceil() as u64
    }

    fn count_in(&self, counts: &mut Counts, add: impl Fn(&mut u64, u64)) {
        if self.phase == Phase::Open {
            add(&mut counts.open, 1);
            add(
                &mut counts.started,
                u64::from(self.left_s < self.spec.work_s),
            );
            let quarter_ms = (250.0 * self.spec.work_s) as u64;
            add(&mut counts.left_ms, self.quarters_left() * quarter_ms);
        }
    }

    fn hash(&self, number: u16) -> u64 {
        let mut bytes = [0; 48];
        let fields = [
            u64::from(number) | u64::from(self.round) << 16 | (self.phase as u64) << 32,
            self.left_s.to_bits(),
            self.arrives.0,
            self.spec.kind as u64,
            self.spec.work_s.to_bits(),
            u64::from(self.spec.at.x.to_bits()) | u64::from(self.spec.at.y.to_bits()) << 32,
        ];
        for (place, field) in bytes.chunks_exact_mut(8).zip(fields) {
            place.copy_from_slice(&field.to_le_bytes());
        }
        xxh3_64(&bytes)
    }
}

impl Points {
    pub fn new(section: &ServiceSection, specs: Vec<PointSpec>, size: Vec2) -> Self {
        let until = section.duration_s.map(SimTime::from_secs_f64);
        let cell_m = section.sight_m.max(0.5);
        let mut points = Self {
            open: Grid::new(size, cell_m, specs.len()),
            points: Vec::with_capacity(specs.len()),
            open_of_kind: vec![0; section.kinds.len()],
            kept: section.kinds.iter().map(|kind| kind.kept).collect(),
            agenda: BTreeSet::new(),
            counts: Counts::default(),
            until: until.unwrap_or(SimTime(u64::MAX)),
            hash: 0,
        };
        for spec in specs {
            points.add(spec);
        }
        points
    }

    /// One more: it arrives when its time has come.
    pub fn add(&mut self, spec: PointSpec) -> u16 {
        let number = self.points.len() as u16;
        let point = Point::new(spec);
        self.hash ^= point.hash(number);
        self.agenda
            .extend(point.next(self.until).map(|next| (next, number)));
        self.points.push(point);
        number
    }

    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Where a point is, m.
    pub fn at(&self, point: u16) -> Vec2 {
        self.points[usize::from(point)].spec.at
    }

    /// How long a point takes a robot of skill 1, s, and when its round arrived.
    pub fn work_and_arrival(&self, point: u16) -> (f64, SimTime) {
        let point = &self.points[usize::from(point)];
        (point.spec.work_s, point.arrives)
    }

    /// The kind of a point that is open, by its place; `None`: it is not, or there is no such point.
    pub fn open_kind(&self, point: u16) -> Option<usize> {
        let point = self.points.get(usize::from(point))?;
        (point.phase == Phase::Open).then_some(point.spec.kind)
    }

    /// How often a point has come back.
    pub fn round(&self, point: u16) -> u16 {
        self.points[usize::from(point)].round
    }

    /// How many of a kind are open.
    pub fn open_of_kind(&self, kind: usize) -> u32 {
        self.open_of_kind[kind]
    }

    /// Whether nothing of a point is done.
    pub fn is_untouched(&self, point: u16) -> bool {
        let point = &self.points[usize::from(point)];
        point.left_s >= point.spec.work_s
    }

    /// Quarters of the work of a point that are left, rounded up.
    pub fn quarters_left(&self, point: u16) -> u64 {
        self.points[usize::from(point)].quarters_left()
    }

    /// What is to be known of a point: work left in quarters, where they stay done.
    pub fn fact(&self, point: u16) -> Fact {
        let of = &self.points[usize::from(point)];
        let quarters = if self.kept[of.spec.kind] {
            of.quarters_left() as f64
        } else {
            4.0
        };
        let left_s = match of.phase {
            Phase::Open => ((quarters / 4.0 * of.spec.work_s) as f32).max(LEAST_LEFT_S),
            _ => 0.0,
        };
        Fact {
            point,
            kind: of.spec.kind as u8,
            round: of.round,
            at: of.spec.at,
            left_s,
        }
    }

    /// Changes a point, and with it all that depends on it.
    fn change(&mut self, number: u16, edit: impl FnOnce(&mut Point)) {
        let point = &mut self.points[usize::from(number)];
        let was = point.phase;
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
                self.open.insert(number.into(), point.spec.at);
            } else {
                *of_kind -= 1;
                self.open.remove(number.into());
            }
        }
        let has = point.next(self.until);
        if had != has {
            if let Some(had) = had {
                self.agenda.remove(&(had, number));
            }
            self.agenda.extend(has.map(|has| (has, number)));
        }
    }

    /// The next thing that happens by itself until now, and has happened with that.
    pub fn next_change(&mut self, now: SimTime) -> Option<(u16, Change)> {
        let (at, number) = *self.agenda.first()?;
        if at > now {
            return None;
        }
        let phase = self.points[usize::from(number)].phase;
        let change = match phase {
            Phase::Waiting => {
                self.change(number, |point| point.phase = Phase::Open);
                Change::Arrived
            }
            Phase::Open => {
                self.change(number, |point| point.phase = Phase::Expired);
                self.counts.expired += 1;
                Change::Expired
            }
            Phase::Done | Phase::Expired => {
                self.change(number, |point| {
                    point.phase = Phase::Open;
                    point.round = point.round.saturating_add(1);
                    point.arrives = at;
                    point.left_s = point.spec.work_s;
                });
                Change::Arrived
            }
        };
        Some((number, change))
    }

    /// Takes work off an open point, s of a robot of skill 1: whether none is left.
    pub fn take_off(&mut self, number: u16, work_s: f64) -> bool {
        self.change(number, |point| {
            point.left_s = (point.left_s - work_s).max(0.0);
        });
        self.points[usize::from(number)].left_s <= 0.0
    }

    /// Somebody's own attempt has come so far, s left: whether nothing is.
    pub fn attempt(&mut self, number: u16, left_s: f64) -> bool {
        if left_s < self.points[usize::from(number)].left_s {
            self.change(number, |point| point.left_s = left_s.max(0.0));
        }
        left_s <= 0.0
    }

    /// An open point is done.
    pub fn finish(&mut self, number: u16) -> Change {
        self.change(number, |point| point.phase = Phase::Done);
        self.counts.done += 1;
        Change::Done
    }

    /// What has been done on an open point is lost.
    pub fn start_over(&mut self, number: u16) {
        self.change(number, |point| point.left_s = point.spec.work_s);
    }

    /// The open points within sight of a place, nearest first; of those at the same distance, by number.
    pub fn open_near(&self, place: Vec2, sight_m: f32) -> ArrayVec<u16, SENSED_MOST> {
        let mut nearest: ArrayVec<(f32, u16), SENSED_MOST> = ArrayVec::new();
        for (point, at) in self.open.near(place, sight_m) {
            let found = (at.distance_squared(place), point as u16);
            if found.0 > sight_m * sight_m {
                continue;
            }
            let before = nearest.partition_point(|known| *known < found);
            if before == SENSED_MOST {
                continue;
            }
            if nearest.is_full() {
                nearest.pop();
            }
            nearest.insert(before, found);
        }
        nearest.into_iter().map(|(_, point)| point).collect()
    }

    /// Whether nothing is open, and nothing will be.
    pub fn is_over(&self) -> bool {
        self.counts.open == 0 && self.agenda.is_empty()
    }

    pub fn write_row(&self, row: &mut Vec<Value>) {
        let counts = &self.counts;
        row.extend([counts.open, counts.started, counts.done, counts.expired].map(Value::from));
        row.push((counts.left_ms as f64 / 1000.0).into());
    }

    pub fn write_figures(&self, figures: &mut TeamFigures) {
        figures.mission.add("done", self.counts.done);
        figures.mission.add("expired", self.counts.expired);
        figures.mission.add("open", self.counts.open);
    }

    /// Each point that has arrived, or does so now.
    pub fn show(&self, section: &ServiceSection, now: SimTime, view: &mut View) {
        for (number, point) in self.points.iter().enumerate() {
            if point.phase == Phase::Waiting && point.arrives > now {
                continue;
            }
            let done = 1.0 - point.left_s / point.spec.work_s;
            let kind = &section.kinds[point.spec.kind].name;
            let id = format!("{}/p{number}", point.spec.kind);
            view.mark(Mark {
                share: Some(done as f32),
                label: format!("p{number} {kind}"),
                ..Mark::disc(id, point.spec.at, SHOWN_M, MarkRole::Zone)
            });
        }
    }

    /// What follows from the points is as it must be.
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
            let is_there = next.is_none_or(|next| self.agenda.contains(&(next, number)));
            if !is_there {
                return Err(format!("nothing is to become of p{number}"));
            }
        }
        if counts != self.counts || hash != self.hash {
            return Err(format!(
                "the points are {counts:?}, and said to be {:?}",
                self.counts
            ));
        }
        Ok(())
    }
}
