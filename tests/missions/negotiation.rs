//! Allocators that talk: what ALLOCATORS.md §2 says happens under each fault, in whole missions, and what must hold in all of them.
//! That processes and one process write the same bytes, and that a log is replayed, is asked in `allocators.rs`.

use std::collections::BTreeMap;

use alliance_proto::log::{EventRow, LogLevel, Memory, MessageRow, RunLog};
use alliance_proto::mission::Value;
use alliance_proto::scenario::{Scenario, Setup};
use alliance_proto::tick::Outcome;
use in_process::Team as InProcess;
use missions::Registry;
use missions::waste::data::family;
use study::invariants::{Invariants, Violation};
use world_server::simulation::Simulation;

use crate::allocators::scenario;
use crate::harness::Lab;
use crate::team::Team;

pub const NEGOTIATORS: [&str; 2] = ["ble", "murdoch"];

const STEP_MS: u64 = 50;

/// Who holds a task dies with its first load, for good.
const KILL: &str = "[[faults.timeline]]\nwhen = \"any picks\"\nfault.kill = \"gold\"\n";

/// A run, after each tick of which is looked at what must hold.
pub fn checked(scenario: Scenario) -> (Outcome, RunLog, Option<Violation>) {
    let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
    let mut invariants = Invariants::new(&setup);
    let mut violation = None;
    let team = InProcess::new(setup, LogLevel::Full, Memory::default()).unwrap();
    let see = |simulation: &mut Simulation| {
        // The first look is before the first tick.
        if violation.is_none() && simulation.tick() > 0 {
            violation = invariants.see(simulation).err();
        }
    };
    let (outcome, recorder) = team.run_for(u64::MAX, Outcome::TimeLimit, see).unwrap();
    let vocabulary = Registry::built_in().vocabulary();
    let log = RunLog::from_memory(&recorder.into_sink(), &vocabulary).unwrap();
    (outcome, log, violation)
}

/// Runs it to its end: complete, with all that must hold.
#[track_caller]
fn complete(allocator: &str, faults: &str) -> RunLog {
    let (outcome, log, violation) = checked(scenario(allocator, faults));
    assert_eq!(violation, None, "{allocator}: {faults}");
    assert_eq!(outcome, Outcome::Complete, "{allocator}: {faults}");
    let delivered = log.run.result.mission.get("items.delivered");
    assert_eq!(delivered, Value::Count(24), "{allocator}: {faults}");
    log
}

/// For how long tasks have had more executors than one, from that time on, ms.
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

/// When a robot was last heard to say anything of that kind, ms.
fn last_heard(log: &RunLog, robot: &str, kind: &str) -> u64 {
    let rows = log.each_row::<MessageRow>().map(|row| row.unwrap());
    rows.filter(|row| row.sender == robot && row.kind == kind && row.fate == "heard")
        .map(|row| row.t_ms.0)
        .max()
        .unwrap()
}

/// The task that a robot was at in the end.
fn last_task(log: &RunLog, robot: &str) -> String {
    let rows = log.rows::<EventRow>().unwrap();
    let mut own = rows.into_iter().rev().filter(|row| row.robot == robot);
    own.find(|row| row.kind == "activated").unwrap().detail
}

/// Who took a task up first after a time: when, who, why.
fn taken_up(log: &RunLog, task: &str, after_ms: u64) -> (u64, String, String) {
    let rows = log.rows::<EventRow>().unwrap().into_iter();
    let mut taken = rows.filter(|row| row.kind == "activated" && row.detail == task);
    let row = taken.find(|row| row.t_ms.0 > after_ms).unwrap();
    (row.t_ms.0, row.robot, row.reason)
}

/// The task of the dead is taken over when the allocator's rule says, to the step.
#[track_caller]
fn assert_taken_over(allocator: &str, log: &RunLog, victim: &str) {
    let task = last_task(log, victim);
    let rows = log.rows::<EventRow>().unwrap();
    let mut gone = rows
        .iter()
        .filter(|row| row.kind == "gone" && row.robot == victim);
    let died = gone.next().unwrap().t_ms.0;
    let (when, who, why) = taken_up(log, &task, died);
    assert_ne!(who, victim);
    match allocator {
        // Rows count for τ after they were heard, which is a step after they were sent.
        "ble" => {
            let heard = last_heard(log, victim, "allocation");
            assert_eq!(
                (when, why.as_str()),
                (heard + 5000, "claimed"),
                "{who} {task}"
            );
        }
        // A step for the lease to be over, half a second of bids, a step for the award to be heard. If the auctioneer has died, the
        // next one takes office τ after the last that it heard of it, and listens for a lease.
        "murdoch" => {
            let auction_ms = 500 + STEP_MS;
            let due = if victim == "blue" {
                let heartbeat = last_heard(log, victim, "heartbeat");
                heartbeat.max(last_heard(log, victim, "allocation")) + 5000 + 6000 + auction_ms
            } else {
                last_heard(log, victim, "allocation") + 6000 + STEP_MS + auction_ms
            };
            assert_eq!((when, why.as_str()), (due, "awarded"), "{who} {task}");
        }
        other => panic!("when does {other} take over?"),
    }
}

#[test]
fn without_faults_nobody_doubles_and_all_is_delivered() {
    for allocator in NEGOTIATORS {
        let log = complete(allocator, "");
        // All begin to search at once, and hear of each other a step later; so it is with each task that falls due for all.
        let doubled = doubled_ms(&log, 0);
        assert!(doubled <= 20 * STEP_MS, "{allocator}: {doubled} ms");
    }
}

/// By the clock of the run, with the process of whoever holds the task really killed.
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
fn the_task_of_the_dead_is_taken_over_in_time() {
    for allocator in NEGOTIATORS {
        let log = complete(allocator, KILL);
        assert_taken_over(allocator, &log, "gold");
    }
}

#[test]
fn lost_words_double_work_and_end_nothing() {
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

/// Each side does all; healed, one executor is left after 1/ρ and two steps, but that whoever loses a contract brings its load away.
#[test]
fn a_partition_doubles_until_it_heals() {
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
fn a_robot_that_starts_again_joins_in() {
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
            "{allocator}: gold works again"
        );
    }
}

/// It goes on telling that it works, and does nothing.
#[test]
fn a_babbler_keeps_its_task_as_long_as_the_rule_believes_it() {
    let faults = "[[faults.timeline]]\nwhen = \"gold picks\"\nfault.babble = \"gold\"\n";
    let healed = faults.replace("fault.babble", "for_s = 120.0\nfault.babble");
    for allocator in NEGOTIATORS {
        complete(allocator, &healed);
        let (outcome, log, violation) = checked(scenario(allocator, faults));
        assert_eq!(violation, None, "{allocator}");
        assert_eq!(
            outcome,
            Outcome::TimeLimit,
            "{allocator}: its load is never delivered"
        );
        // The other spill is cleared, and of this one not an item is touched any more.
        let delivered = log.run.result.mission.get("items.delivered");
        assert_eq!(delivered, Value::Count(12), "{allocator}");
    }
}

#[test]
fn thirty_robots_carry_all_to_their_deposits() {
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
        assert_eq!(delivered, Value::Count(240), "{allocator}");
    }
}
