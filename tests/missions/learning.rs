//! L-ALLIANCE in whole missions: by processes and in one, replayed, and under each fault of ALLOCATORS.md §2. What the default mission
//! comes to is pinned.

use std::path::PathBuf;

use alliance_proto::log::{EventRow, LogLevel, Memory, MessageRow, MotivationRow, RunLog};
use alliance_proto::mission::Value;
use alliance_proto::scenario::{Profile, Scenario, Setup};
use alliance_proto::tick::Outcome;
use in_process::Team;
use missions::Registry;
use serde_json::json;

use crate::allocators::scenario;
use crate::harness::Lab;

const L_ALLIANCE: &str = "l-alliance";

const KILL: &str = "[[faults.timeline]]\nat_s = 100.0\nfault.kill = \"gold\"\n";
const RESTART: &str = "[[faults.timeline]]\nat_s = 100.0\nfor_s = 60.0\nfault.kill = \"gold\"\n";
const PARTITION: &str = "[[faults.timeline]]\nat_s = 60.0\nfor_s = 60.0\n\
     fault.partition = { groups = [[\"blue\", \"gold\"], [\"green\"]] }\n";
const BABBLE: &str =
    "[[faults.timeline]]\nwhen = \"gold activates move-spill(top)\"\nfault.babble = \"gold\"\n";

fn loss(share: f64) -> String {
    format!("[[faults.timeline]]\nat_s = 0.0\nfault.drop = {{ p = {share} }}\n")
}

fn run(rest: &str, seed: u64) -> (Outcome, RunLog) {
    let setup = Setup::resolve(scenario(L_ALLIANCE, rest), seed, None)
        .unwrap()
        .setup;
    let team = Team::new(setup, LogLevel::Full, Memory::default()).unwrap();
    let (outcome, recorder) = team.run().unwrap();
    let known = Registry::built_in().vocabulary();
    let log = RunLog::from_memory(&recorder.into_sink(), &known).unwrap();
    (outcome, log)
}

/// When the mission was complete, s.
fn makespan_s(log: &RunLog) -> f64 {
    let last = log.each_row::<EventRow>().map(|row| row.unwrap()).last();
    last.unwrap().t_ms.as_secs_f64()
}

/// The default mission to its end, and with a real SIGKILL in the midst of it.
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
        // It says nothing beside heartbeats and what the mission tells.
        let words = log.each_row::<MessageRow>();
        assert!(
            words
                .map(|row| row.unwrap())
                .all(|row| row.kind != "allocation")
        );
    }
}

/// The default mission of each strategy is as it was. After a change that is meant to change it:
/// `UPDATE_GOLDEN=1 cargo test --workspace --test missions learning`.
#[test]
fn the_default_mission_is_as_it_was() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("golden/learning.json");
    let (outcome, log) = run("", 1);
    assert_eq!(outcome, Outcome::Complete);
    let hash = log.run.hash.as_ref().map(ToString::to_string);
    let pinned = json!({ L_ALLIANCE: { "hash": hash, "complete_s": makespan_s(&log) } });
    let now = format!("{pinned:#}\n");
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(&path, &now).unwrap();
    }
    assert_eq!(now, std::fs::read_to_string(&path).unwrap());
}

/// Under each fault the mission is completed, a babbler included, and the invariants of all runs hold, among them that the replay is
/// identical.
#[test]
fn faults_are_coped_with() {
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

/// With each strategy and ordering that bounds patience by what is known, and after active learning.
#[test]
fn strategies_and_orderings_complete_the_mission() {
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
        assert_eq!(delivered, Value::Count(24), "{values}");
    }
}

/// G5: a robot that can do all completes the mission alone.
#[test]
fn one_robot_alone_completes_the_mission() {
    let (outcome, _) = run("robots = [{ name = \"blue\" }]\n", 1);
    assert_eq!(outcome, Outcome::Complete);
}

/// Robots `blue` and `gold` of one skill each, with a kind of work of which each point takes `work_s`. All know that blue takes `blue_s`
/// for it and gold `gold_s`. Longest first, so gold begins, after the shortest delay of 2 s; blue's is the longest, 8 s. At θ a robot
/// activates at once, whatever others claim.
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
    let team = Team::new(setup, LogLevel::Full, Memory::default()).unwrap();
    let (_, recorder) = team.run().unwrap();
    RunLog::from_memory(&recorder.into_sink(), &known).unwrap()
}

/// When a robot became active for the first time, ms.
fn activated(log: &RunLog, robot: &str) -> Option<u64> {
    let mut rows = log.each_row::<EventRow>().map(|row| row.unwrap());
    let found = rows.find(|row| row.kind == "activated" && row.robot == robot);
    found.map(|row| row.t_ms.0)
}

/// When blue heard gold's first and last word of its work, ms.
fn heard(log: &RunLog) -> (u64, u64) {
    let rows = log.each_row::<MessageRow>().map(|row| row.unwrap());
    let heard = rows
        .filter(|row| row.receiver == "blue" && row.state == "executing" && row.fate == "heard");
    let times: Vec<u64> = heard.map(|row| row.t_ms.0).collect();
    (times[0], times[times.len() - 1])
}

/// L1 in whole runs, to the step: whoever talks and achieves nothing is taken over d after its first word was heard.
#[test]
fn who_achieves_nothing_is_taken_over_after_its_own_time() {
    for step_ms in [10, 50, 200] {
        for d_s in [20.0, 61.0] {
            let log = two(step_ms, (1e4, 1), (d_s - 5.0, d_s), "");
            assert_eq!(activated(&log, "gold"), Some(2000), "the shortest delay");
            let (first, _) = heard(&log);
            assert_eq!(first, 2000 + step_ms);
            let wanted = first + (1000.0 * d_s) as u64;
            assert_eq!(activated(&log, "blue"), Some(wanted), "{step_ms} ms");
        }
    }
}

/// And whoever is done with a point every d - 2δt never is, though each counts as a trial from then on.
#[test]
fn who_achieves_something_in_time_is_not_taken_over() {
    for step_ms in [10, 50, 200] {
        let work_s = 20.0 - 2.0 * step_ms as f64 / 1000.0;
        let log = two(step_ms, (work_s, 12), (15.0, 20.0), "");
        assert_eq!(log.run.result.mission.get("done"), Value::Count(12));
        assert_eq!(activated(&log, "blue"), None, "{step_ms} ms");
    }
}

/// A dead robot's task: slowly until τ after its last word, from then on at blue's own rate, θ in 8 s.
#[test]
fn the_dead_are_taken_over_after_tau_at_the_learned_rate() {
    for step_ms in [10, 50, 200] {
        let kill = "[[faults.timeline]]\nat_s = 15.3\nfault.kill = 'gold'\n";
        let log = two(step_ms, (1e4, 1), (55.0, 60.0), kill);
        let (first, last) = heard(&log);
        let slow_s = (last - first) as f64 / 1000.0 + 5.0;
        let wanted_s = first as f64 / 1000.0 + slow_s + 8.0 * (1.0 - slow_s / 60.0);
        let taken_s = activated(&log, "blue").unwrap() as f64 / 1000.0;
        let step_s = step_ms as f64 / 1000.0;
        assert!(
            (taken_s - wanted_s).abs() <= step_s + 1e-9,
            "{taken_s}, not {wanted_s} s"
        );
    }
}
