//! Random faults: a campaign as orders for the schedule.
//!
//! Each robot has its own random stream, and each of its failures its own position there. So the failure and repair times
//! depend on no other robot, no mix and no other failure.

use rand_chacha::ChaCha8Rng;
use scenario::fault::{
    ActuatorFault, ActuatorMode, Delay, Device, Fault, LinkEnd, Loss, Order, RandomFaults,
    SensorError, SensorFault, SensorMode, Side,
};
use scenario::ids::RobotId;
use scenario::mission::registry::Mission;
use scenario::rng::{Purpose, robot_stream};
use scenario::time::SimTime;
use scenario::{Robot, Scenario};

use super::draws::{WORDS, exponential, uniform};

/// The largest number of random numbers per failure.
const DRAWS: u64 = 16;

/// A function that draws a failure of one kind: one fault, or two related faults.
type Draw = fn(&mut ChaCha8Rng, &Robot, Mission) -> Vec<Fault>;

/// Creates the random faults up to the mission's time limit, ordered by time, with the ids `random-1`, `random-2`, ….
/// Robots present from the start alternate between working and failed periods of exponentially distributed length.
#[must_use]
pub fn expand(campaign: &RandomFaults, scenario: &Scenario, seed: u64) -> Vec<Order> {
    let mix = &campaign.mix;
    let kinds: [(f64, Draw); 7] = [
        (mix.kill, kill),
        (mix.pause, pause),
        (mix.link, link),
        (mix.sensor, sensor),
        (mix.actuator, actuator),
        (mix.power, power),
        (mix.babble, babble),
    ];
    let limit = SimTime::from_secs_f64(scenario.limit_s);
    let mut orders = Vec::new();
    let robots = scenario.robots.iter().enumerate();
    for (rank, robot) in robots.filter(|(_, robot)| !robot.absent) {
        let mut rng = robot_stream(seed, Purpose::RandomFaults, RobotId(rank as u32));
        let mut repaired = SimTime::ZERO;
        for number in 0_u64.. {
            rng.set_word_pos(u128::from(number) * u128::from(DRAWS * WORDS));
            let at = repaired + SimTime::from_secs_f64(exponential(&mut rng, campaign.mtbf_s));
            if at >= limit {
                break;
            }
            let out = SimTime::from_secs_f64(exponential(&mut rng, campaign.mttr_s));
            // An order lasts at least 1 ms and stays within the range of its numbers.
            let out = out.clamp(SimTime(1), limit.max(SimTime(1)));
            for fault in weighted(&mut rng, &kinds)(&mut rng, robot, scenario.mission()) {
                orders.push(Order {
                    at_s: Some(at.as_secs_f64()),
                    for_s: Some(out.as_secs_f64()),
                    ..Order::now(fault)
                });
            }
            repaired = at + out;
        }
    }
    // The sort is stable: at the same time, the robot of lower rank comes first.
    orders.sort_by_key(Order::at);
    for (index, order) in orders.iter_mut().enumerate() {
        order.id = Some(format!("{}{}", RandomFaults::ID_PREFIX, index + 1));
    }
    orders
}

/// Selects a kind with a probability proportional to its weight. At least one weight is above 0.
fn weighted(rng: &mut ChaCha8Rng, kinds: &[(f64, Draw)]) -> Draw {
    let total: f64 = kinds.iter().map(|(weight, _)| weight).sum();
    let mut left = uniform(rng) * total;
    let mut chosen = kinds[0].1;
    for (weight, draw) in kinds.iter().filter(|(weight, _)| *weight > 0.0) {
        chosen = *draw;
        left -= weight;
        if left < 0.0 {
            break;
        }
    }
    chosen
}

fn kill(_: &mut ChaCha8Rng, robot: &Robot, _: Mission) -> Vec<Fault> {
    vec![Fault::Kill(robot.name.clone())]
}

fn pause(_: &mut ChaCha8Rng, robot: &Robot, _: Mission) -> Vec<Fault> {
    vec![Fault::Pause(robot.name.clone())]
}

fn power(_: &mut ChaCha8Rng, robot: &Robot, _: Mission) -> Vec<Fault> {
    vec![Fault::Power(robot.name.clone())]
}

fn babble(_: &mut ChaCha8Rng, robot: &Robot, _: Mission) -> Vec<Fault> {
    vec![Fault::Babble(robot.name.clone())]
}

/// Draws a fault of both directions of a robot's radio.
fn link(rng: &mut ChaCha8Rng, robot: &Robot, _: Mission) -> Vec<Fault> {
    let endpoint = || LinkEnd::Robot(robot.name.clone());
    let directions = [(endpoint(), LinkEnd::All), (LinkEnd::All, endpoint())];
    match choice(rng, 3) {
        0 => {
            let p = between(rng, 0.3, 0.9);
            let burst_s = [0.0, 2.0][choice(rng, 2)];
            let loss = |(from, to)| {
                Fault::Drop(Loss {
                    from,
                    to,
                    p,
                    burst_s,
                })
            };
            directions.map(loss).into()
        }
        1 => {
            let delay_s = between(rng, 0.1, 2.0);
            let jitter_s = between(rng, 0.0, 1.0);
            let delay = |(from, to)| {
                Fault::Delay(Delay {
                    from,
                    to,
                    delay_s,
                    jitter_s,
                })
            };
            directions.map(delay).into()
        }
        _ => vec![
            Fault::Mute(robot.name.clone()),
            Fault::Deaf(robot.name.clone()),
        ],
    }
}

