//! The motion of the targets. Each target moves straight at its own speed, turns at random times, and bounces off the
//! edge of the region.

use arrayvec::ArrayVec;
use glam::Vec2;
use prefetch::prefetch;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use scenario::Setup;
use scenario::ids::RobotId;
use scenario::rng::{Purpose, robot_stream};
use scenario::time::SimTime;
use serde::{Serialize, Serializer};
use world_server::world::Grid;
use xxhash_rust::xxh3::xxh3_64_with_seed;

use crate::geometry::nearest;
use crate::observe::bus::MAX_SENSED_TARGETS;
use crate::observe::data::{Area, ObserveSection};

#[derive(Clone, Debug)]
pub(super) struct Targets {
    all: Vec<Target>,
    /// The random streams, by target. They are apart from the targets, because a step rarely draws from them.
    streams: Vec<ChaCha8Rng>,
    grid: Grid,
    area: Area,
    range_m: f32,
    step_s: f32,
    turn_hz: f64,
    turn_rad: f32,
}

#[derive(Clone, Debug)]
struct Target {
    at: Vec2,
    /// The direction of motion, a unit vector.
    direction: Vec2,
    speed_m_s: f32,
    turns_at: SimTime,
    /// The number of turns, which determines the position in the random stream.
    turns: u32,
}

/// Serializes the state as a hash, because there may be thousands of targets.
impl Serialize for Targets {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let hash = self.all.iter().fold(0, |hash, target| {
            let mut bytes = [0; 28];
            let (at, direction) = (target.at, target.direction);
            let numbers = [at.x, at.y, direction.x, direction.y];
            for (place, number) in bytes.chunks_exact_mut(4).zip(numbers) {
                place.copy_from_slice(&number.to_le_bytes());
            }
            bytes[16..24].copy_from_slice(&target.turns_at.0.to_le_bytes());
            bytes[24..].copy_from_slice(&target.turns.to_le_bytes());
            xxh3_64_with_seed(&bytes, hash)
        });
        hash.serialize(serializer)
    }
}

impl Targets {
    /// Places the targets at random in the region, by the seed.
    pub fn new(setup: &Setup) -> Self {
        let scenario = &setup.scenario;
        let section = ObserveSection::from_scenario(scenario);
        let area = Area::from_scenario(scenario);
        let target = |number| {
            let mut rng = robot_stream(setup.seed, Purpose::Targets, RobotId(number));
            let at = area.place(Vec2::new(rng.random(), rng.random()));
            let direction = Vec2::from_angle(std::f32::consts::TAU * rng.random::<f32>());
            let slowest = section.slowest_m_s;
            let target = Target {
                at,
                direction,
                speed_m_s: slowest + (section.fastest_m_s - slowest) * rng.random::<f32>(),
                turns_at: after(SimTime::ZERO, section.turn_hz, &mut rng),
                turns: 0,
            };
            (target, rng)
        };
        let (all, streams): (Vec<Target>, Vec<ChaCha8Rng>) = (0..section.n).map(target).unzip();
        let mut grid = Grid::new(&scenario.room, section.range_m, all.len());
        for (number, target) in all.iter().enumerate() {
            grid.insert(number, target.at);
        }
        Self {
            all,
            streams,
            grid,
            area,
            range_m: section.range_m,
            step_s: scenario.step_ms as f32 / 1000.0,
            turn_hz: section.turn_hz,
            turn_rad: section.turn_deg.to_radians(),
        }
    }

    /// Requests the memory of the lists, see [`prefetch`](mod@prefetch).
    pub fn prefetch(&self) {
        prefetch(&*self.all);
        self.grid.prefetch();
    }

    pub fn len(&self) -> usize {
        self.all.len()
    }

    pub fn at(&self, number: usize) -> Vec2 {
        self.all[number].at
    }

    pub fn step(&mut self, now: SimTime) {
        for (number, target) in self.all.iter_mut().enumerate() {
            while target.turns_at <= now {
                let rng = &mut self.streams[number];
                let turn_rad = self.turn_rad * (2.0 * rng.random::<f32>() - 1.0);
                // Normalizes the direction, so that rounding does not accumulate.
                target.direction = Vec2::from_angle(turn_rad)
                    .rotate(target.direction)
                    .normalize_or(Vec2::X);
                target.turns_at = after(target.turns_at, self.turn_hz, rng);
                target.turns = target.turns.wrapping_add(1);
            }
            let way_m = target.speed_m_s * self.step_s;
            let mut to = target.at + way_m * target.direction;
            if let Some(inward) = self.area.inward(to) {
                let out = target.direction.dot(inward).min(0.0);
                target.direction = (target.direction - 2.0 * out * inward).normalize_or(Vec2::X);
                to = self.area.nearest(target.at + way_m * target.direction);
            }
            if to != target.at {
                target.at = to;
                self.grid.relocate(number, to);
            }
        }
    }

    /// Returns the targets in range of a place, unordered, with their squared distances.
    pub fn in_range(&self, place: Vec2) -> impl Iterator<Item = (usize, f32)> {
        let near = self.grid.near(place, self.range_m);
        let with_distance = near.map(move |(number, at)| (number, at.distance_squared(place)));
        with_distance.filter(|(_, squared)| *squared <= self.range_m * self.range_m)
    }

    /// Returns the nearest targets in range of a place with their squared distances, sorted by distance and then by number.
    pub fn nearest(&self, place: Vec2) -> ArrayVec<(f32, usize), MAX_SENSED_TARGETS> {
        let in_range = self.in_range(place);
        nearest(in_range.map(|(number, squared)| (squared, number)))
    }

    pub fn any_within(&self, place: Vec2, reach_m: f32) -> bool {
        let mut near = self.grid.near(place, reach_m);
        near.any(|(_, at)| at.distance_squared(place) <= reach_m * reach_m)
    }

    pub fn holds(&self) -> Result<(), String> {
        // Rounding may move a place on the edge outside.
        let area = self.area.inset(-0.001);
        match self.all.iter().position(|target| !area.contains(target.at)) {
            None => Ok(()),
            Some(number) => Err(format!(
                "target t{number} is at {}, outside its region",
                self.all[number].at
            )),
        }
    }
}

/// Returns the time of the next event of a Poisson process with that rate.
fn after(now: SimTime, rate_hz: f64, rng: &mut ChaCha8Rng) -> SimTime {
    // The random number is below 1. A rate of 0 gives an infinite time.
    let wait_s = -libm::log(1.0 - rng.random::<f64>()) / rate_hz;
    let wait = SimTime::from_secs_f64(wait_s.min(1e9));
    now + wait.max(SimTime(1))
}
