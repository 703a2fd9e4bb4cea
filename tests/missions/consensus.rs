//! Consensus allocators in whole missions: by processes and in one process, replayed, and under the faults of
//! docs/ALLOCATORS.md, "Under the same faults".

use std::collections::BTreeMap;

use alliance_tests::testkit::{KILL, PARTITION, RESTART, loss};
use analysis::invariants::Invariants;
use in_process::Team;
use missions::Registry;
use missions::waste::data::family;
use proto::tick::Outcome;
use run_log::{AllocationRow, EventRow, LogLevel, MemoryLog, MessageRow, RunLog};
use scenario::fault::{Fault, Order};
use scenario::time::SimTime;
use scenario::{Scenario, Setup};

use crate::harness::Lab;

const ALLOCATORS: [&str; 4] = ["cbaa", "cbba", "acbba", "grape"];

/// Returns the consensus allocators and a heartbeat allocator that also accepts unproven claims.
fn claim_accepting_allocators() -> impl Iterator<Item = &'static str> {
    ALLOCATORS.into_iter().chain(["first-come"])
}

/// The silence after which a robot counts as crashed.
const TAU: SimTime = SimTime(5000);
const STEP: SimTime = SimTime(50);

const BABBLE: &str = "[[faults.timeline]]\nat_s = 100.0\nfault.babble = \"gold\"\n";

fn scenario(allocator: &str, rest: &str) -> Scenario {
    let known = Registry::built_in().vocabulary();
    let text = format!("allocator = \"{allocator}\"\nlimit_s = 3600.0\n{rest}");
    Scenario::parse("s.toml", &text, &known).unwrap()
}

fn run(scenario: Scenario, seed: u64, level: LogLevel) -> (Outcome, RunLog) {
    let setup = Setup::resolve(scenario, seed, None).unwrap().setup;
    let team = Team::new(setup, level, MemoryLog::default()).unwrap();
    let (outcome, recorder) = team.run().unwrap();
    let known = Registry::built_in().vocabulary();
    (
        outcome,
        RunLog::from_memory(&recorder.into_sink(), &known).unwrap(),
    )
}

/// Returns the robot-seconds from `from` on in which several robots had the same exclusive task.
fn duplicate_s(log: &RunLog, from: SimTime) -> f64 {
    let mut at: BTreeMap<SimTime, BTreeMap<String, u32>> = BTreeMap::new();
    for row in log.each_row::<AllocationRow>().map(|row| row.unwrap()) {
        if row.state == "active" && row.t_ms >= from {
            *at.entry(row.t_ms).or_default().entry(row.task).or_default() += 1;
        }
    }
    let surplus = at.values().flat_map(|tasks| tasks.values());
    let surplus: u32 = surplus.map(|count| count - 1).sum();
    f64::from(surplus) * STEP.as_secs_f64()
}

/// Checks each allocator in the default mission and in a mission with a kill and a restart.
#[test]
fn processes_and_one_process_write_the_same_bytes_and_replay_them() {
    let lab = Lab::new();
    // The processes receive a real SIGKILL and a real restart.
    let faults = RESTART.replace("60.0", "10.0");
    std::fs::write(lab.path("s.toml"), format!("limit_s = 130.0\n{faults}")).unwrap();
    for allocator in ALLOCATORS {
        for (name, arguments, code) in [("whole", &[][..], 0), ("killed", &["s.toml"][..], 1)] {
            let arguments = [arguments, &["--allocator", allocator]].concat();
            let (many, one) = (
                format!("{allocator}-{name}-many"),
                format!("{allocator}-{name}-one"),
            );
            lab.mission(&many, &arguments).expect(code);
            lab.run(&[&["run", "--in-process", "--out", &one], &arguments[..]].concat())
                .expect(code);
            for file in [
                "allocation.csv",
                "events.csv",
                "poses.csv",
                "messages.csv",
                "ticks.csv",
            ] {
                let read = |run: &str| std::fs::read(lab.path(run).join(file)).unwrap();
                assert!(read(&many) == read(&one), "{many}: {file}");
            }
            lab.run(&["replay", &many]).expect(0);
        }
    }
}

