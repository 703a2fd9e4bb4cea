//! `alliance status`: shows the state of a live run.

use std::process::ExitCode;
use std::thread::sleep;
use std::time::Duration;

use analysis::table;
use clap::Args;
use cluster::rendezvous;
use comfy_table::Table;
use proto::control::{ControlCommand, Reply, RobotStatus, Status};
use scenario::Problem;
use scenario::limits::closed;
use scenario::mission::columns::details;
use scenario::time::seconds;
use terminal::{counted, stderr_line};

use crate::clock::describe;
use crate::control::{ControlArgs, unexpected};
use crate::fault;

/// The largest number of robots in the first table.
const ROBOTS: usize = 30;
/// The largest number of robots whose motivations are shown.
const MOTIVATIONS: usize = 12;

/// Show robots, processes, tasks and faults of a live run
#[derive(Args, Clone, Debug)]
pub struct StatusArgs {
    #[command(flatten)]
    control: ControlArgs,
    /// Repeat at this interval in wall-clock time until the run is over
    #[arg(long, value_name = "TIME", num_args = 0..=1, default_missing_value = "1s", value_parser = interval)]
    watch: Option<Duration>,
}

/// Parses an interval from 0.1 s to an hour.
fn interval(text: &str) -> Result<Duration, Problem> {
    let span_s = seconds(text)?;
    closed(0.1, 3600.0, "s").check((), span_s)?;
    Ok(Duration::from_secs_f64(span_s))
}

impl StatusArgs {
    /// Prints the state once or repeatedly. Exit status 0, or 3 if no run is live or none answers.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        // If no run is live, `show` prints the error.
        let (Some(interval), Some((run, control))) = (self.watch, self.control.fixed_to_run())
        else {
            return show(&self.control);
        };
        let is_live =
            || rendezvous::live().is_ok_and(|live| live.iter().any(|live| live.run == run));
        while is_live() {
            // An error is no reason to stop: the run may have just ended, or its world may be stopped and resume later.
            terminal::clear_screen();
            let _ = show(&control);
            sleep(interval);
        }
        stderr_line!("run {run} is over");
        ExitCode::SUCCESS
    }
}

fn show(control: &ControlArgs) -> ExitCode {
    control.send_command("status", ControlCommand::Status, |reply| match reply {
        Reply::Status(status) => text(status),
        other => unexpected(other),
    })
}

fn text(status: &Status) -> String {
    let mut text = format!(
        "run    {} ({}, seed {})\n\
         folder {}\n\
         clock  tick {}, {} simulated, {}\n\
         so far {}\n\
         \n{}\n\
         \n{}",
        status.run,
        status.scenario,
        status.seed,
        status.folder,
        status.tick,
        status.t_ms,
        describe(&status.clock),
        details(&status.mission),
        bounded(&status.robots, ROBOTS, robots),
        bounded(&status.robots, MOTIVATIONS, motivations),
    );
    if !status.faults.is_empty() {
        text += &format!("\n\n{}", fault::in_a_table(&status.faults).trim_fmt());
    }
    text
}

/// Returns the table of the first robots, and the number of the others.
fn bounded(robots: &[RobotStatus], most: usize, table: fn(&[RobotStatus]) -> Table) -> String {
    let shown = &robots[..robots.len().min(most)];
    let mut text = table(shown).trim_fmt();
    let others = robots.len() - shown.len();
    if others > 0 {
        text += &format!("\nand {}; --json prints all", counted(others, "more robot"));
    }
    text
}

fn robots(robots: &[RobotStatus]) -> Table {
    let mut table = table::new([
        "robot",
        "process",
        "incarnation",
        "state",
        "task",
        "carries",
    ]);
    let number = |number: Option<u32>| number.map_or_else(|| "–".to_owned(), |n| n.to_string());
    for robot in robots {
        table.add_row([
            robot.robot.clone(),
            number(robot.pid),
            number(robot.incarnation),
            robot.state.as_str().to_owned(),
            robot.task.clone().unwrap_or_else(|| "–".to_owned()),
            if robot.carrying { "an item" } else { "–" }.to_owned(),
        ]);
    }
    table::align_right(&mut table, 1..=2);
    table
}

/// Returns a table of the behavior sets of all robots. The state of hibernating sets is left empty.
fn motivations(robots: &[RobotStatus]) -> Table {
    let mut table = table::new(["robot", "behavior set", "motivation", "state"]);
    for robot in robots {
        for (index, set) in robot.sets.iter().enumerate() {
            table.add_row([
                if index == 0 { &robot.robot } else { "" },
                &set.behavior_set,
                &format!("{:.1}", set.motivation),
                match set.state.as_str() {
                    "hibernating" => "",
                    state => state,
                },
            ]);
        }
    }
    table::align_right(&mut table, 2..=2);
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATUS: &str = r#"{
        "run": "waste-cleanup-10929", "folder": "/tmp/runs/first", "scenario": "waste-cleanup", "seed": 1, "tick": 1310, "t_ms": 65500,
        "clock": {"paused": false, "speed": 5.0, "steps_left": 0, "tick": 1310},
        "mission": [
            {"name": "items_in_spills", "kind": "left", "value": 21},
            {"name": "items_delivered", "kind": "done", "value": 3},
            {"name": "last_report_ms", "kind": "time", "value": null}],
        "robots": [
            {"robot": "blue", "pid": 10932, "incarnation": 1, "state": "present", "x_m": 4.1, "y_m": 5.9,
             "heading_rad": 1.57, "carrying": true, "task": "move-spill(top)", "sets": [
                {"behavior_set": "move-spill(top)", "motivation": 100.0, "state": "active"},
                {"behavior_set": "report-progress", "motivation": 3.26, "state": "hibernating"}]},
            {"robot": "gold", "pid": null, "incarnation": null, "state": "dead", "x_m": 1.0, "y_m": 1.0,
             "heading_rad": 0.0, "carrying": false, "task": null, "sets": []}],
        "faults": [
            {"id": "f1", "order": {"fault": {"kill": "gold"}}, "phase": "in-force", "applied_ms": 60000,
             "healed_ms": null, "hits": 1},
            {"id": "late", "order": {"fault": {"mute": "blue"}, "when": "blue reports"}, "phase": "armed",
             "applied_ms": null, "healed_ms": null, "hits": 0}]
    }"#;

    #[test]
    fn a_status_has_all_parts_as_text() {
        let text = text(&serde_json::from_str(STATUS).unwrap());
        // The tables' columns are as wide as they need to be.
        let words: Vec<&str> = text.split_whitespace().collect();
        let words = words.join(" ");
        for part in [
            "run waste-cleanup-10929 (waste-cleanup, seed 1) folder /tmp/runs/first clock tick 1310, 65.500 s simulated, at 5x so far \
             3 of 24 items delivered, items in spills 21, last report –",
            "blue 10932 1 present move-spill(top) an item gold – – dead – –",
            "blue move-spill(top) 100.0 active report-progress 3.3",
            "f1 kill gold in force 60.000 s – 1",
            "late mute blue --when \"blue reports\" armed – – 0",
        ] {
            assert!(words.contains(part), "no '{part}' in:\n{text}");
        }
    }

    #[test]
    fn a_large_team_is_shown_in_part() {
        let mut status: Status = serde_json::from_str(STATUS).unwrap();
        let robot = status.robots[0].clone();
        status.robots = vec![robot; 300];
        let text = text(&status);
        for counted in [
            "and 270 more robots; --json prints all",
            "and 288 more robots; --json prints all",
        ] {
            assert!(text.contains(counted), "no '{counted}' in:\n{text}");
        }
    }
}
