//! Broken sensors: the distortion of readings before a robot receives them.
//!
//! Several faults of one device act one after the other, in the order of arming, each on the result of the previous one. An
//! error or a dropout depends only on the seed, the robot, the tick, the device and the number of earlier faults of the
//! same kind on the device.

use std::sync::Arc;

use glam::Vec2;
use proto::readings::Readings;
use proto::tick::TickMessage;
use rand_chacha::ChaCha8Rng;
use scenario::fault::{Device, Fault, SensorError, SensorMode};
use scenario::ids::{RobotId, Tick};
use scenario::mission::registry::Mission;
use scenario::rng::{Purpose, robot_stream};
use scenario::{Roster, Setup};

use super::draws::{WORDS, normal, uniform};
use super::schedule::FaultIndex;
use crate::mission::MissionWorld;
use crate::world::wrap_angle;

/// The number of devices of a robot in one part of its random stream.
const DEVICES: u64 = 16;

/// The largest number of values of a device in one tick: eight places with x and y.
const MOST_NUMBERS: u64 = 16;

#[derive(Clone, Debug)]
pub struct Sensors {
    roster: Arc<Roster>,
    mission: Mission,
    /// The random streams of errors and dropouts, indexed by rank.
    draws: Vec<ChaCha8Rng>,
    /// The defects in the order of arming.
    broken: Vec<Broken>,
    ever_broken: bool,
}

#[derive(Clone, Debug)]
struct Broken {
    fault: FaultIndex,
    robot: RobotId,
    defect: Defect,
    /// The readings that a stuck device repeats.
    stuck_at: Option<Readings>,
}

#[derive(Clone, Copy, Debug)]
enum Defect {
    Device {
        device: Device,
        /// The position of the device in the random stream.
        number: u64,
        mode: SensorMode,
        /// The number of earlier faults of the same kind on the device.
        before: u64,
    },
    /// The energy reading is 0.
    NoPower,
}

impl Sensors {
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        let robots = (0..setup.roster.names().len() as u32).map(RobotId);
        let draws = robots.map(|robot| robot_stream(setup.seed, Purpose::Sensor, robot));
        Self {
            roster: Arc::clone(&setup.roster),
            mission: setup.catalog.mission,
            draws: draws.collect(),
            broken: Vec::new(),
            ever_broken: false,
        }
    }

    /// Checks whether no sensor has been broken in this run. Then all readings were undistorted.
    #[must_use]
    pub fn never_broken(&self) -> bool {
        !self.ever_broken
    }

    /// Sets the faults in force before the first tick message of a tick, in the order of arming. Call it again if faults come into
    /// force in the tick. `sent` returns the last message to a robot.
    pub fn begin<'f>(
        &mut self,
        tick: Tick,
        in_force: impl Iterator<Item = (FaultIndex, &'f Fault)>,
        sent: impl Fn(RobotId) -> &'f TickMessage,
    ) {
        let mut previous = std::mem::take(&mut self.broken);
        for (fault, what) in in_force {
            let Some(robot) = self.rank_of(what) else {
                continue;
            };
            let defect = match what {
                Fault::Sensor(fault) => Defect::Device {
                    device: fault.device,
                    number: self.number_of(fault.device),
                    mode: fault.mode,
                    before: self.same_before(robot, fault.device, fault.mode),
                },
                Fault::Power(_) => Defect::NoPower,
                _ => continue,
            };
            let known = previous.iter().position(|broken| broken.fault == fault);
            let stuck_at = match known {
                Some(known) => previous.swap_remove(known).stuck_at,
                None => recent_readings(sent(robot), tick),
            };
            self.ever_broken = true;
            self.broken.push(Broken {
                fault,
                robot,
                defect,
                stuck_at,
            });
        }
    }

    /// Distorts the readings of a robot in a tick. Returns the faults that changed them, in the order of arming.
    #[inline]
    pub fn distort(
        &mut self,
        mission: &dyn MissionWorld,
        robot: RobotId,
        tick: Tick,
        readings: &mut Readings,
    ) -> Vec<FaultIndex> {
        // Most runs have no broken sensors.
        if self.broken.is_empty() {
            return Vec::new();
        }
        self.apply_defects(mission, robot, tick, readings)
    }

    fn apply_defects(
        &mut self,
        mission: &dyn MissionWorld,
        robot: RobotId,
        tick: Tick,
        readings: &mut Readings,
    ) -> Vec<FaultIndex> {
        let mut hits = Vec::new();
        let draws = &mut self.draws[robot.index()];
        let broken = self.broken.iter_mut();
        for broken in broken.filter(|broken| broken.robot == robot) {
            let intact = readings.clone();
            broken.act(mission, tick, draws, readings);
            if *readings != intact {
                hits.push(broken.fault);
            }
        }
        hits
    }

    fn rank_of(&self, fault: &Fault) -> Option<RobotId> {
        self.roster.find(fault.robot()?)
    }

    /// Returns the device's number: four common devices, up to four of the mission, the ground, the rest of the mission.
    fn number_of(&self, device: Device) -> u64 {
        const GROUND: usize = 8;
        let common = &Device::COMMON[..4];
        let mission_devices = self.mission.vocabulary().devices;
        let number = match common.iter().position(|name| device == **name) {
            Some(number) => number,
            None => match mission_devices.iter().position(|name| device == **name) {
                Some(index) if common.len() + index < GROUND => common.len() + index,
                Some(index) => common.len() + index + 1,
                None => GROUND,
            },
        };
        number as u64
    }

    fn same_before(&self, robot: RobotId, device: Device, mode: SensorMode) -> u64 {
        let same = self.broken.iter().filter(|broken| {
            let Defect::Device {
                device: other_device,
                mode: other_mode,
                ..
            } = broken.defect
            else {
                return false;
            };
            let same_kind = std::mem::discriminant(&other_mode) == std::mem::discriminant(&mode);
            broken.robot == robot && other_device == device && same_kind
        });
        same.count() as u64
    }
}

