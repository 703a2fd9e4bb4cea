//! Allocators that negotiate: the effects of each fault as in docs/ALLOCATORS.md, "Under the same faults", in whole missions with all
//! invariants. `allocators.rs` compares processes with one process and replays their logs.

use std::collections::BTreeMap;

use analysis::invariants::{Invariants, Violation};
use in_process::Team as InProcess;
use missions::Registry;
use missions::waste::data::family;
use proto::tick::Outcome;
use run_log::{EventRow, LogLevel, MemoryLog, MessageRow, RunLog};
use scenario::mission::FigureValue;
use scenario::{Scenario, Setup};
use world_server::simulation::Simulation;

use crate::allocators::scenario;
use crate::harness::Lab;
use crate::team::Team;

pub const NEGOTIATORS: [&str; 2] = ["ble", "murdoch"];

const STEP_MS: u64 = 50;

/// Kills gold at the first pick, without a restart.
const KILL: &str = "[[faults.timeline]]\nwhen = \"any picks\"\nfault.kill = \"gold\"\n";

/// Runs a scenario and checks the invariants after each tick.
pub fn checked(scenario: Scenario) -> (Outcome, RunLog, Option<Violation>) {
    let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
    let mut invariants = Invariants::new(&setup);
    let mut violation = None;
    let team = InProcess::new(setup, LogLevel::Full, MemoryLog::default()).unwrap();
    let check = |simulation: &mut Simulation| {
        // The first call is before the first tick.
        if violation.is_none() && simulation.tick() > 0 {
            violation = invariants.check_simulation(simulation).err();
        }
    };
    let (outcome, recorder) = team.run_for(u64::MAX, Outcome::TimeLimit, check).unwrap();
    let vocabulary = Registry::built_in().vocabulary();
    let log = RunLog::from_memory(&recorder.into_sink(), &vocabulary).unwrap();
    (outcome, log, violation)
}

/// Runs a scenario and checks that the mission is complete without an invariant violation.
#[track_caller]
fn complete(allocator: &str, faults: &str) -> RunLog {
    let (outcome, log, violation) = checked(scenario(allocator, faults));
    assert_eq!(violation, None, "{allocator}: {faults}");
    assert_eq!(outcome, Outcome::Complete, "{allocator}: {faults}");
    let delivered = log.run.result.mission.get("items.delivered");
    assert_eq!(delivered, FigureValue::Count(24), "{allocator}: {faults}");
    log
}

/// Returns how long tasks had more than one executor from a time on, in ms.
fn doubled_ms(log: &RunLog, from_ms: u64) -> u64 {
    let mut executors: BTreeMap<String, i64> = BTreeMap::new();
    let (mut since, mut doubled) = (0, 0);
    for row in log.rows::<EventRow>().unwrap() {
        let more = match row.kind.as_str() {
            "activated" => 1,
            "hibernated" => -1,
            _ => continue,
        };
        let surplus = executors.values().filter(|count| **count > 1).count() as u64;
        let now = row.t_ms.0.max(from_ms);
        doubled += surplus * (now - since.max(from_ms));
        since = now;
        *executors.entry(row.detail).or_default() += more;
    }
    doubled
}

/// Returns the time of the last received message of a robot and kind, in ms.
fn last_received(log: &RunLog, robot: &str, kind: &str) -> u64 {
    let rows = log.each_row::<MessageRow>().map(|row| row.unwrap());
    rows.filter(|row| row.sender == robot && row.kind == kind && row.delivery == "received")
        .map(|row| row.t_ms.0)
        .max()
        .unwrap()
}

fn last_task(log: &RunLog, robot: &str) -> String {
    let rows = log.rows::<EventRow>().unwrap();
    let mut of_robot = rows.into_iter().rev().filter(|row| row.robot == robot);
    of_robot.find(|row| row.kind == "activated").unwrap().detail
}

/// Returns the first activation of a task after a time: time, robot and reason.
fn taken_up(log: &RunLog, task: &str, after_ms: u64) -> (u64, String, String) {
    let rows = log.rows::<EventRow>().unwrap().into_iter();
    let mut taken = rows.filter(|row| row.kind == "activated" && row.detail == task);
    let row = taken.find(|row| row.t_ms.0 > after_ms).unwrap();
    (row.t_ms.0, row.robot, row.reason)
}

/// Checks that the task of a crashed robot is taken over at the step that the allocator's rule states.
#[track_caller]
fn assert_taken_over(allocator: &str, log: &RunLog, victim: &str) {
    let task = last_task(log, victim);
    let rows = log.rows::<EventRow>().unwrap();
    let mut gone = rows
        .iter()
        .filter(|row| row.kind == "gone" && row.robot == victim);
    let crashed = gone.next().unwrap().t_ms.0;
    let (when, robot, reason) = taken_up(log, &task, crashed);
    assert_ne!(robot, victim);
    match allocator {
        // A table row is valid for τ after its receipt, which is one step after it was sent.
        "ble" => {
            let received = last_received(log, victim, "allocation");
            assert_eq!(
                (when, reason.as_str()),
                (received + 5000, "claimed"),
                "{robot} {task}"
            );
        }
        // One step until the lease ends, half a second of bids, one step until the award is received. If the
        // auctioneer has crashed, the next robot takes office τ after the last message of the old one, and waits for
        // a lease.
        "murdoch" => {
            let auction_ms = 500 + STEP_MS;
            let due = if victim == "blue" {
                let heartbeat = last_received(log, victim, "heartbeat");
                heartbeat.max(last_received(log, victim, "allocation")) + 5000 + 6000 + auction_ms
            } else {
                last_received(log, victim, "allocation") + 6000 + STEP_MS + auction_ms
            };
            assert_eq!((when, reason.as_str()), (due, "awarded"), "{robot} {task}");
        }
        other => panic!("no takeover rule for {other}"),
    }
}

