//! All sensor fault modes, and the independence of their random draws.

use crate::waste::data;
use crate::waste::data::default_setup;
use proto::mission::SensorReading;
use proto::mission::items::{ItemsReading, Zone};
use proto::readings::{Ground, Hit, Pose, Proximity};
use scenario::fault::SensorFault;

use crate::waste::MISSION;
use glam::Vec2;
use proto::readings::Readings;
use proto::tick::TickMessage;
use scenario::fault::{Device, Fault, SensorError, SensorMode};
use scenario::ids::{RobotId, Tick};
use world_server::faults::schedule::FaultIndex;
use world_server::faults::sensors::Sensors;
use world_server::world::World;
use world_server::world::wrap_angle;

const BLUE: RobotId = RobotId(0);
const GOLD: RobotId = RobotId(1);

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

fn error(m: f32, deg: f32) -> SensorError {
    SensorError { m, deg }
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
        let faults = faults.into_iter().enumerate();
        Self {
            world: World::new(&default_setup(7), MISSION.world),
            sensors: Sensors::new(&default_setup(7)),
            sent: vec![TickMessage::default(); 3],
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
        self.sensors.begin(
            tick,
            faults.map(|(index, fault)| (*index, fault)),
            |robot| &self.sent[robot.index()],
        );
        let mut readings = sensed(tick);
        let hits = self
            .sensors
            .distort(self.world.mission(), robot, tick, &mut readings);
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
    for device in Device::names_for(data::WASTE) {
        let mut bench = Bench::new([sensor(device, SensorMode::Dead)]);
        let (readings, hits) = bench.tick(0);
        assert_eq!(hits, [0], "{device:?}");
        let mut expected = sensed(0);
        match device {
            Device::POSITION => expected.pose = None,
            Device::FRONT_BORDER => expected.front_border = None,
            Device::SIDE_BORDER => expected.side_border = None,
            Device::AVOIDANCE => expected.proximity = None,
            "waste" => expected.mission.items_mut().items = None,
            "spill-zone" => expected.mission.items_mut().zone = None,
            "report-site" => expected.mission.items_mut().at_site = None,
            "gripper" => expected.mission.items_mut().holding = None,
            Device::GROUND => expected.ground = None,
            other => panic!("{other}"),
        }
        assert_eq!(readings, expected, "{device:?}");
        // The teammate's device is intact.
        assert_eq!(bench.tick_of(GOLD, 0), (sensed(0), vec![]));
    }
}

#[test]
fn a_stuck_device_repeats_the_reading_of_the_previous_tick() {
    let mut bench = Bench::new([]);
    bench.tick(3);
    bench.tick(4);
    bench.faults = vec![(FaultIndex(0), sensor(Device::POSITION, SensorMode::Stuck))];
    for tick in 5..8 {
        let (readings, hits) = bench.tick(tick);
        assert_eq!(readings.pose, sensed(4).pose);
        assert_eq!(readings.mission, sensed(tick).mission);
        assert_eq!(hits, [0]);
    }
    bench.faults.clear();
    assert_eq!(bench.tick(8), (sensed(8), vec![]));
    // A renewed fault freezes the latest intact reading.
    bench.faults = vec![(FaultIndex(0), sensor(Device::POSITION, SensorMode::Stuck))];
    assert_eq!(bench.tick(9).0.pose, sensed(8).pose);
}

#[test]
fn a_stuck_device_without_a_previous_reading_keeps_its_first_one() {
    let mut bench = Bench::new([]);
    bench.tick(3);
    bench.faults = vec![(FaultIndex(0), sensor(Device::POSITION, SensorMode::Stuck))];
    // The robot received no readings in tick 4.
    let (readings, hits) = bench.tick(5);
    assert_eq!((readings, hits), (sensed(5), vec![]));
    let (readings, hits) = bench.tick(6);
    assert_eq!((readings.pose, hits), (sensed(5).pose, vec![0]));
}

#[test]
fn a_bias_shifts_every_number_equally_and_no_distance_below_zero() {
    let (readings, hits) = Bench::new([
        sensor(Device::POSITION, SensorMode::Bias(error(-0.5, 20.0))),
        sensor(Device::FRONT_BORDER, SensorMode::Bias(error(-0.5, 0.0))),
        sensor(Device::SIDE_BORDER, SensorMode::Bias(error(-0.5, 0.0))),
        sensor(Device::AVOIDANCE, SensorMode::Bias(error(-0.2, 0.0))),
        sensor("waste", SensorMode::Bias(error(0.5, 0.0))),
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
    let proximity = readings.proximity.unwrap();
    let distances = |beams: [Option<Hit>; 3]| beams.map(|hit| hit.map(|hit| hit.distance_m));
    assert_eq!(
        distances(proximity.ahead),
        [Some(0.3 - 0.2), None, Some(0.0)]
    );
    assert_eq!(distances(proximity.left), [None; 3]);
    assert_eq!(distances(proximity.right), [None, Some(0.0), None]);
    // The items stay sorted by distance.
    let expected = [Vec2::new(0.5 - 0.4, 0.1 + 0.5), Vec2::new(0.8, 0.5)];
    assert_eq!(readings.mission.items().items.as_deref().unwrap(), expected);
}

#[test]
fn noise_has_its_deviation_and_is_drawn_anew_for_every_tick_and_number() {
    const TICKS: u64 = 10_000;
    let mut bench = Bench::new([sensor(Device::POSITION, SensorMode::Noise(error(0.5, 2.0)))]);
    let mut sums = [0.0_f64; 5];
    for tick in 0..TICKS {
        let (readings, hits) = bench.tick(tick);
        assert_eq!(hits, [0]);
        let (readings, true_pose) = (readings.pose.unwrap(), sensed(tick).pose.unwrap());
        let offset = (readings.position - true_pose.position).as_dvec2();
        let turn = f64::from(wrap_angle(readings.heading_rad - true_pose.heading_rad).to_degrees());
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
    let mut bench = Bench::new([sensor("waste", SensorMode::Dropout(0.25))]);
    let silent = (0..4000).filter(|tick| {
        let (readings, hits) = bench.tick(*tick);
        assert_eq!(readings.mission.items().items.is_none(), hits == [0]);
        readings.mission.items().items.is_none()
    });
    let silent = silent.count();
    assert!((900..1100).contains(&silent), "{silent}");
    for (share, expected) in [(0.0, 0), (1.0, 100)] {
        let mut bench = Bench::new([sensor("waste", SensorMode::Dropout(share))]);
        let hits = (0..100).filter(|tick| !bench.tick(*tick).1.is_empty());
        assert_eq!(hits.count(), expected);
    }
}

#[test]
fn faults_do_not_influence_each_others_random_draws() {
    let noise = || sensor(Device::POSITION, SensorMode::Noise(error(0.5, 2.0)));
    let poses = |faults: Vec<Fault>, from: Tick| {
        let mut bench = Bench::new(faults);
        (from..10)
            .map(|tick| bench.tick(tick).0.pose)
            .collect::<Vec<_>>()
    };
    let alone = poses(vec![noise()], 0);
    let others = vec![
        sensor("waste", SensorMode::Noise(error(0.1, 0.0))),
        sensor(Device::POSITION, SensorMode::Dropout(0.0)),
        sensor_of("gold", Device::POSITION, SensorMode::Noise(error(0.5, 2.0))),
        noise(),
    ];
    assert_eq!(poses(others, 0), alone);
    assert_eq!(poses(vec![noise()], 5), alone[5..]);
}

#[test]
fn faults_of_one_device_act_in_the_order_of_arming() {
    let bias = || sensor(Device::POSITION, SensorMode::Bias(error(1.0, 0.0)));
    let dead = || sensor(Device::POSITION, SensorMode::Dead);
    let (readings, hits) = Bench::new([bias(), bias()]).tick(0);
    assert_eq!(readings.pose.unwrap().position, Vec2::new(2.0, 4.0));
    assert_eq!(hits, [0, 1]);
    assert_eq!(Bench::new([dead(), bias()]).tick(0).1, [0]);
    assert_eq!(Bench::new([bias(), dead()]).tick(0).1, [0, 1]);
    // Two noises are drawn independently.
    let noise = || sensor(Device::POSITION, SensorMode::Noise(error(1.0, 0.0)));
    let one = Bench::new([noise()]).tick(0).0.pose.unwrap().position;
    let two = Bench::new([noise(), noise()]).tick(0).0.pose.unwrap();
    let origin = sensed(0).pose.unwrap().position;
    assert!((two.position - one).distance(one - origin) > 1e-3);
}

#[test]
fn a_fault_of_a_missing_device_has_no_effect() {
    let modes = [SensorMode::Dead, SensorMode::Stuck];
    let faults = modes.map(|mode| sensor(Device::SIDE_BORDER, mode));
    let mut bench = Bench::new(faults);
    let mut readings = Readings {
        side_border: None,
        ..sensed(0)
    };
    let faults = bench.faults.iter().map(|(index, fault)| (*index, fault));
    bench.sensors.begin(0, faults, |_| &bench.sent[0]);
    assert!(
        bench
            .sensors
            .distort(bench.world.mission(), BLUE, 0, &mut readings)
            .is_empty()
    );
    assert_eq!(readings.side_border, None);
}

#[test]
fn without_power_the_energy_reads_zero_where_it_is_simulated() {
    let mut bench = Bench::new([Fault::Power("blue".to_owned())]);
    let (readings, hits) = bench.tick(0);
    assert_eq!((readings.energy_j, hits), (Some(0.0), vec![0]));
    let mut readings = Readings::default();
    assert!(
        bench
            .sensors
            .distort(bench.world.mission(), BLUE, 1, &mut readings)
            .is_empty()
    );
    assert_eq!(readings, Readings::default());
}
