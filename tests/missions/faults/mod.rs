//! Faults in missions by real processes: each does what it says, is survived, shows in the log, and repeats byte for byte
//! (issue "Every fault is real").

mod links;
mod minds;
mod orders;
mod processes;
mod replays;
mod storms;

use std::collections::BTreeMap;

use alliance_proto::control::FaultStatus;
use alliance_proto::log::{EventRow, MotivationRow, RunLog};
use alliance_proto::time::SimTime;
use missions::waste::data::WasteRow;

use crate::harness::Lab;

/// A mission under `alliance run` whose scenario has these faults; it completes, or not, and its log is read back.
///
/// Whatever the faults are, this holds: nothing happened but what was scripted, all items are accounted for in every row, and
/// a replay within one process gives the same bytes.
#[track_caller]
fn mission(lab: &Lab, name: &str, scenario: &str, arguments: &[&str], status: i32) -> RunLog {
    let file = format!("{name}.toml");
    let text = format!("name = \"{name}\"\n{scenario}");
    std::fs::write(lab.path(&file), text).unwrap();
    let mut all = vec![file.as_str()];
    all.extend(arguments);
    lab.mission(name, &all).expect(status);
    let log = lab.log(name);
    assert!(!log.run.unscripted, "{name} is unscripted");
    assert_items_accounted_for(&log);
    let replay = lab.run(&["replay", name]).expect(0);
    assert!(replay.stderr.starts_with("identical"), "{}", replay.stderr);
    log
}

/// No item is lost or doubled, in any row of mission.csv.
#[track_caller]
fn assert_items_accounted_for(log: &RunLog) {
    let rows = log.rows::<WasteRow>().unwrap();
    let total = |row: &WasteRow| {
        row.items_in_spills + row.items_carried + row.items_on_floor + row.items_delivered
    };
    assert!(!rows.is_empty());
    for pair in rows.windows(2) {
        // Only a fault adds items, and then the log says so.
        let added = total(&pair[1]).checked_sub(total(&pair[0]));
        assert!(
            added == Some(0) || (added.is_some() && faults_named(log, "waste")),
            "{pair:?}"
        );
    }
}

fn faults_named(log: &RunLog, name: &str) -> bool {
    let mut faults = log.run.faults.iter();
    faults.any(|fault| fault.order.fault.name() == name)
}

/// Events of a kind, of a robot or of all.
fn events(log: &RunLog, kind: &str, robot: Option<&str>) -> Vec<EventRow> {
    let mut rows = log.rows::<EventRow>().unwrap();
    rows.retain(|row| row.kind == kind && robot.is_none_or(|robot| row.robot == robot));
    rows
}

/// The one event of that kind and robot.
#[track_caller]
fn only(log: &RunLog, kind: &str, robot: &str) -> EventRow {
    let rows = events(log, kind, Some(robot));
    assert_eq!(rows.len(), 1, "{kind} of {robot}: {rows:?}");
    rows[0].clone()
}

/// A fault of the run, which has really hit.
#[track_caller]
fn hit(log: &RunLog, id: &str) -> FaultStatus {
    let fault = log.run.faults.iter().find(|fault| fault.id == id);
    let fault = fault.unwrap_or_else(|| panic!("no fault {id}")).clone();
    assert!(fault.hits > 0, "{id} never hit: {fault:?}");
    fault
}

/// Simulated time of that many seconds.
fn at(seconds: f64) -> SimTime {
    SimTime::from_secs_f64(seconds)
}

/// No two robots go on with the same exclusive task, from a time on: claims of the same step are settled in the next one.
#[track_caller]
fn assert_exclusive_from(log: &RunLog, from: SimTime) {
    let mut executing: BTreeMap<(String, SimTime), u32> = BTreeMap::new();
    for row in log.rows::<MotivationRow>().unwrap() {
        if row.t_ms >= from && row.state == "active" {
            *executing.entry((row.task, row.t_ms)).or_default() += 1;
        }
    }
    assert!(!executing.is_empty(), "nobody did anything after {from}");
    let step = SimTime(log.run.setup.scenario.step_ms);
    for ((task, now), robots) in &executing {
        let next = executing.get(&(task.clone(), *now + step));
        let go_on = *robots > 1 && next.is_some_and(|robots| *robots > 1);
        assert!(!go_on, "two go on with {task} at {now}");
    }
}

/// The longest that two robots may go on with one exclusive task once they hear each other again: τ + ψ + a heartbeat, the
/// greatest of all robots and sets, s.
fn healing_bound_s(log: &RunLog) -> f64 {
    let robots = log.run.setup.alliance.robots.values();
    let sets = robots.flat_map(|robot| robot.sets.values());
    sets.map(|set| set.ceased_after_s + set.before_yielding_s + 1.0 / set.broadcast_rate_hz)
        .fold(0.0, f64::max)
}
