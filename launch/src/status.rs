//! `alliance status`: how a live run goes.

use std::process::ExitCode;

use alliance_proto::control::{Command, Reply, RobotStatus, Status};
use clap::Args;
use comfy_table::presets::UTF8_FULL_CONDENSED;
use comfy_table::{CellAlignment, Table};

use crate::clock::describe;
use crate::control::{ControlArgs, unexpected};
use crate::fault;

/// Show how a live run goes: robots, processes, tasks, motivations, faults.
#[derive(Args, Clone, Debug)]
pub struct StatusArgs {
    #[command(flatten)]
    control: ControlArgs,
}

impl StatusArgs {
    /// Exit status 0, or 3 when no run is live or none answers.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        self.control
            .ask("status", Command::Status, |reply| match reply {
                Reply::Status(status) => text(status),
                other => unexpected(other),
            })
    }
}

fn text(status: &Status) -> String {
    let items = status.items;
    let mut text = format!(
        "run    {} ({}, seed {})\n\
         clock  tick {}, {} simulated, {}\n\
         items  {} of {} delivered, {} carried, {} in spills, {} on the floor\n\
         {}",
        status.run,
        status.scenario,
        status.seed,
        status.tick,
        status.t_ms,
        describe(&status.clock),
        items.delivered,
        items.total(),
        items.carried,
        items.in_spills,
        items.on_floor,
        robots(&status.robots),
    );
    if !status.faults.is_empty() {
        text += &format!("\n{}", fault::table(&status.faults));
    }
    text
}

fn robots(robots: &[RobotStatus]) -> Table {
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED).set_header([
        "robot",
        "process",
        "life",
        "state",
        "task",
        "carries",
        "behavior set",
        "motivation",
    ]);
    let number = |number: Option<u32>| number.map_or_else(|| "–".to_owned(), |n| n.to_string());
    for robot in robots {
        let lines = |line: fn(&(String, String)) -> &str| {
            let sets = sets(robot);
            sets.iter().map(line).collect::<Vec<_>>().join("\n")
        };
        table.add_row([
            robot.robot.clone(),
            number(robot.pid),
            number(robot.incarnation),
            robot.state.as_str().to_owned(),
            robot.task.clone().unwrap_or_else(|| "–".to_owned()),
            if robot.carrying { "waste" } else { "–" }.to_owned(),
            lines(|(name, _)| name),
            lines(|(_, motivation)| motivation),
        ]);
    }
    for column in [1, 2, 7] {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table
}

/// Names and motivations of a robot's behavior sets. Most hibernate, which goes without saying.
fn sets(robot: &RobotStatus) -> Vec<(String, String)> {
    robot
        .sets
        .iter()
        .map(|set| {
            let name = match set.state.as_str() {
                "hibernating" => set.behavior_set.clone(),
                state => format!("{} ({state})", set.behavior_set),
            };
            (name, format!("{:.1}", set.motivation))
        })
        .collect()
}
