//! The radio channel in missions: fading by distance, obstacles on the line, and bit errors.

use std::collections::BTreeMap;

use alliance_tests::harness::Lab;
use alliance_tests::runs::{allocators, parse, play, vocabulary};
use glam::Vec2;
use proto::tick::Outcome;
use run_log::{MessageRow, PoseRow, RunLog};
use scenario::time::SimTime;
use scenario::{Obstacle, Scenario};

use super::{assert_replay_is_identical, at, hit, mission};

/// Returns the messages of a log with the positions of sender and receiver when they were delivered.
fn messages_with_places(log: &RunLog) -> Vec<(MessageRow, Vec2, Vec2)> {
    let poses = log.rows::<PoseRow>().unwrap().into_iter();
    let places: BTreeMap<(SimTime, String), Vec2> = poses
        .map(|row| ((row.t_ms, row.robot), Vec2::new(row.x_m, row.y_m)))
        .collect();
    let rows = log.rows::<MessageRow>().unwrap().into_iter();
    rows.map(|row| {
        let place = |robot: &String| places[&(row.t_ms, robot.clone())];
        let (from, to) = (place(&row.sender), place(&row.receiver));
        (row, from, to)
    })
    .collect()
}

fn counts(log: &RunLog) -> BTreeMap<String, u64> {
    let mut counts = BTreeMap::new();
    for row in log.rows::<MessageRow>().unwrap() {
        *counts.entry(row.delivery).or_default() += 1;
    }
    counts
}

/// The received messages of each link lie within four standard deviations of the sum of exp(−(d/d0)^α), while the
/// robots move. For a normal distribution, one link in 15,000 deviates more.
#[test]
fn fading_follows_the_distance_of_moving_robots() {
    let scenario = "limit_s = 1500.0\n[radio]\nfading = { d0_m = 5.0, path_loss_exponent = 3.0 }\n";
    let (_, log) = play(parse(scenario), 1);
    assert_replay_is_identical(&log);
    let mut links: BTreeMap<(String, String), (f64, f64, f64)> = BTreeMap::new();
    let mut nearest_and_farthest = (f64::MAX, 0.0_f64);
    for (row, from, to) in messages_with_places(&log) {
        let distance_m = f64::from(from.distance(to));
        let (nearest, farthest) = nearest_and_farthest;
        nearest_and_farthest = (nearest.min(distance_m), farthest.max(distance_m));
        let chance = (-(distance_m / 5.0).powi(3)).exp();
        let (received, mean, variance) = links.entry((row.sender, row.receiver)).or_default();
        match row.delivery.as_str() {
            "received" => *received += 1.0,
            delivery => assert_eq!(delivery, "faded"),
        }
        *mean += chance;
        *variance += chance * (1.0 - chance);
    }
    assert_eq!(links.len(), 6);
    let (nearest, farthest) = nearest_and_farthest;
    assert!(nearest < 3.0 && farthest > 7.0, "{nearest} to {farthest} m");
    for (link, (received, mean, variance)) in links {
        let off = (received - mean) / variance.sqrt();
        assert!(
            off.abs() < 4.0,
            "{link:?}: {received} received, {mean} expected"
        );
    }
}

/// An obstacle appears between the robots. Exactly the messages across it are lost.
#[test]
fn walls_block_the_messages_across_them() {
    const EDGE_M: f32 = 0.02;
    let wall = Obstacle {
        x_m: 5.5,
        y_m: 2.0,
        width_m: 0.5,
        height_m: 5.0,
        penetrability: 0.0,
    };
    let scenario = "limit_s = 400.0\n[radio]\nwalls = \"block\"\n[[faults.timeline]]\nid = \"wall\"\n\
         at_s = 50.0\nfor_s = 250.0\n\
         fault.obstacle = { x_m = 5.5, y_m = 2.0, width_m = 0.5, height_m = 5.0 }\n";
    let (_, log) = play(parse(scenario), 1);
    assert_replay_is_identical(&log);
    let is_inside = |point: Vec2, margin_m: f32| {
        let min = Vec2::new(wall.x_m, wall.y_m) - margin_m;
        let max = Vec2::new(wall.x_m + wall.width_m, wall.y_m + wall.height_m) + margin_m;
        point.cmpge(min).all() && point.cmple(max).all()
    };
    let crosses = |from: Vec2, to: Vec2, margin_m: f32| {
        (0..=1000).any(|part| is_inside(from.lerp(to, part as f32 / 1000.0), margin_m))
    };
    let (mut blocked, mut received) = (0, 0);
    for (row, from, to) in messages_with_places(&log) {
        let is_there = (at(50.0)..at(300.0)).contains(&row.t_ms);
        if row.delivery == "blocked" {
            assert!(is_there && crosses(from, to, EDGE_M), "{row:?}");
            blocked += 1;
        } else {
            assert_eq!(row.delivery, "received");
            assert!(!(is_there && crosses(from, to, -EDGE_M)), "{row:?}");
            received += 1;
        }
    }
    assert!(blocked > 50 && received > 50, "{blocked} and {received}");
}

