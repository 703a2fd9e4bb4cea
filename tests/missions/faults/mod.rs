//! Faults in missions: each has its stated effect, appears in the log, and is repeated byte for byte.

mod channels;
mod controllers;
mod links;
mod processes;
mod replays;
mod storms;

use std::collections::BTreeMap;

use alliance_tests::harness::{Arguments, Lab, join};
use alliance_tests::runs::{Events, parse, play};
use analysis::diff::{Comparison, compare};
use analysis::replay::replay;
use missions::waste::data::WasteRow;
use proto::control::FaultStatus;
use proto::tick::Outcome;
use run_log::{EventRow, LogLevel, MotivationRow, RunLog};
use scenario::time::SimTime;

/// Runs a mission with faults in one process and returns its log.
///
/// For all faults it checks the outcome, that each row accounts for all items, and that a replay is identical.
#[track_caller]
fn mission(name: &str, scenario: &str, expected: Outcome) -> RunLog {
    let (outcome, log) = play(parse(&format!("name = \"{name}\"\n{scenario}")), 1);
    assert_eq!(outcome, expected, "{name}");
    assert_items_accounted_for(&log);
    assert_replay_is_identical(&log);
    log
}

/// Runs a mission with faults by processes and returns its log. It checks the same as [`mission`], and that the run is
/// scripted.
#[track_caller]
fn mission_by_processes(scenario: &str, arguments: impl Arguments, status: i32) -> RunLog {
    let lab = Lab::new();
    lab.write("faults.toml", scenario);
    lab.mission("run", join("faults.toml", arguments))
        .expect(status);
    let log = lab.log("run");
    assert!(!log.run.unscripted);
    assert_items_accounted_for(&log);
    assert_replay_is_identical(&log);
    log
}

#[track_caller]
fn assert_replay_is_identical(log: &RunLog) {
    let (_, again) = replay(log, LogLevel::Full, |_| {}).unwrap();
    let comparison = compare(log, &again).unwrap();
    let is_identical = matches!(comparison, Comparison::Identical { .. });
    let name = &log.run.setup.scenario.name;
    assert!(is_identical, "{name}: {comparison}");
}

/// Checks that no row of mission.csv loses or duplicates an item. Only the fault `waste` adds items.
#[track_caller]
pub fn assert_items_accounted_for(log: &RunLog) {
    let rows = log.rows::<WasteRow>().unwrap();
    let total = |row: &WasteRow| {
        row.items_in_spills + row.items_carried + row.items_on_floor + row.items_delivered
    };
    assert!(!rows.is_empty());
    let mut faults = log.run.faults.iter();
    let may_add = faults.any(|fault| fault.order.fault.name() == "waste");
    for pair in rows.windows(2) {
        let (before, after) = (total(&pair[0]), total(&pair[1]));
        assert!(before == after || (may_add && before < after), "{pair:?}");
    }
}

/// Returns the only event of a kind and robot.
#[track_caller]
fn only(log: &RunLog, kind: &str, robot: &str) -> EventRow {
    let mut rows = log.events_of(robot, kind);
    assert_eq!(rows.len(), 1, "{kind} of {robot}: {rows:?}");
    rows.remove(0)
}

/// Returns a fault of the run, after a check that it had an effect.
#[track_caller]
fn hit(log: &RunLog, id: &str) -> FaultStatus {
    let fault = log.run.faults.iter().find(|fault| fault.id == id);
    let fault = fault.unwrap_or_else(|| panic!("no fault {id}")).clone();
    assert!(fault.hits > 0, "{id} had no effect: {fault:?}");
    fault
}

/// Converts seconds to simulated time.
fn at(seconds: f64) -> SimTime {
    SimTime::from_secs_f64(seconds)
}

/// Checks that no two robots keep the same exclusive task from a time on. Claims of the same step are resolved in the
/// next one.
#[track_caller]
fn assert_exclusive_from(log: &RunLog, from: SimTime) {
    let mut executing: BTreeMap<(String, SimTime), u32> = BTreeMap::new();
    for row in log.rows::<MotivationRow>().unwrap() {
        if row.t_ms >= from && row.state == "active" {
            *executing.entry((row.task, row.t_ms)).or_default() += 1;
        }
    }
    assert!(!executing.is_empty(), "no robot was active after {from}");
    let step = SimTime(log.run.setup.scenario.step_ms);
    for ((task, now), robots) in &executing {
        let next = executing.get(&(task.clone(), *now + step));
        let is_shared = *robots > 1 && next.is_some_and(|robots| *robots > 1);
        assert!(!is_shared, "two robots keep {task} at {now}");
    }
}

/// Returns the longest time in s that two robots may share an exclusive task after a partition: the maximum of τ + ψ
/// + one heartbeat period.
fn healing_bound_s(log: &RunLog) -> f64 {
    let robots = log.run.setup.alliance.robots.values();
    let sets = robots.flat_map(|robot| robot.sets.values());
    sets.map(|set| set.ceased_after_s + set.before_yielding_s + 1.0 / set.broadcast_rate_hz)
        .fold(0.0, f64::max)
}