/// Another robot takes the task of a killed robot τ after its last received message, to the step.
#[test]
fn the_task_of_a_killed_robot_is_taken_over_after_tau() {
    for allocator in ALLOCATORS {
        for seed in 1..=3 {
            let (outcome, log) = run(scenario(allocator, KILL), seed, LogLevel::Full);
            assert_eq!(outcome, Outcome::Complete, "{allocator}, seed {seed}");
            let events = log.rows::<EventRow>().unwrap();
            let killed = SimTime(100_000);
            let mut activations = events.iter().filter(|row| row.kind == "activated");
            let of_gold = |row: &&EventRow| row.robot == "gold" && row.t_ms <= killed;
            let task = &activations.clone().rfind(of_gold).unwrap().subject;
            let next = activations
                .find(|row| row.subject == *task && row.robot != "gold" && row.t_ms > killed)
                .unwrap();
            let messages = log.each_row::<MessageRow>().map(|row| row.unwrap());
            let received = messages.filter(|row| {
                // ACBBA and GRAPE accept any message as a sign of life.
                let counts = !allocator.starts_with('c') || row.kind == "allocation";
                row.sender == "gold" && counts && row.delivery == "received"
            });
            let last_message = received.map(|row| row.sent_ms).max().unwrap();
            let free = last_message + TAU;
            // With GRAPE a busy robot reconsiders at the end of a unit of work.
            let is_in_time = next.t_ms == free || (allocator == "grape" && next.t_ms > free);
            assert!(is_in_time, "{allocator}, seed {seed}: {next:?}, {free:?}");
            assert_eq!(next.reason, "claimed");
        }
    }
}

/// Each fault leaves the mission complete and all invariants valid, including an identical replay.
#[test]
fn missions_complete_under_every_fault() {
    let lab = Lab::new();
    let cases = [
        ("loss-30", loss(0.3)),
        ("loss-60", loss(0.6)),
        ("partition", PARTITION.to_owned()),
        ("restart", RESTART.to_owned()),
    ];
    for (name, faults) in cases {
        let file = format!("{name}.toml");
        std::fs::write(lab.path(&file), faults).unwrap();
        for allocator in ALLOCATORS {
            let out = format!("{allocator}-{name}");
            let options = ["--in-process", "--check", "--allocator", allocator];
            lab.run(&[&["run", &file, "--out", &out], &options[..]].concat())
                .expect(0);
        }
    }
}

/// Both sides of a partition do all tasks. After healing only one robot keeps each task.
#[test]
fn a_healed_partition_has_no_duplicate_tasks() {
    for allocator in claim_accepting_allocators() {
        let (_, log) = run(scenario(allocator, PARTITION), 1, LogLevel::Full);
        let during = duplicate_s(&log, SimTime(60_000)) - duplicate_s(&log, SimTime(120_000));
        assert!(during > 30.0, "{allocator}: {during}");
        // By then every robot has broadcast its table again.
        let after = duplicate_s(&log, SimTime(121_500));
        assert!(after <= 1.0, "{allocator}: {after}");
    }
}

/// A babbling bidder keeps its task while its bid is the best, because no robot checks its progress. With GRAPE the
/// task may change when the bonus ends.
#[test]
fn a_babbling_robot_keeps_its_task() {
    let lab = Lab::new();
    let limited = format!("limit_s = 600.0\n{BABBLE}");
    std::fs::write(lab.path("babble.toml"), limited).unwrap();
    for allocator in claim_accepting_allocators() {
        let options = ["--in-process", "--check", "--allocator", allocator];
        let run = lab
            .run(&[&["run", "babble.toml", "--out", allocator], &options[..]].concat())
            .expect(1);
        assert!(!run.stderr.contains("violated"), "{}", run.stderr);
        let log = lab.log(allocator);
        let rows = log.rows::<EventRow>().unwrap();
        let taken = rows.iter().filter(|row| {
            let (at, task) = (row.t_ms > SimTime(110_000), &row.subject);
            row.kind == "activated" && row.robot != "gold" && at && *task == held(&rows)
        });
        assert!(allocator == "grape" || taken.count() == 0, "{allocator}");
    }
}

/// Returns the task of gold when it begins to babble.
fn held(rows: &[EventRow]) -> String {
    let mut before = rows.iter().take_while(|row| row.t_ms <= SimTime(100_000));
    let of_gold = |row: &&EventRow| row.kind == "activated" && row.robot == "gold";
    before
        .by_ref()
        .filter(of_gold)
        .last()
        .unwrap()
        .subject
        .clone()
}

/// Runs thirty robots with partial skills and limited radio range, with a crash and message loss.
#[test]
fn thirty_robots_complete_their_mission() {
    for allocator in ALLOCATORS {
        let mut scenario = family(30, 20);
        scenario.allocator = Some(allocator.to_owned());
        scenario.faults = self::scenario(allocator, &loss(0.3)).faults;
        scenario.faults.timeline.push(Order {
            at_s: Some(100.0),
            ..Order::now(Fault::Kill("r1".to_owned()))
        });
        let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
        let mut team = Team::new(setup.clone(), LogLevel::Off, MemoryLog::default()).unwrap();
        let mut invariants = Invariants::new(&setup);
        let outcome = loop {
            let outcome = team.tick().unwrap();
            invariants.check_simulation(team.simulation()).unwrap();
            if let Some(outcome) = outcome {
                break outcome;
            }
        };
        assert_eq!(outcome, Outcome::Complete, "{allocator}");
    }
}
