//! What rows of a full log have in common: a tick begins all of its rows with its time, and most of what robots are and do is as it
//! was in the tick before.

use alliance_proto::ids::{BehaviorId, RobotId, Tick};
use alliance_proto::log::WORLD;
use alliance_proto::telemetry::Reception;
use alliance_proto::time::SimTime;

use super::answers::MotivationBits;
use super::names::Names;
use super::record::BodyRecord;
use super::row::{Fields, Tail};

/// Parts of rows, for the next rows.
pub(super) struct Repeated {
    /// Time of the tick at hand.
    pub now: Fields,
    /// The same, and its number.
    pub tick: Fields,
    /// The name of what belongs to no robot.
    pub world: Fields,
    /// Names by rank.
    robots: Vec<Fields>,
    /// How rows of motivations.csv end: by robot, and in the order of its report.
    pub motivations: Vec<Vec<Tail<MotivationBits>>>,
    /// How rows of messages.csv end: by sender, whose broadcast says the same to all that hear it.
    pub messages: Vec<Tail<Reception>>,
    /// How rows of poses.csv end: by robot.
    pub poses: Vec<Tail<BodyBits>>,
}

/// Position, heading and speed, energy, what it carries and does. In bits, for 0 and -0 are equal and are written differently.
pub(super) type BodyBits = ([u32; 4], Option<u32>, bool, Option<BehaviorId>);

impl Repeated {
    /// Of a team.
    pub fn new(names: &Names) -> Self {
        let robots: Vec<_> = names
            .robots()
            .map(|name| Fields::of(|row| row.text(name)))
            .collect();
        Self {
            now: Fields::default(),
            tick: Fields::default(),
            world: Fields::of(|row| row.text(WORLD)),
            motivations: vec![Vec::new(); robots.len()],
            messages: vec![Tail::default(); robots.len()],
            poses: vec![Tail::default(); robots.len()],
            robots,
        }
    }

    /// Begins a tick.
    pub fn begin(&mut self, tick: Tick, now: SimTime) {
        self.now.set(|row| row.number(now.0));
        self.tick.set(|row| row.number(now.0).number(tick));
    }

    /// The name of a robot of the scenario.
    pub fn robot(&self, robot: RobotId) -> &Fields {
        &self.robots[robot.index()]
    }
}

/// All of a row of poses.csv but time and robot.
pub(super) fn body_bits(body: &BodyRecord) -> BodyBits {
    let [x, y] = body.pose.position.to_array();
    let reals = [x, y, body.pose.heading_rad, body.speed_m_s];
    let energy = body.energy_j.map(f32::to_bits);
    (reals.map(f32::to_bits), energy, body.carrying, body.active)
}
