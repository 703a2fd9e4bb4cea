//! A run whose bodies move in another world repeats from its log, without that world.

#![allow(clippy::unwrap_used)] // Clippy exempts test functions only, not their helpers.

use in_process::{Team, joins_of};
use missions::Registry;
use proto::readings::{Hit, Proximity};
use run_log::{BodyInput, Input, InputLine, LogLevel, MemoryLog, PoseRow, RunLog, ScanInput};
use scenario::{Scenario, Setup};

/// The number of ticks in which the body of the first robot moves elsewhere.
const TICKS: u64 = 60;

const SCENARIO: &str = r#"
robots = [{ name = "blue" }, { name = "gold" }]
limit_s = 4
[faults]
timeline = [
    { fault.move-robot = { robot = "blue", x_m = 9.0, y_m = 7.0 }, at_s = 1.0 },
    { fault.kill = "gold", at_s = 1.5, for_s = 0.5 },
]
"#;

fn setup() -> Setup {
    let vocabulary = Registry::built_in().vocabulary();
    let scenario = Scenario::parse("s.toml", SCENARIO, &vocabulary).unwrap();
    Setup::resolve(scenario, 1, None).unwrap().setup
}

/// Returns a pose on a circle, which no robot can drive in its time.
fn body(tick: u64) -> BodyInput {
    let angle = tick as f32 * 0.1;
    BodyInput {
        robot: "blue".to_owned(),
        x_m: 6.0 + 2.0 * angle.cos(),
        y_m: 4.5 + 2.0 * angle.sin(),
        heading_rad: 0.5,
        stamp_ns: 1_700_000_000_000_000_000 + tick as i64,
        late: tick % 7 == 6,
        scan: None,
    }
}

/// Returns a scan with an object close ahead.
fn scan(tick: u64) -> ScanInput {
    let hit = Hit {
        distance_m: 0.01,
        normal_rad: 3.0,
    };
    ScanInput {
        stamp_ns: 1_700_000_000_000_000_000 + tick as i64,
        late: tick % 2 == 1,
        beams: Proximity {
            ahead: [None, Some(hit), Some(hit)],
            ..Proximity::default()
        },
    }
}

fn inputs() -> Vec<InputLine> {
    let setup = setup();
    let bodies = (0..TICKS).map(|tick| InputLine {
        tick,
        input: Input::Body(body(tick)),
    });
    joins_of(&setup).into_iter().chain(bodies).collect()
}

/// Runs a team with these inputs. Returns the hash and the log.
fn run(inputs: Vec<InputLine>, level: LogLevel, threads: usize) -> (String, MemoryLog) {
    let mut team = Team::with_inputs(setup(), inputs, level, MemoryLog::default()).unwrap();
    team.use_threads(threads).unwrap();
    let (_, recorder) = team.run().unwrap();
    (recorder.hash(), recorder.into_sink())
}

#[test]
fn the_log_of_external_bodies_repeats_the_run() {
    let vocabulary = Registry::built_in().vocabulary();
    for level in [LogLevel::Full, LogLevel::Compact] {
        let first = run(inputs(), level, 1);
        let log = RunLog::from_memory(&first.1, &vocabulary).unwrap();
        assert!(log.run.unscripted);
        assert!(run(log.inputs().unwrap(), level, 1) == first, "{level:?}");
        assert!(run(log.inputs().unwrap(), level, 2) == first, "{level:?}");

        let poses: Vec<PoseRow> = log.rows().unwrap();
        let blue: Vec<&PoseRow> = poses.iter().filter(|row| row.robot == "blue").collect();
        for (tick, row) in blue.iter().enumerate().take(TICKS as usize) {
            let body = body(tick as u64);
            let found = (row.x_m, row.y_m, row.heading_rad);
            assert_eq!(found, (body.x_m, body.y_m, body.heading_rad), "{tick}");
        }
        // 2 m · 0.1 rad per step of 50 ms.
        assert!((blue[10].speed_m_s - 4.0).abs() < 0.01);
        let moves = &log.run.faults[0];
        let failed = moves.failed.as_deref();
        assert_eq!(failed, Some("the body of the robot moves in another world"));
    }
}

#[test]
fn impossible_poses_of_a_log_have_no_effect() {
    let wrong = |change: fn(&mut BodyInput)| {
        let mut inputs = joins_of(&setup());
        let mut body = body(3);
        change(&mut body);
        inputs.push(InputLine {
            tick: 3,
            input: Input::Body(body),
        });
        run(inputs, LogLevel::Full, 1)
    };
    let expected = run(joins_of(&setup()), LogLevel::Full, 1);
    assert!(wrong(|body| body.x_m = f32::NAN) == expected);
    assert!(wrong(|body| body.y_m = 99.0) == expected);
    assert!(wrong(|body| body.robot = "red".to_owned()) == expected);
    assert!(wrong(|_| {}) != expected);
}

#[test]
fn a_scan_is_an_input_that_decides_and_repeats() {
    let vocabulary = Registry::built_in().vocabulary();
    // In the second half of the time, the body stands where nothing is near.
    let scanned = |has_scan: bool| {
        let mut inputs = inputs();
        for line in &mut inputs {
            if let Input::Body(body) = &mut line.input {
                (body.x_m, body.y_m) = (6.0, 4.5);
                body.scan = (has_scan && line.tick >= TICKS / 2).then(|| scan(line.tick));
            }
        }
        inputs
    };
    for level in [LogLevel::Full, LogLevel::Compact] {
        let first = run(scanned(true), level, 1);
        let log = RunLog::from_memory(&first.1, &vocabulary).unwrap();
        let repeated = log.inputs().unwrap();
        let scans = repeated.iter().filter(
            |line| matches!(&line.input, Input::Body(BodyInput { scan: Some(found), .. }) if *found == scan(line.tick)),
        );
        assert_eq!(scans.count() as u64, TICKS / 2);
        assert!(run(repeated, level, 2) == first, "{level:?}");
        assert_ne!(run(scanned(false), level, 1).0, first.0);
    }
}
