//! Motion and observation of targets, with robots under direct command.

use proptest::prelude::*;
use proto::mission::Bytes;
use proto::readings::Actuation;
use scenario::Setup;
use scenario::ids::RobotId;
use scenario::time::SimTime;
use world_server::mission::{FigureValue, TeamFigures};
use world_server::world::World;

use super::targets::Targets;
use super::*;
use crate::fixtures::{parse, resolve};
use crate::observe::bus::MAX_SENSED_TARGETS;

fn setup(lines: &str, seed: u64) -> Setup {
    Setup {
        seed,
        ..resolve(parse(&format!("[observe]\n{lines}\n")))
    }
}

/// Runs the targets for `steps` steps and returns their positions.
fn play(setup: &Setup, steps: u64) -> Vec<Vec<Vec2>> {
    let mut targets = Targets::new(setup);
    let places = |targets: &Targets| {
        (0..targets.len())
            .map(|number| targets.at(number))
            .collect()
    };
    let mut track = vec![places(&targets)];
    for step in 0..steps {
        targets.step(SimTime(step * setup.scenario.step_ms));
        targets.holds().unwrap();
        track.push(places(&targets));
    }
    track
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// For any step length and turn rate, targets stay in the region and below their top speed.
    #[test]
    fn targets_stay_in_their_region_and_keep_their_speed(
        seed: u64,
        step_ms in 1..500_u64,
        region in prop::sample::select(vec!["disc", "room"]),
        turn_hz in 0.0..3.0_f64,
        fastest in 0.1..5.0_f64,
    ) {
        let lines = format!("n = 20\nregion = '{region}'\nturn_hz = {turn_hz}\nfastest_m_s = {fastest}\nslowest_m_s = 0.05\n");
        let mut setup = setup(&lines, seed);
        setup.scenario.step_ms = step_ms;
        let area = Area::from_scenario(&setup.scenario).inset(-0.001);
        let track = play(&setup, 300);
        let most_m = fastest as f32 * step_ms as f32 / 1000.0;
        for pair in track.windows(2) {
            for (before, after) in pair[0].iter().zip(&pair[1]) {
                prop_assert!(area.contains(*after));
                prop_assert!(before.distance(*after) <= most_m + 1e-4);
            }
        }
    }
}

/// With 1 turn in 2 s, 50 targets turn about 5,000 times in 200 s.
#[test]
fn targets_turn_at_their_rate() {
    let setup = setup(
        "n = 50\nturn_hz = 0.5\nslowest_m_s = 0.01\nfastest_m_s = 0.01",
        3,
    );
    let track = play(&setup, 4000);
    let turned = |three: &[Vec<Vec2>]| -> usize {
        let [before, at, after] = [0, 1, 2].map(|step| three[step].iter());
        let ways = before.zip(at).zip(after);
        let turns = ways.map(|((a, b), c)| (*b - *a).angle_to(*c - *b));
        turns.filter(|turn| turn.abs() > 0.02).count()
    };
    let turns: usize = track.windows(3).map(turned).sum();
    assert!((4400..5200).contains(&turns), "{turns} turns");
}

/// Each target has a stream: more targets do not change the others.
#[test]
fn each_target_has_its_own_stream() {
    let [few, many] = ["n = 3", "n = 30"].map(|lines| play(&setup(lines, 7), 400));
    for (few, many) in few.iter().zip(&many) {
        assert_eq!(few[..], many[..3]);
    }
    let other = play(&setup("n = 3", 8), 400);
    assert_ne!(few[0], other[0]);
}

/// A brute-force search gives the same nearest targets, in the same order.
#[test]
fn the_nearest_in_range_are_found() {
    let setup = setup("n = 300", 5);
    let mut targets = Targets::new(&setup);
    for step in 0..60 {
        targets.step(SimTime(50 * step));
        for place in [
            Vec2::new(6.0, 4.5),
            Vec2::new(2.0, 4.0),
            Vec2::new(11.0, 8.0),
        ] {
            let mut all: Vec<(f32, usize)> = (0..300)
                .map(|number| (targets.at(number).distance_squared(place), number))
                .filter(|(squared, _)| *squared <= 2.6 * 2.6)
                .collect();
            all.sort_by(|a, b| a.partial_cmp(b).unwrap());
            let mut in_range: Vec<usize> = targets.in_range(place).map(|entry| entry.0).collect();
            in_range.sort_unstable();
            let mut expected: Vec<usize> = all.iter().map(|entry| entry.1).collect();
            let nearest = &all[..all.len().min(MAX_SENSED_TARGETS)];
            assert_eq!(targets.nearest(place).as_slice(), nearest);
            expected.sort_unstable();
            assert_eq!(in_range, expected);
        }
    }
}

