//! All sensor fault modes, and the independence of their random draws.

use glam::Vec2;
use proto::mission::SensorReading;
use proto::mission::items::{ItemsReading, Zone};
use proto::readings::{Ground, Hit, Pose, Proximity, Readings};
use proto::tick::TickMessage;
use scenario::fault::{Device, Fault, SensorError, SensorFault, SensorMode};
use scenario::ids::{RobotId, Tick};
use world_server::faults::schedule::FaultIndex;
use world_server::faults::sensors::Sensors;
use world_server::world::{World, wrap_angle};

use super::floor::{BLUE, GOLD};
use crate::waste::MISSION;
use crate::waste::data::{WASTE, default_setup};

fn sensor(device: &str, mode: SensorMode) -> Fault {
    sensor_of("blue", device, mode)
}

fn sensor_of(robot: &str, device: &str, mode: SensorMode) -> Fault {
    Fault::Sensor(SensorFault {
        robot: robot.to_owned(),
        device: Device::new(device),
        mode,
    })
}

fn noise(m: f32, deg: f32) -> SensorMode {
    SensorMode::Noise(SensorError { m, deg })
}

fn bias(m: f32, deg: f32) -> SensorMode {
    SensorMode::Bias(SensorError { m, deg })
}

/// Returns the readings of a robot whose devices all work.
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
        mission: SensorReading::Items(ItemsReading {
            items: Some(
                [Vec2::new(0.3, 0.0), Vec2::new(-0.4, 0.1)]
                    .into_iter()
                    .collect(),
            ),
            zone: Some(Zone::Source),
            at_site: Some(false),
            holding: Some(true),
        }),
        ground: Some(Ground {
            here: 1.0,
            ahead: 0.5,
        }),
        energy_j: Some(100.0),
    }
}

/// The sensors of the default team, with faults in force from the first tick on.
struct Bench {
    world: World,
    sensors: Sensors,
    faults: Vec<(FaultIndex, Fault)>,
    /// The last message to each robot, by rank.
    sent: Vec<TickMessage>,
}

impl Bench {
    fn new(faults: impl IntoIterator<Item = Fault>) -> Self {
        let mut bench = Self {
            world: World::new(&default_setup(7), MISSION.world),
            sensors: Sensors::new(&default_setup(7)),
            sent: vec![TickMessage::default(); 3],
            faults: Vec::new(),
        };
        bench.arm(faults);
        bench
    }

    fn arm(&mut self, faults: impl IntoIterator<Item = Fault>) {
        let faults = faults.into_iter().enumerate();
        self.faults = faults
            .map(|(index, fault)| (FaultIndex(index), fault))
            .collect();
    }

    fn tick(&mut self, tick: Tick) -> (Readings, Vec<usize>) {
        self.tick_of(BLUE, tick, sensed(tick))
    }

    /// Makes a tick of a robot with these intact readings. Returns its readings and the faults that changed them.
    fn tick_of(
        &mut self,
        robot: RobotId,
        tick: Tick,
        mut readings: Readings,
    ) -> (Readings, Vec<usize>) {
        let faults = self.faults.iter().map(|(index, fault)| (*index, fault));
        let sent = |robot: RobotId| &self.sent[robot.index()];
        self.sensors.begin(tick, faults, sent);
        let mission = self.world.mission();
        let hits = self.sensors.distort(mission, robot, tick, &mut readings);
        self.sent[robot.index()] = TickMessage {
            incarnation: 1,
            tick,
            readings: readings.clone(),
            ..TickMessage::default()
        };
        (readings, hits.into_iter().map(|fault| fault.0).collect())
    }
}