#[test]
fn without_faults_tasks_are_hardly_duplicated_and_all_items_are_delivered() {
    for allocator in NEGOTIATORS {
        let log = complete(allocator, "");
        // All robots begin to search at once and receive the claims one step later. The same holds for each task that
        // becomes due for all robots.
        let doubled = doubled_ms(&log, 0);
        assert!(doubled <= 20 * STEP_MS, "{allocator}: {doubled} ms");
    }
}

/// Kills the process that has the task, during a paced run.
#[test]
fn the_task_of_a_killed_process_is_taken_over_in_time() {
    for allocator in NEGOTIATORS {
        let lab = Lab::new();
        let arguments = ["--speed", "60x", "--allocator", allocator];
        let mut team = Team::start(&lab, &arguments);
        let row = team.wait_for_row("events.csv", &[",picked,"]);
        let victim = row.split(',').nth(2).unwrap().to_owned();
        team.kill(&victim);
        let finished = team.wait().expect(0);
        assert_eq!(
            finished.json()["result"]["items"]["delivered"],
            24,
            "{allocator}"
        );
        assert_taken_over(allocator, &lab.log("run"), &victim);
    }
}

#[test]
fn the_task_of_a_crashed_robot_is_taken_over_in_time() {
    for allocator in NEGOTIATORS {
        let log = complete(allocator, KILL);
        assert_taken_over(allocator, &log, "gold");
    }
}

#[test]
fn message_loss_duplicates_work_but_the_mission_completes() {
    for allocator in NEGOTIATORS {
        for p in [0.3, 0.6] {
            complete(
                allocator,
                &format!("[[faults.timeline]]\nat_s = 0.0\nfault.drop = {{ p = {p} }}\n"),
            );
        }
        complete(
            allocator,
            "[[faults.timeline]]\nat_s = 0.0\nfault.radio = \"severe-radio\"\n",
        );
    }
}

/// Each side does all tasks. After healing one executor is left within 1/ρ and two steps, except that a robot that
/// loses a contract first delivers its load.
#[test]
fn a_partition_duplicates_tasks_until_it_heals() {
    let faults = "[[faults.timeline]]\nat_s = 120.0\nfor_s = 60.0\n\
                  fault.partition = { groups = [[\"blue\"], [\"gold\", \"green\"]] }\n";
    for allocator in NEGOTIATORS {
        let log = complete(allocator, faults);
        let (within, after) = (doubled_ms(&log, 0), doubled_ms(&log, 180_000));
        assert!(within > 10_000, "{allocator}: {within} ms");
        let load_ms = if allocator == "murdoch" { 20_000 } else { 0 };
        let most = 1000 + load_ms + 20 * STEP_MS;
        assert!(after <= most, "{allocator}: {after} ms");
    }
}

#[test]
fn a_restarted_robot_works_again() {
    let faults =
        "[[faults.timeline]]\nwhen = \"gold picks\"\nfor_s = 60.0\nfault.kill = \"gold\"\n";
    for allocator in NEGOTIATORS {
        let log = complete(allocator, faults);
        let back = log.rows::<EventRow>().unwrap();
        let back = back
            .iter()
            .rfind(|row| row.kind == "joined" && row.robot == "gold")
            .unwrap();
        let mut rows = log.rows::<EventRow>().unwrap().into_iter();
        assert!(
            rows.any(|row| row.kind == "activated" && row.robot == "gold" && row.t_ms > back.t_ms),
            "{allocator}: gold must work again"
        );
    }
}

/// A babbling robot reports work but does nothing.
#[test]
fn a_babbling_robot_keeps_its_task_and_blocks_the_mission() {
    let faults = "[[faults.timeline]]\nwhen = \"gold picks\"\nfault.babble = \"gold\"\n";
    let healed = faults.replace("fault.babble", "for_s = 120.0\nfault.babble");
    for allocator in NEGOTIATORS {
        complete(allocator, &healed);
        let (outcome, log, violation) = checked(scenario(allocator, faults));
        assert_eq!(violation, None, "{allocator}");
        assert_eq!(
            outcome,
            Outcome::TimeLimit,
            "{allocator}: the load is never delivered"
        );
        // The other spill is cleared, and no further item of this spill is delivered.
        let delivered = log.run.result.mission.get("items.delivered");
        assert_eq!(delivered, FigureValue::Count(12), "{allocator}");
    }
}

#[test]
fn thirty_robots_deliver_all_items() {
    for allocator in NEGOTIATORS {
        let mut scenario = family(30, 20);
        scenario.allocator = Some(allocator.to_owned());
        let (outcome, log, violation) = checked(scenario);
        assert_eq!(
            (outcome, violation),
            (Outcome::Complete, None),
            "{allocator}"
        );
        let delivered = log.run.result.mission.get("items.delivered");
        assert_eq!(delivered, FigureValue::Count(240), "{allocator}");
    }
}