/// Returns the readings that a robot received in the previous or the current tick.
fn recent_readings(sent: &TickMessage, tick: Tick) -> Option<Readings> {
    let has_message = sent.incarnation > 0;
    (has_message && sent.tick + 1 >= tick).then(|| sent.readings.clone())
}

impl Broken {
    fn act(
        &mut self,
        mission: &dyn MissionWorld,
        tick: Tick,
        draws: &mut ChaCha8Rng,
        readings: &mut Readings,
    ) {
        let (device, number, mode, before) = match self.defect {
            Defect::Device {
                device,
                number,
                mode,
                before,
            } => (device, number, mode, before),
            Defect::NoPower => {
                readings.energy_j = Some(0.0);
                return;
            }
        };
        match mode {
            SensorMode::Dead => copy(mission, device, &Readings::default(), readings),
            SensorMode::Stuck => {
                let stuck_at = self.stuck_at.get_or_insert_with(|| readings.clone());
                copy(mission, device, stuck_at, readings);
            }
            SensorMode::Noise(size) => {
                seek(draws, tick, number, before, 0);
                add_error(mission, device, readings, size, || normal(draws) as f32);
            }
            SensorMode::Bias(size) => add_error(mission, device, readings, size, || 1.0),
            SensorMode::Dropout(share) => {
                seek(draws, tick, number, before, 1);
                if uniform(draws) < share {
                    copy(mission, device, &Readings::default(), readings);
                }
            }
        }
    }
}