fn sensor(rng: &mut ChaCha8Rng, robot: &Robot, mission: Mission) -> Vec<Fault> {
    vec![random_sensor_fault(rng, robot, mission)]
}

fn actuator(rng: &mut ChaCha8Rng, robot: &Robot, mission: Mission) -> Vec<Fault> {
    vec![random_actuator_fault(rng, robot, mission)]
}

/// Draws a fault of any device that the robot has, in any possible mode.
#[must_use]
pub fn random_sensor_fault(rng: &mut ChaCha8Rng, robot: &Robot, mission: Mission) -> Fault {
    let side_sensor = robot.has_device(Robot::SIDE_BORDER);
    let has = |device: &&str| *device != Device::SIDE_BORDER || side_sensor;
    let devices: Vec<&str> = Device::names_for(mission).filter(has).collect();
    let device = Device::new(devices[choice(rng, devices.len())]);
    let turns = device == *Device::POSITION;
    let ways = if device.measures_lengths(mission) {
        5
    } else {
        3
    };
    let mode = match choice(rng, ways) {
        0 => SensorMode::Dead,
        1 => SensorMode::Stuck,
        2 => SensorMode::Dropout(between(rng, 0.2, 0.9)),
        3 => SensorMode::Noise(SensorError {
            m: between(rng, 0.05, 0.5) as f32,
            deg: if turns {
                between(rng, 1.0, 20.0) as f32
            } else {
                0.0
            },
        }),
        _ => SensorMode::Bias(SensorError {
            m: either_sign(rng, 0.05, 0.5),
            deg: if turns {
                either_sign(rng, 1.0, 20.0)
            } else {
                0.0
            },
        }),
    };
    Fault::Sensor(SensorFault {
        robot: robot.name.clone(),
        device,
        mode,
    })
}

/// Draws a fault of any motor or the gripper, in any possible mode.
#[must_use]
pub fn random_actuator_fault(rng: &mut ChaCha8Rng, robot: &Robot, mission: Mission) -> Fault {
    let mut drawn = choice(rng, 5);
    if drawn == 4 && !mission.has_gripper() {
        // Another draw keeps those of the other modes.
        drawn = choice(rng, 4);
    }
    let mode = match drawn {
        0 => ActuatorMode::Dead,
        1 => ActuatorMode::Slowed(between(rng, 0.1, 0.8) as f32),
        2 => ActuatorMode::TurnBias(either_sign(rng, 5.0, 30.0)),
        3 => ActuatorMode::OneWheel([Side::Left, Side::Right][choice(rng, 2)]),
        _ => ActuatorMode::Gripper,
    };
    Fault::Actuator(ActuatorFault {
        robot: robot.name.clone(),
        mode,
    })
}

/// Draws an integer in `0..count`.
fn choice(rng: &mut ChaCha8Rng, count: usize) -> usize {
    (uniform(rng) * count as f64) as usize
}

/// Draws a number with two decimals, for readable orders.
fn between(rng: &mut ChaCha8Rng, from: f64, to: f64) -> f64 {
    let value = from + (to - from) * uniform(rng);
    (value * 100.0).round() / 100.0
}

fn either_sign(rng: &mut ChaCha8Rng, from: f64, to: f64) -> f32 {
    let sign = [1.0, -1.0][choice(rng, 2)];
    (sign * between(rng, from, to)) as f32
}

#[cfg(test)]
mod tests {
    use scenario::testkit::default_scenario;
    use std::collections::BTreeSet;

    use scenario::Catalog;
    use scenario::fault::FaultMix;

    use super::*;

    fn long(change: impl FnOnce(&mut Scenario)) -> Scenario {
        let mut scenario = Scenario {
            limit_s: 1e6,
            ..default_scenario()
        };
        change(&mut scenario);
        scenario
    }

    /// Returns the time and duration of each failure of a robot. Related faults count once.
    fn failures(orders: &[Order], robot: &str) -> Vec<(u64, u64)> {
        let matching = orders.iter().filter(|order| match &order.fault {
            Fault::Drop(Loss { from, to, .. }) | Fault::Delay(Delay { from, to, .. }) => {
                [from, to].iter().any(|who| who.as_str() == robot)
            }
            fault => fault.robot() == Some(robot),
        });
        let times = matching.map(|order| (order.at().unwrap().0, order.duration().unwrap().0));
        let mut times: Vec<_> = times.collect();
        times.dedup();
        times
    }