#[test]
fn a_checksum_drops_damaged_messages_and_counts_them() {
    let scenario = "[faults]\ntimeline = [{ id = \"bits\", fault.corrupt = { p = 0.0005 } }]\n";
    let log = mission("bits", scenario, Outcome::Complete);
    let counts = counts(&log);
    assert!(
        counts["corrupted"] > 50 && counts["received"] > 50,
        "{counts:?}"
    );
    assert_eq!(counts.len(), 2, "{counts:?}");
    assert_eq!(hit(&log, "bits").hits, counts["corrupted"]);
    // run.json counts them as lost.
    let robots = log.run.result.robots.values();
    let lost: u64 = robots.map(|robot| robot.messages_lost).sum();
    assert_eq!(lost, counts["corrupted"]);
}

#[test]
fn without_a_checksum_damaged_messages_arrive_on_their_links() {
    let scenario = "limit_s = 1200.0\n[faults]\ntimeline = [\n\
         { id = \"bits\", fault.corrupt = { from = \"green\", to = \"blue\", p = 0.002, checksum = false } },\n\
         { id = \"late\", fault.delay = { delay_s = 0.2 }, at_s = 100.0, for_s = 100.0 },\n]\n";
    let (_, log) = play(parse(scenario), 1);
    assert_replay_is_identical(&log);
    let damaged = ["damaged", "corrupted"];
    let rows = log.rows::<MessageRow>().unwrap();
    let on_link = |row: &&MessageRow| (&*row.sender, &*row.receiver) == ("green", "blue");
    let is_damaged = |row: &&MessageRow| damaged.contains(&&*row.delivery);
    assert!(rows.iter().filter(is_damaged).all(|row| on_link(&row)));
    let late = |row: &MessageRow| row.t_ms.since(row.sent_ms) > at(0.1);
    let arrived: Vec<_> = rows
        .iter()
        .filter(|row| row.delivery == "damaged")
        .collect();
    assert!(arrived.iter().any(|row| late(row)) && arrived.iter().any(|row| !late(row)));
    assert_eq!(
        hit(&log, "bits").hits,
        rows.iter().filter(is_damaged).count() as u64
    );
}

/// Returns a mission of any kind with bit errors on all links, which no checksum detects.
fn with_bit_errors(scenario: &Scenario, allocator: &str, p: f64) -> Scenario {
    let fault = format!("id = \"bits\"\nfault.corrupt = {{ p = {p:?}, checksum = false }}");
    let mut scenario = scenario.clone();
    scenario.allocator = Some(allocator.to_owned());
    scenario.limit_s = 60.0;
    scenario.faults.timeline = vec![toml::from_str(&fault).unwrap()];
    scenario
}

/// No damaged message makes a robot panic, and a replay is identical: with each allocator in each mission, and each share
/// of damaged bits in turn.
#[test]
fn robots_survive_damaged_messages() {
    let mut damaged = 0;
    let mut shares = [0.0003, 0.003, 0.03].into_iter().cycle();
    for data in vocabulary().missions {
        let scenario = data.family(4, 3).unwrap();
        for ((number, allocator), p) in allocators().enumerate().zip(&mut shares) {
            let scenario = with_bit_errors(&scenario, allocator, p);
            let (_, log) = play(scenario, number as u64);
            assert_replay_is_identical(&log);
            damaged += counts(&log).get("damaged").copied().unwrap_or_default();
        }
    }
    assert!(damaged > 3_000, "{damaged}");
}

/// Processes receive the messages over the bus and flip the same bits.
#[test]
fn processes_and_one_process_damage_the_same_bits() {
    for (radio, checksum) in [
        ("fading = { d0_m = 6.0, path_loss_exponent = 2.5 }", true),
        ("walls = \"block\"", false),
    ] {
        let lab = Lab::new();
        let scenario = format!(
            "name = \"bits\"\nallocator = \"cbba\"\nlimit_s = 120.0\n[radio]\n{radio}\n\
             [[obstacles]]\nx_m = 5.0\ny_m = 3.5\nwidth_m = 0.5\nheight_m = 2.0\n\
             [[faults.timeline]]\nfault.corrupt = {{ p = 0.001, checksum = {checksum} }}\n\
             [[faults.timeline]]\nfault.delay = {{ delay_s = 0.1, jitter_s = 0.5, to = \"gold\" }}\n"
        );
        lab.write("s.toml", scenario);
        lab.mission("many", "s.toml");
        lab.run("run --in-process --out one s.toml");
        lab.assert_same_bytes("many", "one");
        lab.assert_repeated("many");
        let counts = counts(&lab.log("many"));
        let has = |delivery: &str| counts.contains_key(delivery);
        assert!(has("corrupted") && has("damaged") != checksum, "{counts:?}");
        assert!(
            has("faded") == checksum && has("blocked") != checksum,
            "{counts:?}"
        );
    }
}