#[test]
fn a_dead_device_has_no_reading_and_all_others_continue() {
    for device in Device::names_for(WASTE) {
        let mut bench = Bench::new([sensor(device, SensorMode::Dead)]);
        let mut expected = sensed(0);
        let waste = expected.mission.items_mut();
        match device {
            Device::POSITION => expected.pose = None,
            Device::FRONT_BORDER => expected.front_border = None,
            Device::SIDE_BORDER => expected.side_border = None,
            Device::AVOIDANCE => expected.proximity = None,
            "waste" => waste.items = None,
            "spill-zone" => waste.zone = None,
            "report-site" => waste.at_site = None,
            "gripper" => waste.holding = None,
            Device::GROUND => expected.ground = None,
            other => panic!("{other}"),
        }
        assert_eq!(bench.tick(0), (expected, vec![0]), "{device:?}");
        // The teammate's device is intact.
        let mate = bench.tick_of(GOLD, 0, sensed(0));
        assert_eq!(mate, (sensed(0), vec![]));
    }
}

#[test]
fn a_stuck_device_repeats_the_reading_of_the_previous_tick() {
    let stuck = || [sensor(Device::POSITION, SensorMode::Stuck)];
    let mut bench = Bench::new([]);
    bench.tick(3);
    bench.tick(4);
    bench.arm(stuck());
    for tick in 5..8 {
        let (readings, hits) = bench.tick(tick);
        assert_eq!(readings.pose, sensed(4).pose);
        assert_eq!(readings.mission, sensed(tick).mission);
        assert_eq!(hits, [0]);
    }
    bench.arm([]);
    assert_eq!(bench.tick(8), (sensed(8), vec![]));
    // A renewed fault freezes the latest intact reading.
    bench.arm(stuck());
    assert_eq!(bench.tick(9).0.pose, sensed(8).pose);
    // Without a reading in the previous tick, the device keeps its first one.
    let mut bench = Bench::new([]);
    bench.tick(3);
    bench.arm(stuck());
    assert_eq!(bench.tick(5), (sensed(5), vec![]));
    let (readings, hits) = bench.tick(6);
    assert_eq!((readings.pose, hits), (sensed(5).pose, vec![0]));
}

#[test]
fn a_bias_shifts_every_number_equally_and_no_distance_below_zero() {
    let (readings, hits) = Bench::new([
        sensor(Device::POSITION, bias(-0.5, 20.0)),
        sensor(Device::FRONT_BORDER, bias(-0.5, 0.0)),
        sensor(Device::SIDE_BORDER, bias(-0.5, 0.0)),
        sensor(Device::AVOIDANCE, bias(-0.2, 0.0)),
        sensor("waste", bias(0.5, 0.0)),
    ])
    .tick(4);
    // The side is free, so there is no number to falsify.
    assert_eq!(hits, [0, 1, 3, 4]);
    let pose = readings.pose.unwrap();
    assert_eq!(pose.position, Vec2::new(3.5, 1.5));
    let heading_rad = 3.0 + 20_f32.to_radians() - std::f32::consts::TAU;
    assert!((pose.heading_rad - heading_rad).abs() < 1e-6);
    assert_eq!(readings.front_border, Some(Some(0.0)));
    assert_eq!(readings.side_border, Some(None));
    let Proximity { ahead, left, right } = readings.proximity.unwrap();
    let distances = |beams: [Option<Hit>; 3]| beams.map(|hit| hit.map(|hit| hit.distance_m));
    assert_eq!(distances(ahead), [Some(0.3 - 0.2), None, Some(0.0)]);
    assert_eq!(distances(left), [None; 3]);
    assert_eq!(distances(right), [None, Some(0.0), None]);
    // The items stay sorted by distance.
    let expected = [Vec2::new(0.5 - 0.4, 0.1 + 0.5), Vec2::new(0.8, 0.5)];
    assert_eq!(readings.mission.items().items.as_deref().unwrap(), expected);
}

#[test]
fn noise_has_its_deviation_and_is_drawn_anew_for_every_tick_and_number() {
    const TICKS: u64 = 10_000;
    let mut bench = Bench::new([sensor(Device::POSITION, noise(0.5, 2.0))]);
    let mut sums = [0.0_f64; 5];
    for tick in 0..TICKS {
        let (readings, hits) = bench.tick(tick);
        assert_eq!(hits, [0]);
        let (pose, true_pose) = (readings.pose.unwrap(), sensed(tick).pose.unwrap());
        let offset = (pose.position - true_pose.position).as_dvec2();
        let turn_rad = wrap_angle(pose.heading_rad - true_pose.heading_rad);
        let turn = f64::from(turn_rad.to_degrees());
        let (x, y) = (offset.x, offset.y);
        for (sum, term) in sums.iter_mut().zip([x, x * x, y * y, x * y, turn * turn]) {
            *sum += term / TICKS as f64;
        }
    }
    for (got, wanted) in sums.into_iter().zip([0.0, 0.25, 0.25, 0.0, 4.0]) {
        let tolerance = 0.02 * (1.0 + wanted * 5.0);
        assert!((got - wanted).abs() < tolerance, "{sums:?}");
    }
}

