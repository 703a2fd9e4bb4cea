//! Broken sensors: what a robot is told instead of what there is to sense.
//!
//! Several faults of one device act one after the other, in the order in which they were armed: the second distorts what the
//! first has left. An error or a dropout depends on the seed, the robot, the tick, the device and how many faults of the same
//! kind act on that device before it, and on nothing else.

use alliance_proto::fault::{Device, Fault, SensorError, SensorMode};
use alliance_proto::ids::{RobotId, Tick};
use alliance_proto::readings::Readings;
use alliance_proto::rng::{Purpose, robot_stream};
use alliance_proto::scenario::Setup;
use glam::Vec2;
use rand_chacha::ChaCha8Rng;

use super::luck::{WORDS, normal, uniform};
use super::schedule::FaultIndex;
use crate::world::wrapped;

/// Most numbers that a device tells in one tick: eight items of waste, x and y.
const MOST_NUMBERS: u64 = 16;

/// The broken sensors of all robots.
#[derive(Clone, Debug)]
pub struct Sensors {
    /// By rank.
    robots: Vec<Robot>,
    /// In the order of arming.
    broken: Vec<Broken>,
}

#[derive(Clone, Debug)]
struct Robot {
    name: String,
    luck: ChaCha8Rng,
    /// What it was told last, and when.
    told: Option<(Tick, Readings)>,
}

#[derive(Clone, Debug)]
struct Broken {
    fault: FaultIndex,
    robot: RobotId,
    defect: Defect,
    /// Readings whose device says what a stuck one goes on telling.
    stuck_at: Option<Readings>,
}

#[derive(Clone, Copy, Debug)]
enum Defect {
    Device {
        device: Device,
        mode: SensorMode,
        /// How many faults of the same kind act on the device before.
        before: u64,
    },
    /// The energy reads 0.
    NoPower,
}

