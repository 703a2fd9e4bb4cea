//! One point: its phase, the changes that time causes, and its share of the counts.

use glam::Vec2;
use scenario::ids::RobotId;
use scenario::time::SimTime;
use xxhash_rust::xxh3::xxh3_64;

use crate::service::data::PointSpec;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Phase {
    Waiting,
    Open,
    Done,
    Expired,
}

#[derive(Clone, Debug)]
pub(super) struct Point {
    pub spec: PointSpec,
    pub phase: Phase,
    pub round: u32,
    /// The arrival time of the current round. A point with predecessors arrives when the last of them is done.
    pub arrives: SimTime,
    /// The stated arrival time of the current round, from which the window counts.
    pub due: SimTime,
    /// True for a drawn point that never arrives, because its arrival is after `duration_s`.
    pub is_cut: bool,
    /// The number of predecessors that are not done.
    pub blocked_by: u32,
    /// The predecessor that will never be done.
    pub lost: Option<u32>,
    /// The robot that carries the load of the point.
    pub carrier: Option<RobotId>,
    /// The work left for a robot of skill 1, s.
    pub left_s: f64,
}

/// The number of points per phase, and the work left of open points. Each point is pending, open, done or expired.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Counts {
    /// Points that have yet to arrive.
    pub pending: u64,
    /// Points that have arrived and are neither done nor expired.
    pub open: u64,
    /// Open points on which some work is done.
    pub started: u64,
    pub done: u64,
    pub expired: u64,
    /// The work left of all open points, in quarters of each point, rounded up, ms.
    pub left_ms: u64,
}

impl Point {
    pub fn new(spec: PointSpec) -> Self {
        Self {
            phase: Phase::Waiting,
            round: 0,
            arrives: spec.arrives,
            due: spec.arrives,
            is_cut: false,
            blocked_by: 0,
            lost: None,
            carrier: None,
            left_s: spec.work_s,
            spec,
        }
    }

    /// Returns the time of the next change that time causes: arrival, expiration or return. An open point returns, too.
    pub fn next(&self, until: SimTime) -> Option<SimTime> {
        let round_after = |by: SimTime| Some(self.due + by).filter(|next| *next < until);
        let comes_back = self.spec.comes_back_after.and_then(round_after);
        let expires = self.spec.expires_after.map(|after| self.due + after);
        match self.phase {
            Phase::Waiting if self.is_cut => None,
            Phase::Waiting if self.lost.is_some() => Some(SimTime::ZERO),
            Phase::Waiting if self.blocked_by > 0 => expires,
            Phase::Waiting => Some(self.arrives),
            Phase::Open => [expires, comes_back].into_iter().flatten().min(),
            Phase::Done | Phase::Expired => comes_back,
        }
    }

    /// Returns whether the point has yet to arrive.
    pub fn is_pending(&self) -> bool {
        self.phase == Phase::Waiting && !self.is_cut
    }

    /// Returns the place where the next work is: where the load is picked up, or delivered.
    pub fn place(&self) -> Vec2 {
        let carried_to = self.spec.deliver_to.filter(|_| self.carrier.is_some());
        carried_to.unwrap_or(self.spec.at)
    }

    /// Returns whether the point cannot arrive yet, or never will.
    pub fn is_blocked(&self) -> bool {
        self.blocked_by > 0 || self.lost.is_some()
    }

    /// Returns the number of quarters of its work that are left, rounded up.
    pub fn quarters_left(&self) -> u64 {
        (4.0 * self.left_s / self.spec.work_s).ceil() as u64
    }

    pub fn count_in(&self, counts: &mut Counts, add: impl Fn(&mut u64, u64)) {
        if self.is_pending() {
            add(&mut counts.pending, 1);
        }
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

    pub fn hash(&self, number: u32) -> u64 {
        let mut bytes = [0; 48];
        let fields = [
            u64::from(number & 0xFFFF)
                | u64::from(number >> 16) << 56
                | u64::from(self.round) << 16
                | (self.phase as u64) << 32
                | self.carrier.map_or(0, |robot| u64::from(robot.0) + 1) << 40,
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