#[test]
fn a_dropout_takes_its_share_of_the_ticks() {
    for (share, ticks, expected) in [
        (0.25, 4000, 900..1100),
        (0.0, 100, 0..1),
        (1.0, 100, 100..101),
    ] {
        let mut bench = Bench::new([sensor("waste", SensorMode::Dropout(share))]);
        let silent = (0..ticks).filter(|tick| {
            let (readings, hits) = bench.tick(*tick);
            let is_silent = readings.mission.items().items.is_none();
            assert_eq!(is_silent, hits == [0]);
            is_silent
        });
        let silent = silent.count();
        assert!(expected.contains(&silent), "{silent}");
    }
}

#[test]
fn faults_do_not_influence_each_others_random_draws() {
    let noisy = || sensor(Device::POSITION, noise(0.5, 2.0));
    let poses = |faults: Vec<Fault>, from: Tick| {
        let mut bench = Bench::new(faults);
        let poses = (from..10).map(|tick| bench.tick(tick).0.pose);
        poses.collect::<Vec<_>>()
    };
    let alone = poses(vec![noisy()], 0);
    let others = vec![
        sensor("waste", noise(0.1, 0.0)),
        sensor(Device::POSITION, SensorMode::Dropout(0.0)),
        sensor_of("gold", Device::POSITION, noise(0.5, 2.0)),
        noisy(),
    ];
    assert_eq!(poses(others, 0), alone);
    assert_eq!(poses(vec![noisy()], 5), alone[5..]);
}

#[test]
fn faults_of_one_device_act_in_the_order_of_arming() {
    let position = |mode| sensor(Device::POSITION, mode);
    let shifted = || position(bias(1.0, 0.0));
    let dead = || position(SensorMode::Dead);
    let (readings, hits) = Bench::new([shifted(), shifted()]).tick(0);
    assert_eq!(readings.pose.unwrap().position, Vec2::new(2.0, 4.0));
    assert_eq!(hits, [0, 1]);
    assert_eq!(Bench::new([dead(), shifted()]).tick(0).1, [0]);
    assert_eq!(Bench::new([shifted(), dead()]).tick(0).1, [0, 1]);
    // Two noises are drawn independently.
    let noisy = || position(noise(1.0, 0.0));
    let place = |faults: &[Fault]| {
        let (readings, _) = Bench::new(faults.to_vec()).tick(0);
        readings.pose.unwrap().position
    };
    let (one, two) = (place(&[noisy()]), place(&[noisy(), noisy()]));
    let first_error = one - place(&[]);
    assert!((two - one).distance(first_error) > 1e-3);
}

#[test]
fn a_fault_of_a_missing_device_has_no_effect() {
    let modes = [SensorMode::Dead, SensorMode::Stuck];
    let mut bench = Bench::new(modes.map(|mode| sensor(Device::SIDE_BORDER, mode)));
    let without = Readings {
        side_border: None,
        ..sensed(0)
    };
    let answer = bench.tick_of(BLUE, 0, without.clone());
    assert_eq!(answer, (without, vec![]));
}

#[test]
fn without_power_the_energy_reads_zero() {
    let mut bench = Bench::new([Fault::Power("blue".to_owned())]);
    let (readings, hits) = bench.tick(0);
    assert_eq!((readings.energy_j, hits), (Some(0.0), vec![0]));
    // A robot whose energy is not simulated senses it, too.
    let (readings, hits) = bench.tick_of(BLUE, 1, Readings::default());
    assert_eq!((readings.energy_j, hits), (Some(0.0), vec![0]));
}
