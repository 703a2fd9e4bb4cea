//! Robots whose energy is used up release their tasks, and a team without energy ends the run.

use alliance_tests::runs::{Events, allocators, parse, play};
use proto::tick::Outcome;
use run_log::{PoseRow, RunLog};

/// Robot a has to drive far and uses up its energy on the way to its first point. Robot b has enough for all points.
const BATTERY: &str = "
limit_s = 900.0
room = { width_m = 16.0, height_m = 4.0 }
energy = { capacity_j = 1200.0, idle_w = 1.0, drive_w = 40.0 }
service.kinds = [{ name = 't', work_s = { min = 10.0, max = 10.0 } }]
service.points = [
  { kind = 't', x_m = 15.0, y_m = 2.0 },
  { kind = 't', x_m = 12.0, y_m = 1.0, arrival_s = 60.0 },
  { kind = 't', x_m = 13.0, y_m = 3.0, arrival_s = 60.0 },
]
robots = [
  { name = 'a', start = { x_m = 0.5, y_m = 2.0, heading_deg = 0.0 } },
  { name = 'b', start = { x_m = 12.0, y_m = 2.0, heading_deg = 0.0 } },
]
";

/// A team without enough energy for its work.
const POOR: &str = "
limit_s = 3600.0
energy = { capacity_j = 500.0, idle_w = 5.0, drive_w = 20.0 }
service.kinds = [{ name = 't', work_s = { min = 30.0, max = 30.0 } }]
service.random = [{ n = 12 }]
robots = [{ name = 'a' }, { name = 'b' }]
";

fn play_by(allocator: &str, scenario: &str) -> (Outcome, RunLog) {
    play(parse(&format!("allocator = '{allocator}'\n{scenario}")), 1)
}

/// Checks that a robot without energy is active in no tick after the one in which its reading is 0.
fn assert_idle_when_empty(log: &RunLog, allocator: &str) {
    let rows = log.rows::<PoseRow>().unwrap();
    for robot in ["a", "b"] {
        let own = rows.iter().filter(|row| row.robot == robot);
        let empty = own.filter(|row| row.energy == Some(0.0));
        for row in empty.skip(1) {
            assert_eq!(row.behavior_set, "", "{allocator}: {row:?}");
        }
    }
}

#[test]
fn a_robot_without_energy_releases_its_task_and_a_team_without_energy_ends_the_run() {
    for name in allocators() {
        let (outcome, log) = play_by(name, BATTERY);
        assert_idle_when_empty(&log, name);
        // These rules may leave work: the first never takes over, and the second leaves its tasks by chance.
        if !["static", "threshold"].contains(&name) {
            assert_eq!(outcome, Outcome::Complete, "{name}");
        }

        let (outcome, log) = play_by(name, POOR);
        assert_idle_when_empty(&log, name);
        assert_eq!(outcome, Outcome::NoRobotLeft, "{name}");
        // The run ends in the tick in which the last robot is empty.
        let last_ms = log.events("energy-out").last().unwrap().t_ms.0;
        let ticks = last_ms / log.run.setup.scenario.step_ms + 1;
        assert_eq!(log.run.result.ticks, ticks, "{name}");
    }
}

/// A power fault lasts for some time, so the run goes on.
#[test]
fn a_robot_without_power_works_again_when_the_fault_is_over() {
    let faults = "[[faults.timeline]]\nfault.power = 'b'\nat_s = 5.0\nfor_s = 30.0\n\
                  [[faults.timeline]]\nfault.power = 'a'\nat_s = 5.0\nfor_s = 10.0\n";
    let (outcome, log) = play_by("first-come", &format!("{BATTERY}{faults}"));
    assert_eq!(outcome, Outcome::Complete);
    let rows = log.rows::<PoseRow>().unwrap();
    let during = |row: &&PoseRow| (5100..34_900).contains(&row.t_ms.0) && row.robot == "b";
    let mut during = rows.iter().filter(during);
    assert!(during.all(|row| row.behavior_set.is_empty()));
}