/// Moves a robot's random stream to the position of one fault of a device in one tick. No two faults share a position.
fn seek(draws: &mut ChaCha8Rng, tick: Tick, device: u64, before: u64, kind: u64) {
    const FAULTS: u64 = 8;
    const KINDS: u64 = 2;
    const DEVICE_PARTS: u64 = 8;
    /// The numbers of robots take the lower 17 bits of a stream's number, and the purpose takes the upper 32.
    const PART_SHIFT: u32 = 17;
    const PARTS: u64 = 1 << (32 - PART_SHIFT);
    let in_tick = (device % DEVICES * FAULTS + before % FAULTS) * KINDS + kind;
    let place = u128::from(tick) * u128::from(DEVICES * FAULTS * KINDS) + u128::from(in_tick);
    // Further devices and further faults of a device use streams of their own.
    let part = (before / FAULTS * DEVICE_PARTS + device / DEVICES) % PARTS;
    let of_robot = draws.get_stream() & !((PARTS - 1) << PART_SHIFT);
    draws.set_stream(of_robot | part << PART_SHIFT);
    draws.set_word_pos(place * u128::from(MOST_NUMBERS * WORDS));
}

/// Copies the values of one device from other readings.
fn copy(mission: &dyn MissionWorld, device: Device, from: &Readings, to: &mut Readings) {
    match device.as_str() {
        Device::POSITION => to.pose = from.pose,
        Device::FRONT_BORDER => to.front_border = from.front_border,
        Device::SIDE_BORDER => to.side_border = from.side_border,
        Device::AVOIDANCE => to.proximity = from.proximity,
        Device::GROUND => to.ground = from.ground,
        name => mission.copy_device(name, &from.mission, &mut to.mission),
    }
}

/// Adds an error to every value of a device, in units of `size`. Distances stay at or above 0, and a free beam stays free.
fn add_error(
    mission: &dyn MissionWorld,
    device: Device,
    readings: &mut Readings,
    size: SensorError,
    mut error: impl FnMut() -> f32,
) {
    let farther = |distance_m: f32, error: f32| (distance_m + size.m * error).max(0.0);
    match device.as_str() {
        Device::POSITION => {
            if let Some(pose) = &mut readings.pose {
                pose.position += size.m * Vec2::new(error(), error());
                pose.heading_rad = wrap_angle(pose.heading_rad + size.deg.to_radians() * error());
            }
        }
        name @ (Device::FRONT_BORDER | Device::SIDE_BORDER) => {
            let beam = if name == Device::FRONT_BORDER {
                &mut readings.front_border
            } else {
                &mut readings.side_border
            };
            if let Some(Some(distance_m)) = beam {
                *distance_m = farther(*distance_m, error());
            }
        }
        Device::AVOIDANCE => {
            let Some(proximity) = &mut readings.proximity else {
                return;
            };
            let sides = [
                &mut proximity.ahead,
                &mut proximity.left,
                &mut proximity.right,
            ];
            for beam in sides.into_iter().flatten() {
                // A free beam takes a draw, too, so that it does not shift the draws of the other beams.
                let error_now = error();
                if let Some(hit) = beam {
                    hit.distance_m = farther(hit.distance_m, error_now);
                }
            }
        }
        // The device has no lengths; the order check rejects such a fault.
        Device::GROUND => {}
        name => {
            let sensed = &mut readings.mission;
            mission.add_error(name, sensed, &mut || size.m * error());
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use rand::Rng;

    use super::*;

    #[test]
    fn no_two_faults_share_random_numbers() {
        let mut draws = robot_stream(1, Purpose::Sensor, RobotId(3));
        let mut first_draws = BTreeSet::new();
        for device in 0..40 {
            for before in 0..40 {
                for kind in 0..2 {
                    seek(&mut draws, 7, device, before, kind);
                    first_draws.insert(draws.next_u64());
                }
            }
        }
        assert_eq!(first_draws.len(), 40 * 40 * 2);
    }

    /// The first 8 faults of the first 16 devices keep the positions of recorded runs.
    #[test]
    fn usual_faults_keep_their_positions() {
        let mut draws = robot_stream(1, Purpose::Sensor, RobotId(3));
        let stream = draws.get_stream();
        seek(&mut draws, 7, 40, 40, 0);
        seek(&mut draws, 7, 5, 3, 1);
        let place = 7 * 256 + (5 * 8 + 3) * 2 + 1;
        assert_eq!(
            (draws.get_stream(), draws.get_word_pos()),
            (stream, place * 64)
        );
    }
}
