//! L-ALLIANCE in whole missions: by processes and in one process, replayed, and under the faults of
//! docs/ALLOCATORS.md, "Under the same faults".

use alliance_tests::testkit::{KILL, PARTITION, RESTART, loss};
use in_process::Team;
use missions::Registry;
use proto::tick::Outcome;
use run_log::{EventRow, LogLevel, MemoryLog, MessageRow, MotivationRow, RunLog};
use scenario::mission::FigureValue;
use scenario::{Profile, Scenario, Setup};

use crate::allocators::scenario;
use crate::harness::Lab;

const L_ALLIANCE: &str = "l-alliance";

const BABBLE: &str =
    "[[faults.timeline]]\nwhen = \"gold activates move-spill(top)\"\nfault.babble = \"gold\"\n";

fn run(rest: &str, seed: u64) -> (Outcome, RunLog) {
    let setup = Setup::resolve(scenario(L_ALLIANCE, rest), seed, None)
        .unwrap()
        .setup;
    let team = Team::new(setup, LogLevel::Full, MemoryLog::default()).unwrap();
    let (outcome, recorder) = team.run().unwrap();
    let known = Registry::built_in().vocabulary();
    let log = RunLog::from_memory(&recorder.into_sink(), &known).unwrap();
    (outcome, log)
}

/// Compares the default mission without a fault and with a real SIGKILL.
#[test]
fn processes_and_one_process_write_the_same_bytes_and_replay_them() {
    let lab = Lab::new();
    std::fs::write(lab.path("kill.toml"), KILL).unwrap();
    for (name, arguments) in [("whole", &[][..]), ("killed", &["kill.toml"][..])] {
        let arguments = [arguments, &["--allocator", L_ALLIANCE]].concat();
        let (many, one) = (format!("{name}-many"), format!("{name}-one"));
        lab.mission(&many, &arguments).expect(0);
        lab.run(&[&["run", "--in-process", "--out", &one], &arguments[..]].concat())
            .expect(0);
        for file in [
            "motivations.csv",
            "events.csv",
            "poses.csv",
            "messages.csv",
            "ticks.csv",
        ] {
            let read = |run: &str| std::fs::read(lab.path(run).join(file)).unwrap();
            assert!(read(&many) == read(&one), "{name}: {file}");
        }
        lab.run(&["replay", &many]).expect(0);
        let log = lab.log(&many);
        assert!(log.rows::<MotivationRow>().unwrap().len() > 1000);
        // The allocator sends only heartbeats, in addition to the mission's messages.
        let messages = log.each_row::<MessageRow>();
        assert!(
            messages
                .map(|row| row.unwrap())
                .all(|row| row.kind != "allocation")
        );
    }
}

/// Each fault leaves the mission complete and all invariants valid, including an identical replay.
#[test]
fn missions_complete_under_every_fault() {
    let lab = Lab::new();
    let cases = [
        ("none", String::new()),
        ("kill", KILL.to_owned()),
        ("loss-30", loss(0.3)),
        ("loss-60", loss(0.6)),
        ("partition", PARTITION.to_owned()),
        ("restart", RESTART.to_owned()),
        ("babble", BABBLE.to_owned()),
    ];
    for (name, faults) in cases {
        let file = format!("{name}.toml");
        std::fs::write(lab.path(&file), format!("limit_s = 3600.0\n{faults}")).unwrap();
        let options = ["--in-process", "--check", "--allocator", L_ALLIANCE];
        lab.run(&[&["run", &file, "--out", name], &options[..]].concat())
            .expect(0);
    }
}

/// Missions complete with each strategy and ordering that uses learned times, and after active learning.
#[test]
fn every_strategy_and_ordering_completes_the_mission() {
    for values in [
        "strategy = \"I\"",
        "strategy = \"III\"",
        "strategy = \"III\"\nordering = \"shortest-first\"",
        "strategy = \"III\"\nordering = \"random\"",
        "learning_trials = 3",
    ] {
        let (outcome, log) = run(&format!("[allocators.l-alliance]\n{values}\n"), 1);
        assert_eq!(outcome, Outcome::Complete, "{values}");
        let delivered = log.run.result.mission.get("items.delivered");
        assert_eq!(delivered, FigureValue::Count(24), "{values}");
    }
}

/// Law G5: a robot with all skills completes the mission alone.
#[test]
fn one_robot_alone_completes_the_mission() {
    let (outcome, _) = run("robots = [{ name = \"blue\" }]\n", 1);
    assert_eq!(outcome, Outcome::Complete);
}

