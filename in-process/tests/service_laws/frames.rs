//! Frames of coordinates: rooms with an origin, and rooms of 100 km.

use missions::service::data::ServiceSection;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::Scenario;

use crate::{CLASSES, Run, laws, parse, run};

/// The number of instances of each class.
const INSTANCES: u64 = 8;

/// Returns a scenario of service with all of its places moved.
fn translated(mut scenario: Scenario, [x_m, y_m]: [f32; 2]) -> Scenario {
    scenario.room.x_m += x_m;
    scenario.room.y_m += y_m;
    for start in scenario
        .robots
        .iter_mut()
        .filter_map(|robot| robot.start.as_mut())
    {
        start.x_m += x_m;
        start.y_m += y_m;
    }
    for obstacle in &mut scenario.obstacles {
        obstacle.x_m += x_m;
        obstacle.y_m += y_m;
    }
    let section = scenario.mission.values_mut::<ServiceSection>();
    let section = section.expect("a scenario of service");
    for point in &mut section.points {
        point.x_m += x_m;
        point.y_m += y_m;
        point.deliver_to = point.deliver_to.map(|[x, y]| [x + x_m, y + y_m]);
    }
    for charger in &mut section.chargers {
        charger.x_m += x_m;
        charger.y_m += y_m;
    }
    scenario
}

/// Returns the events without their details, which contain places.
fn events(run: &Run) -> Vec<[String; 5]> {
    let rows = run.events.iter();
    rows.map(|row| {
        let time = row.t_ms.to_string();
        let texts = [&row.kind, &row.robot, &row.subject, &row.reason].map(ToString::to_string);
        let [kind, robot, subject, reason] = texts;
        [time, kind, robot, subject, reason]
    })
    .collect()
}

/// From 8 to 16 m and from -16 to -8 m, numbers of single precision have the same distances. All positions are then rounded
/// alike, so that all events are the same.
#[test]
fn a_translated_scenario_has_the_same_events() {
    for (name, instance) in CLASSES {
        for number in 0..INSTANCES {
            let mut chance = ChaCha8Rng::seed_from_u64(number);
            let scenario = parse(&instance(number, &mut chance));
            let [here, there] = [[8.0, 8.0], [-16.0, -16.0]].map(|by| {
                let moved = run(translated(scenario.clone(), by), number);
                laws::check(&moved);
                laws::check_energy(&moved);
                moved
            });
            let [here, there] = [events(&here), events(&there)];
            let first = here.iter().zip(&there).find(|(here, there)| here != there);
            assert_eq!(first, None, "{name} {number}");
            assert_eq!(here.len(), there.len(), "{name} {number}");
        }
    }
}

/// A room of 100 km around (0, 0), with windows, a delivery and a wall beside all ways, in steps of 10 m.
const HUGE: &str = "
limit_s = 30000
step_ms = 500
room = { x_m = -50000, y_m = -50000, width_m = 100000, height_m = 100000 }
body = { speed_m_s = 20, push_m_s = 20, turn_deg_s = 360 }
obstacles = [{ x_m = 20000, y_m = -30000, width_m = 5, height_m = 40000 }]
robots = [
    { name = 'r1', start = { x_m = -5000, y_m = 0 } },
    { name = 'r2', start = { x_m = 40000, y_m = 40000 } },
    { name = 'r3', start = { x_m = -49000, y_m = 0 } },
]
[service]
costs = 'path'
reach_m = 20
kinds = [{ name = 'a', work_s = { min = 20, max = 40 } }]
points = [
    { kind = 'a', x_m = -49000, y_m = 49000, opens_s = 9000, deadline_s = 20000, value = 5 },
    { kind = 'a', x_m = 49000, y_m = 49000 },
    { kind = 'a', x_m = -49000, y_m = -49000, deliver_to = [-45000, 0] },
    { kind = 'a', x_m = -20000, y_m = 0 },
]
";

#[test]
fn all_is_done_in_a_room_of_100_km() {
    let of_seed = |seed| run(parse(HUGE), seed);
    let first = of_seed(1);
    laws::check(&first);
    let done = first.log.run.result.mission.get("done").count();
    assert_eq!(done, 4, "{:#?}", events(&first));
    assert_eq!(first.log.run.hash, of_seed(1).log.run.hash);
}