impl Sensors {
    /// Intact sensors.
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        let robots = setup.scenario.robots.iter().enumerate();
        let robots = robots.map(|(rank, robot)| Robot {
            name: robot.name.clone(),
            luck: robot_stream(setup.seed, Purpose::Sensor, RobotId(rank as u16)),
            told: None,
        });
        Self {
            robots: robots.collect(),
            broken: Vec::new(),
        }
    }

    /// Takes note of the faults that are in force in a tick, in the order of arming, before its first robot is asked. May be
    /// called again in the same tick when others have come into force.
    pub fn begin<'f>(
        &mut self,
        tick: Tick,
        in_force: impl Iterator<Item = (FaultIndex, &'f Fault)>,
    ) {
        let mut until_now = std::mem::take(&mut self.broken);
        for (fault, what) in in_force {
            let Some(robot) = self.rank_of(what) else {
                continue;
            };
            let defect = match what {
                Fault::Sensor(fault) => Defect::Device {
                    device: fault.device,
                    mode: fault.mode,
                    before: self.same_before(robot, fault.device, fault.mode),
                },
                Fault::Power(_) => Defect::NoPower,
                _ => continue,
            };
            let known = until_now.iter().position(|broken| broken.fault == fault);
            let stuck_at = match known {
                Some(known) => until_now.swap_remove(known).stuck_at,
                None => self.told_before(robot, tick),
            };
            self.broken.push(Broken {
                fault,
                robot,
                defect,
                stuck_at,
            });
        }
    }

    /// Distorts what a robot senses in a tick into what it is told. Returns the faults that changed it, in the order of
    /// arming. To be called for every robot that is asked, broken or not.
    pub fn distort(
        &mut self,
        robot: RobotId,
        tick: Tick,
        readings: &mut Readings,
    ) -> Vec<FaultIndex> {
        let mut hits = Vec::new();
        let Robot { luck, told, .. } = &mut self.robots[robot.index()];
        let broken = self.broken.iter_mut();
        for broken in broken.filter(|broken| broken.robot == robot) {
            let intact = readings.clone();
            broken.act(tick, luck, readings);
            if *readings != intact {
                hits.push(broken.fault);
            }
        }
        *told = Some((tick, readings.clone()));
        hits
    }

    fn rank_of(&self, fault: &Fault) -> Option<RobotId> {
        let name = fault.robot()?;
        let rank = self.robots.iter().position(|robot| robot.name == name)?;
        Some(RobotId(rank as u16))
    }

    /// What a robot was told in the tick before this one, or already in this one.
    fn told_before(&self, robot: RobotId, tick: Tick) -> Option<Readings> {
        let told = self.robots[robot.index()].told.as_ref();
        told.filter(|(when, _)| when + 1 >= tick)
            .map(|(_, readings)| readings.clone())
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

impl Broken {
    fn act(&mut self, tick: Tick, luck: &mut ChaCha8Rng, readings: &mut Readings) {
        let (device, mode, before) = match self.defect {
            Defect::Device {
                device,
                mode,
                before,
            } => (device, mode, before),
            Defect::NoPower => {
                readings.energy_j = readings.energy_j.map(|_| 0.0);
                return;
            }
        };
        match mode {
            SensorMode::Dead => copy(device, &Readings::default(), readings),
            SensorMode::Stuck => {
                let stuck_at = self.stuck_at.get_or_insert_with(|| readings.clone());
                copy(device, stuck_at, readings);
            }
            SensorMode::Noise(size) => {
                seek(luck, tick, device, before, 0);
                mislead(device, readings, size, || normal(luck) as f32);
            }
            SensorMode::Bias(size) => mislead(device, readings, size, || 1.0),
            SensorMode::Dropout(share) => {
                seek(luck, tick, device, before, 1);
                if uniform(luck) < share {
                    copy(device, &Readings::default(), readings);
                }
            }
        }
    }
}

/// Goes to the place in a robot's stream that belongs to one fault of a device in one tick.
fn seek(luck: &mut ChaCha8Rng, tick: Tick, device: Device, before: u64, kind: u64) {
    const DEVICES: u64 = 16;
    const FAULTS: u64 = 8;
    const KINDS: u64 = 2;
    let in_tick = ((device as u64) * FAULTS + before % FAULTS) * KINDS + kind;
    let place = u128::from(tick) * u128::from(DEVICES * FAULTS * KINDS) + u128::from(in_tick);
    luck.set_word_pos(place * u128::from(MOST_NUMBERS * WORDS));
}

/// Makes a device tell what it tells in other readings.
fn copy(device: Device, from: &Readings, to: &mut Readings) {
    match device {
        Device::Position => to.pose = from.pose,
        Device::FrontBorder => to.front_border = from.front_border,
        Device::SideBorder => to.side_border = from.side_border,
        Device::Avoidance => to.proximity = from.proximity,
        Device::Waste => to.waste.clone_from(&from.waste),
        Device::SpillZone => to.zone = from.zone,
        Device::ReportSite => to.report_site = from.report_site,
        Device::Gripper => to.holding = from.holding,
        Device::Ground => to.ground = from.ground,
    }
}

/// Makes every number that a device tells wrong by an error in units of that size. Distances do not get negative, a free
/// beam stays free, and waste stays sorted by its distance.
fn mislead(
    device: Device,
    readings: &mut Readings,
    size: SensorError,
    mut error: impl FnMut() -> f32,
) {
    let farther = |distance_m: f32, error: f32| (distance_m + size.m * error).max(0.0);
    match device {
        Device::Position => {
            if let Some(pose) = &mut readings.pose {
                pose.position += size.m * Vec2::new(error(), error());
                pose.heading_rad = wrapped(pose.heading_rad + size.deg.to_radians() * error());
            }
        }
        Device::FrontBorder | Device::SideBorder => {
            let beam = if device == Device::FrontBorder {
                &mut readings.front_border
            } else {
                &mut readings.side_border
            };
            if let Some(Some(distance_m)) = beam {
                *distance_m = farther(*distance_m, error());
            }
        }
        Device::Avoidance => {
            let Some(proximity) = &mut readings.proximity else {
                return;
            };
            let sides = [
                &mut proximity.ahead,
                &mut proximity.left,
                &mut proximity.right,
            ];
            for beam in sides.into_iter().flatten() {
                // Drawn for a free beam as well, so that one does not shift the others' luck.
                let error_now = error();
                if let Some(hit) = beam {
                    hit.distance_m = farther(hit.distance_m, error_now);
                }
            }
        }
        Device::Waste => {
            let Some(items) = &mut readings.waste else {
                return;
            };
            for item in items.iter_mut() {
                *item += size.m * Vec2::new(error(), error());
            }
            items.sort_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
        }
        // They tell no lengths: an order that wants it is refused.
        Device::SpillZone | Device::ReportSite | Device::Gripper | Device::Ground => {}
    }
}

#[cfg(test)]
mod tests {
    use alliance_proto::fault::SensorFault;
    use alliance_proto::readings::{Ground, Hit, Pose, Proximity, Zone};

    use super::*;

    const BLUE: RobotId = RobotId(0);
    const GOLD: RobotId = RobotId(1);

    fn sensor(device: Device, mode: SensorMode) -> Fault {
        sensor_of("blue", device, mode)
    }

    fn sensor_of(robot: &str, device: Device, mode: SensorMode) -> Fault {
        Fault::Sensor(SensorFault {
            robot: robot.to_owned(),
            device,
            mode,
        })
    }

    fn error(m: f32, deg: f32) -> SensorError {
        SensorError { m, deg }
    }

    /// What an intact robot senses, all devices at work.
    fn sensed(tick: Tick) -> Readings {
        let hit = |distance_m| {
            Some(Hit {
                distance_m,
                normal_rad: 3.0,
            })
        };
        Readings {
            pose: Some(Pose {
                position: Vec2::new(tick as f32, 2.0),
                heading_rad: 3.0,
            }),
            front_border: Some(Some(0.4)),
            side_border: Some(None),
            proximity: Some(Proximity {
                ahead: [hit(0.3), None, hit(0.1)],
                left: [None; 3],
                right: [None, hit(0.2), None],
            }),
            waste: Some(vec![Vec2::new(0.3, 0.0), Vec2::new(-0.4, 0.1)]),
            zone: Some(Zone::Spill),
            report_site: Some(false),
            holding: Some(true),
            ground: Some(Ground {
                here: 1.0,
                ahead: 0.5,
            }),
            energy_j: Some(100.0),
        }
    }

    /// Sensors of the default team with these faults in force from the first tick on.
    struct Bench {
        sensors: Sensors,
        faults: Vec<(FaultIndex, Fault)>,
    }

    impl Bench {
        fn new(faults: impl IntoIterator<Item = Fault>) -> Self {
            let faults = faults.into_iter().enumerate();
            Self {
                sensors: Sensors::new(&Setup::default_for(7)),
                faults: faults
                    .map(|(index, fault)| (FaultIndex(index), fault))
                    .collect(),
            }
        }

        fn tick(&mut self, tick: Tick) -> (Readings, Vec<usize>) {
            self.tick_of(BLUE, tick)
        }

        fn tick_of(&mut self, robot: RobotId, tick: Tick) -> (Readings, Vec<usize>) {
            let faults = self.faults.iter();
            self.sensors
                .begin(tick, faults.map(|(index, fault)| (*index, fault)));
            let mut readings = sensed(tick);
            let hits = self.sensors.distort(robot, tick, &mut readings);
            (readings, hits.into_iter().map(|fault| fault.0).collect())
        }
    }

    #[test]
    fn each_dead_device_is_silent_and_all_others_go_on() {
        for device in Device::ALL {
            let mut bench = Bench::new([sensor(device, SensorMode::Dead)]);
            let (told, hits) = bench.tick(0);
            assert_eq!(hits, [0], "{device:?}");
            let mut expected = sensed(0);
            match device {
                Device::Position => expected.pose = None,
                Device::FrontBorder => expected.front_border = None,
                Device::SideBorder => expected.side_border = None,
                Device::Avoidance => expected.proximity = None,
                Device::Waste => expected.waste = None,
                Device::SpillZone => expected.zone = None,
                Device::ReportSite => expected.report_site = None,
                Device::Gripper => expected.holding = None,
                Device::Ground => expected.ground = None,
            }
            assert_eq!(told, expected, "{device:?}");
            // A teammate's is intact.
            assert_eq!(bench.tick_of(GOLD, 0), (sensed(0), vec![]));
        }
    }

    #[test]
    fn a_stuck_one_goes_on_telling_what_it_told_in_the_tick_before() {
        let mut bench = Bench::new([]);
        bench.tick(3);
        bench.tick(4);
        bench.faults = vec![(FaultIndex(0), sensor(Device::Position, SensorMode::Stuck))];
        for tick in 5..8 {
            let (told, hits) = bench.tick(tick);
            assert_eq!(told.pose, sensed(4).pose);
            assert_eq!(told.waste, sensed(tick).waste);
            assert_eq!(hits, [0]);
        }
        bench.faults.clear();
        assert_eq!(bench.tick(8), (sensed(8), vec![]));
        // Again in force, it is stuck at what it told before that.
        bench.faults = vec![(FaultIndex(0), sensor(Device::Position, SensorMode::Stuck))];
        assert_eq!(bench.tick(9).0.pose, sensed(8).pose);
    }

    #[test]
    fn a_stuck_one_of_a_robot_that_was_told_nothing_before_keeps_what_it_tells_first() {
        let mut bench = Bench::new([]);
        bench.tick(3);
        bench.faults = vec![(FaultIndex(0), sensor(Device::Position, SensorMode::Stuck))];
        // The robot was not asked in tick 4.
        let (told, hits) = bench.tick(5);
        assert_eq!((told, hits), (sensed(5), vec![]));
        let (told, hits) = bench.tick(6);
        assert_eq!((told.pose, hits), (sensed(5).pose, vec![0]));
    }

    #[test]
    fn a_bias_moves_every_number_by_the_same_and_no_distance_below_zero() {
        let (told, hits) = Bench::new([
            sensor(Device::Position, SensorMode::Bias(error(-0.5, 20.0))),
            sensor(Device::FrontBorder, SensorMode::Bias(error(-0.5, 0.0))),
            sensor(Device::SideBorder, SensorMode::Bias(error(-0.5, 0.0))),
            sensor(Device::Avoidance, SensorMode::Bias(error(-0.2, 0.0))),
            sensor(Device::Waste, SensorMode::Bias(error(0.5, 0.0))),
        ])
        .tick(4);
        // The side is free, so there is no number to be wrong.
        assert_eq!(hits, [0, 1, 3, 4]);
        let pose = told.pose.unwrap();
        assert_eq!(pose.position, Vec2::new(3.5, 1.5));
        let heading_rad = 3.0 + 20_f32.to_radians() - std::f32::consts::TAU;
        assert!((pose.heading_rad - heading_rad).abs() < 1e-6);
        assert_eq!(told.front_border, Some(Some(0.0)));
        assert_eq!(told.side_border, Some(None));
        let proximity = told.proximity.unwrap();
        let distances = |beams: [Option<Hit>; 3]| beams.map(|hit| hit.map(|hit| hit.distance_m));
        assert_eq!(
            distances(proximity.ahead),
            [Some(0.3 - 0.2), None, Some(0.0)]
        );
        assert_eq!(distances(proximity.left), [None; 3]);
        assert_eq!(distances(proximity.right), [None, Some(0.0), None]);
        // Nearest first still.
        let expected = vec![Vec2::new(0.5 - 0.4, 0.1 + 0.5), Vec2::new(0.8, 0.5)];
        assert_eq!(told.waste, Some(expected));
    }

    #[test]
    fn noise_has_its_size_and_is_new_in_every_tick_and_number() {
        const TICKS: u64 = 10_000;
        let mut bench = Bench::new([sensor(Device::Position, SensorMode::Noise(error(0.5, 2.0)))]);
        let mut sums = [0.0_f64; 5];
        for tick in 0..TICKS {
            let (told, hits) = bench.tick(tick);
            assert_eq!(hits, [0]);
            let (told, true_pose) = (told.pose.unwrap(), sensed(tick).pose.unwrap());
            let offset = (told.position - true_pose.position).as_dvec2();
            let turn = f64::from(wrapped(told.heading_rad - true_pose.heading_rad).to_degrees());
            let terms = [
                offset.x,
                offset.x * offset.x,
                offset.y * offset.y,
                offset.x * offset.y,
                turn * turn,
            ];
            for (sum, term) in sums.iter_mut().zip(terms) {
                *sum += term / TICKS as f64;
            }
        }
        for (got, wanted) in sums.into_iter().zip([0.0, 0.25, 0.25, 0.0, 4.0]) {
            assert!(
                (got - wanted).abs() < 0.02 * (1.0 + wanted * 5.0),
                "{sums:?}"
            );
        }
    }

    #[test]
    fn a_dropout_takes_its_share_of_the_ticks() {
        let mut bench = Bench::new([sensor(Device::Waste, SensorMode::Dropout(0.25))]);
        let silent = (0..4000).filter(|tick| {
            let (told, hits) = bench.tick(*tick);
            assert_eq!(told.waste.is_none(), hits == [0]);
            told.waste.is_none()
        });
        let silent = silent.count();
        assert!((900..1100).contains(&silent), "{silent}");
        for (share, expected) in [(0.0, 0), (1.0, 100)] {
            let mut bench = Bench::new([sensor(Device::Waste, SensorMode::Dropout(share))]);
            let hits = (0..100).filter(|tick| !bench.tick(*tick).1.is_empty());
            assert_eq!(hits.count(), expected);
        }
    }

    #[test]
    fn no_fault_shifts_the_luck_of_another() {
        let noise = || sensor(Device::Position, SensorMode::Noise(error(0.5, 2.0)));
        let told = |faults: Vec<Fault>, from: Tick| {
            let mut bench = Bench::new(faults);
            (from..10)
                .map(|tick| bench.tick(tick).0.pose)
                .collect::<Vec<_>>()
        };
        let alone = told(vec![noise()], 0);
        let others = vec![
            sensor(Device::Waste, SensorMode::Noise(error(0.1, 0.0))),
            sensor(Device::Position, SensorMode::Dropout(0.0)),
            sensor_of("gold", Device::Position, SensorMode::Noise(error(0.5, 2.0))),
            noise(),
        ];
        assert_eq!(told(others, 0), alone);
        assert_eq!(told(vec![noise()], 5), alone[5..]);
    }

    #[test]
    fn faults_of_one_device_act_in_the_order_of_arming() {
        let bias = || sensor(Device::Position, SensorMode::Bias(error(1.0, 0.0)));
        let dead = || sensor(Device::Position, SensorMode::Dead);
        let (told, hits) = Bench::new([bias(), bias()]).tick(0);
        assert_eq!(told.pose.unwrap().position, Vec2::new(2.0, 4.0));
        assert_eq!(hits, [0, 1]);
        assert_eq!(Bench::new([dead(), bias()]).tick(0).1, [0]);
        assert_eq!(Bench::new([bias(), dead()]).tick(0).1, [0, 1]);
        // Two noises are not the same noise twice.
        let noise = || sensor(Device::Position, SensorMode::Noise(error(1.0, 0.0)));
        let one = Bench::new([noise()]).tick(0).0.pose.unwrap().position;
        let two = Bench::new([noise(), noise()]).tick(0).0.pose.unwrap();
        let origin = sensed(0).pose.unwrap().position;
        assert!((two.position - one).distance(one - origin) > 1e-3);
    }

    #[test]
    fn a_device_that_a_robot_lacks_cannot_be_hit() {
        let modes = [SensorMode::Dead, SensorMode::Stuck];
        let faults = modes.map(|mode| sensor(Device::SideBorder, mode));
        let mut bench = Bench::new(faults);
        let mut readings = Readings {
            side_border: None,
            ..sensed(0)
        };
        let faults = bench.faults.iter().map(|(index, fault)| (*index, fault));
        bench.sensors.begin(0, faults);
        assert!(bench.sensors.distort(BLUE, 0, &mut readings).is_empty());
        assert_eq!(readings.side_border, None);
    }

    #[test]
    fn without_power_the_energy_reads_zero_where_it_is_simulated() {
        let mut bench = Bench::new([Fault::Power("blue".to_owned())]);
        let (told, hits) = bench.tick(0);
        assert_eq!((told.energy_j, hits), (Some(0.0), vec![0]));
        let mut readings = Readings::default();
        assert!(bench.sensors.distort(BLUE, 1, &mut readings).is_empty());
        assert_eq!(readings, Readings::default());
    }
}