/// Returns the log of robots `blue` and `gold` with one kind of work, of which each point takes `work_s`.
///
/// The profile states `blue_s` and `gold_s` as their learned times. With the longest time first, gold begins after
/// the shortest delay of 2 s. Blue's delay is the longest, 8 s. At θ a robot activates at once, regardless of other
/// claims.
fn two(
    step_ms: u64,
    (work_s, points): (f64, u16),
    (blue_s, gold_s): (f64, f64),
    faults: &str,
) -> RunLog {
    let text = format!(
        "step_ms = {step_ms}\nlimit_s = 300\nallocator = 'l-alliance'\n{faults}\
         [alliance.switches]\nwaiting = false\narbitration = false\n\
         [allocators.l-alliance]\nstrategy = 'III'\n[service]\ntasks = 'kinds'\nreach_m = 1000\n\
         [[service.kinds]]\nname = 'work'\nwork_s = {{ min = {work_s}, max = {work_s} }}\n\
         [[service.random]]\nn = {points}\n\
         [[robots]]\nname = 'blue'\nskills = {{ work = 1 }}\n[[robots]]\nname = 'gold'\nskills = {{ work = 1 }}\n"
    );
    let known = Registry::built_in().vocabulary();
    let scenario = Scenario::parse("two.toml", &text, &known).unwrap();
    let profile: String = ["blue", "gold"]
        .iter()
        .map(|robot| {
            let time = |time_s: f64| format!("{{ trials = 1, latest_s = [{time_s}] }}");
            let (blue, gold) = (time(blue_s), time(gold_s));
            format!("[{robot}.'serve(work)']\nblue = {blue}\ngold = {gold}\n")
        })
        .collect();
    let setup = Setup {
        profile: Profile::parse("p.toml", &profile, &scenario, &known).unwrap(),
        ..Setup::resolve(scenario, 1, None).unwrap().setup
    };
    let team = Team::new(setup, LogLevel::Full, MemoryLog::default()).unwrap();
    let (_, recorder) = team.run().unwrap();
    RunLog::from_memory(&recorder.into_sink(), &known).unwrap()
}

/// Returns the time of a robot's first activation, in ms.
fn activated(log: &RunLog, robot: &str) -> Option<u64> {
    let mut rows = log.each_row::<EventRow>().map(|row| row.unwrap());
    let found = rows.find(|row| row.kind == "activated" && row.robot == robot);
    found.map(|row| row.t_ms.0)
}

/// Returns the times at which blue received gold's first and last heartbeat with the task, in ms.
fn received(log: &RunLog) -> (u64, u64) {
    let rows = log.each_row::<MessageRow>().map(|row| row.unwrap());
    let received = rows.filter(|row| {
        row.receiver == "blue" && row.state == "executing" && row.delivery == "received"
    });
    let times: Vec<u64> = received.map(|row| row.t_ms.0).collect();
    (times[0], times[times.len() - 1])
}

/// Law L1 to the step: a robot that broadcasts without progress is taken over d after its first received heartbeat.
#[test]
fn a_robot_without_progress_is_taken_over_after_its_learned_time() {
    for step_ms in [10, 50, 200] {
        for d_s in [20.0, 61.0] {
            let log = two(step_ms, (1e4, 1), (d_s - 5.0, d_s), "");
            assert_eq!(activated(&log, "gold"), Some(2000), "the shortest delay");
            let (first, _) = received(&log);
            assert_eq!(first, 2000 + step_ms);
            let expected_ms = first + (1000.0 * d_s) as u64;
            assert_eq!(activated(&log, "blue"), Some(expected_ms), "{step_ms} ms");
        }
    }
}

/// A robot that completes a point every d - 2δt keeps its task, though each point counts as a trial.
#[test]
fn a_robot_with_timely_progress_keeps_its_task() {
    for step_ms in [10, 50, 200] {
        let work_s = 20.0 - 2.0 * step_ms as f64 / 1000.0;
        let log = two(step_ms, (work_s, 12), (15.0, 20.0), "");
        assert_eq!(log.run.result.mission.get("done"), FigureValue::Count(12));
        assert_eq!(activated(&log, "blue"), None, "{step_ms} ms");
    }
}

/// The motivation for a crashed robot's task rises slowly until τ after its last message, then at blue's own rate, θ
/// in 8 s.
#[test]
fn a_crashed_robot_is_taken_over_after_tau_at_the_learned_rate() {
    for step_ms in [10, 50, 200] {
        let kill = "[[faults.timeline]]\nat_s = 15.3\nfault.kill = 'gold'\n";
        let log = two(step_ms, (1e4, 1), (55.0, 60.0), kill);
        let (first, last) = received(&log);
        let slow_s = (last - first) as f64 / 1000.0 + 5.0;
        let expected_s = first as f64 / 1000.0 + slow_s + 8.0 * (1.0 - slow_s / 60.0);
        let taken_s = activated(&log, "blue").unwrap() as f64 / 1000.0;
        let step_s = step_ms as f64 / 1000.0;
        assert!(
            (taken_s - expected_s).abs() <= step_s + 1e-9,
            "{taken_s}, not {expected_s} s"
        );
    }
}