fn looks() -> Option<Actuation> {
    Some(Actuation {
        action: Action::new(&Look),
        ..Actuation::default()
    })
}

/// Creates a world with two robots at one place and targets that do not move.
fn still(robots: [&str; 2]) -> World {
    let robots = robots.map(|more| format!("[[robots]]\nname = 'r{}'\n{more}\n", more.len()));
    let text = format!(
        "step_ms = 500\n[observe]\nn = 40\nslowest_m_s = 0\nfastest_m_s = 0\nduration_s = 10\n[room]\nwidth_m = 4\nheight_m = 4\n{}",
        robots.concat()
    );
    World::new(&resolve(parse(&text)), crate::observe::MISSION.world)
}

fn row(world: &World) -> Vec<FigureValue> {
    let mut row = Vec::new();
    world.mission().row(&mut row);
    row
}

/// In a room of 4 m a robot sees a part of the targets. Only a robot that looks counts, and a target without an
/// observer is lost.
#[test]
fn only_a_robot_that_looks_observes() {
    let mut world = still(["", "absent = true"]);
    let (mut found, mut lost) = (0, 0);
    let dead_device = Some(Actuation::default());
    for (command, are_found, are_lost) in [
        (dead_device, false, false),
        (looks(), true, false),
        (looks(), true, false),
        (None, true, true),
    ] {
        let events = world.step(&[command, None]);
        world.mission().check_invariants(&world).unwrap();
        let kinds: Vec<String> = events.iter().map(|event| event.kind.to_string()).collect();
        found += kinds.iter().filter(|kind| *kind == "found").count() as u64;
        lost += kinds.iter().filter(|kind| *kind == "lost").count() as u64;
        assert_eq!((found > 0, lost > 0), (are_found, are_lost));
        assert_eq!(row(&world), [FigureValue::Count(found - lost); 2]);
    }
    assert_eq!((lost, found <= 40), (found, true));
    // The sensor reports the same targets, up to its capacity.
    let readings = world.readings(RobotId(0));
    let sensed = readings.mission.value::<SensorReading>();
    let count = sensed.targets.as_ref().unwrap().len();
    assert_eq!(count, (found as usize).min(MAX_SENSED_TARGETS));
}

/// By hand: a robot looks in the first 5 of 20 steps. Its targets are observed for a quarter of the time, and then
/// unobserved for 7.5 s.
#[test]
fn figures_match_their_definitions() {
    let mut world = still(["", "absent = true"]);
    let mut found = 0.0;
    for step in 0..20 {
        assert_eq!(world.mission().end(world.now()), None);
        world.step(&[(step < 5).then(looks).flatten(), None]);
        if step == 0 {
            found = row(&world)[0].number().unwrap();
        }
    }
    assert_eq!(world.mission().end(world.now()), Some(Outcome::Complete));
    let mut figures = TeamFigures::new(2);
    world.mission().figures(&mut figures);
    let figure = |name: &str| figures.mission.get(name).number().unwrap();
    assert!((figure("a") - found / 40.0 / 4.0).abs() < 1e-12);
    // All observed targets are observed equally long.
    assert!((figure("h") - found.ln() / 40_f64.ln()).abs() < 1e-9);
    assert_eq!(
        figure("unseen.max_ms"),
        if found < 40.0 { 10_000.0 } else { 7_500.0 }
    );
    assert!(
        (figure("blind_share") - 0.75).abs() < 1e-12,
        "absent robots do not count"
    );
}

/// The reading has at most 160 bytes, for any target numbers.
#[test]
fn a_full_reading_fits_its_size() {
    let seen = SensedTarget {
        target: u32::MAX,
        offset: Vec2::splat(-2.345_678),
    };
    let sensed = SensorReading {
        targets: Some([seen; MAX_SENSED_TARGETS].into()),
    };
    assert!(Bytes::<{ proto::mission::MAX_READING_BYTES }>::encode(&sensed).is_ok());
}
