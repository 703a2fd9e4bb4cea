//! L-ALLIANCE in whole missions: by processes and in one, replayed, and under each fault of ALLOCATORS.md §2. What the default mission
//! comes to is pinned.

use std::path::PathBuf;

use alliance_proto::log::{EventRow, LogLevel, Memory, MotivationRow, RunLog};
use alliance_proto::mission::Value;
use alliance_proto::scenario::Setup;
use alliance_proto::tick::Outcome;
use missions::Registry;
use serde_json::json;
use study::in_process::Team;

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
        let words = log.each_row::<alliance_proto::log::MessageRow>();
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
