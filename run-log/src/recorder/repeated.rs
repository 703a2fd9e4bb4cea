//! Cached parts of rows of a full or compact log. All rows of a tick begin with its time, and most values are the same
//! as in the previous tick.

use crate::{LogLevel, WORLD_ROBOT};
use proto::telemetry::Reception;
use scenario::ids::{BehaviorId, RobotId, Tick};
use scenario::time::SimTime;

use super::answers::MotivationBits;
use super::names::Names;
use super::record::BodyRecord;
use super::row::{CachedFields, Fields};

#[derive(Clone)]
pub(super) struct RowCache {
    /// True if rows of messages.csv that repeat the latest one of their sender have no contents.
    pub omits_repeated: bool,
    pub now: Fields,
    pub tick: Fields,
    /// The name in rows that belong to no robot.
    pub world: Fields,
    robots: Vec<Fields>,
    /// The ends of rows of motivations.csv, by robot and by position in its report.
    pub motivations: Vec<Vec<CachedFields<MotivationBits>>>,
    /// The ends of rows of messages.csv by sender, because a broadcast is the same for all receivers.
    pub messages: Vec<CachedFields<Reception>>,
    /// The ends of rows of poses.csv by robot.
    pub poses: Vec<CachedFields<BodyBits>>,
}

/// The position, heading and speed, energy, load and active behavior set. Floats are stored as bits, because 0 and -0 are equal
/// but encoded differently.
pub(super) type BodyBits = ([u32; 4], Option<u32>, bool, Option<BehaviorId>);

impl RowCache {
    pub fn new(names: &Names, level: LogLevel) -> Self {
        let robots: Vec<_> = names
            .robots()
            .map(|name| Fields::of(|row| row.text(name)))
            .collect();
        Self {
            omits_repeated: level == LogLevel::Compact,
            now: Fields::default(),
            tick: Fields::default(),
            world: Fields::of(|row| row.text(WORLD_ROBOT)),
            motivations: vec![Vec::new(); robots.len()],
            messages: vec![CachedFields::default(); robots.len()],
            poses: vec![CachedFields::default(); robots.len()],
            robots,
        }
    }

    /// Starts a tick and encodes its time and number.
    pub fn begin(&mut self, tick: Tick, now: SimTime) {
        self.now.set(|row| row.number(now.0));
        self.tick.set(|row| row.number(now.0).number(tick));
    }

    pub fn robot(&self, robot: RobotId) -> &Fields {
        &self.robots[robot.index()]
    }
}

/// Returns all values of a row of poses.csv except time and robot.
pub(super) fn body_bits(body: &BodyRecord) -> BodyBits {
    let [x, y] = body.pose.position.to_array();
    let reals = [x, y, body.pose.heading_rad, body.speed_m_s];
    let energy = body.energy_j.map(f32::to_bits);
    (reals.map(f32::to_bits), energy, body.carrying, body.active)
}