    #[test]
    fn every_order_is_valid() {
        let scenario = long(|_| {});
        let orders = expand(&RandomFaults::default(), &scenario, 1);
        for (index, order) in orders.iter().enumerate() {
            assert_eq!(order.id, Some(format!("random-{}", index + 1)));
            order.check(&scenario, &Catalog::new(&scenario)).unwrap();
            assert!(order.at_s.unwrap() < scenario.limit_s);
        }
        assert!(orders.is_sorted_by_key(Order::at));
    }

    #[test]
    fn times_between_failures_and_repair_times_have_their_means() {
        let scenario = long(|_| {});
        let orders = expand(&RandomFaults::default(), &scenario, 1);
        for robot in ["blue", "gold", "green"] {
            let failures = failures(&orders, robot);
            let count = failures.len() as f64;
            assert!((count - 1e6 / 150.0).abs() < 250.0, "{count}");
            let repair_s = failures.iter().map(|(_, out)| *out as f64).sum::<f64>() / 1000.0;
            assert!((repair_s / count - 30.0).abs() < 1.5, "{repair_s}");
            // Failures do not overlap.
            assert!(
                failures
                    .windows(2)
                    .all(|two| two[0].0 + two[0].1 <= two[1].0)
            );
        }
    }

    #[test]
    fn the_mix_sets_the_frequency_of_each_kind() {
        let orders = expand(&RandomFaults::default(), &long(|_| {}), 1);
        let count = |name: &str| {
            orders
                .iter()
                .filter(|order| order.fault.name() == name)
                .count()
        };
        let near = |name, wanted: f64| {
            let got = count(name) as f64;
            assert!((got / wanted - 1.0).abs() < 0.1, "{name}: {got}");
        };
        // 20,000 failures with a total weight of 9.
        near("kill", 20_000.0 / 9.0);
        near("pause", 20_000.0 / 9.0);
        near("sensor", 40_000.0 / 9.0);
        near("actuator", 40_000.0 / 9.0);
        near("power", 10_000.0 / 9.0);
        near("babble", 10_000.0 / 9.0);
        // Each of the three link kinds has a third; two of them have two directions.
        near("drop", 80_000.0 / 27.0);
        near("delay", 80_000.0 / 27.0);
        assert_eq!(count("mute"), count("deaf"));
        near("deaf", 40_000.0 / 27.0);
    }

    #[test]
    fn all_devices_and_modes_occur_except_missing_devices() {
        let orders = expand(&RandomFaults::default(), &long(|_| {}), 1);
        let mut seen = BTreeSet::new();
        let mode = |fault: &Fault, word: usize| {
            let text = fault.to_string();
            text.split(' ').nth(word).unwrap().to_owned()
        };
        for order in &orders {
            match &order.fault {
                Fault::Sensor(fault) => {
                    assert!(fault.device != *Device::SIDE_BORDER || fault.robot == "blue");
                    seen.insert((fault.device.to_string(), mode(&order.fault, 3)));
                }
                Fault::Actuator(_) => {
                    seen.insert(("actuator".to_owned(), mode(&order.fault, 2)));
                }
                _ => {}
            }
        }
        // Five devices with lengths have five modes, three others three; actuators have five modes.
        assert_eq!(seen.len(), 5 * 5 + 3 * 3 + 5);
    }

    #[test]
    fn neither_teammates_nor_the_mix_change_when_a_robot_fails() {
        let campaign = RandomFaults::default();
        let all = expand(&campaign, &long(|_| {}), 1);
        let alone = long(|scenario| scenario.robots.truncate(1));
        assert_eq!(
            failures(&expand(&campaign, &alone, 1), "blue"),
            failures(&all, "blue")
        );
        let kills = RandomFaults {
            mix: FaultMix {
                kill: 5.0,
                ..FaultMix::default()
            },
            ..campaign
        };
        let more_kills = expand(&kills, &long(|_| {}), 1);
        assert_ne!(more_kills, all);
        assert_eq!(failures(&more_kills, "gold"), failures(&all, "gold"));
        assert_ne!(failures(&all, "blue"), failures(&all, "gold"));
        let other_seed = expand(&campaign, &long(|_| {}), 2);
        assert_ne!(failures(&other_seed, "blue"), failures(&all, "blue"));
    }

    #[test]
    fn a_single_kind_is_possible_and_absent_robots_have_no_faults() {
        let only = RandomFaults {
            mix: FaultMix {
                kill: 0.0,
                pause: 0.0,
                link: 0.0,
                sensor: 0.0,
                actuator: 0.0,
                power: 0.0,
                babble: 1.0,
            },
            ..RandomFaults::default()
        };
        let scenario = long(|scenario| scenario.robots[1].absent = true);
        let orders = expand(&only, &scenario, 1);
        assert!(orders.iter().all(|order| order.fault.name() == "babble"));
        assert!(failures(&orders, "gold").is_empty());
        assert!(!failures(&orders, "green").is_empty());
    }
}
