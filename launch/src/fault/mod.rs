//! `alliance fault`: breaks things in a live run, lists and heals them.

mod args;
mod modes;
mod own;
#[cfg(test)]
mod tests;
mod timing;

use std::process::ExitCode;

use alliance_proto::control::{Armed, Cleared, ControlCommand, FaultStatus, Phase, Reply, schema};
use alliance_proto::fault::Order;
use alliance_proto::tell;
use alliance_proto::time::SimTime;
use clap::{Args, Subcommand};
use comfy_table::{CellAlignment, Table};
use study::table;

use crate::control::{ControlArgs, print, unexpected};

/// Break things in a live run, list and heal them.
#[derive(Args, Clone, Debug)]
#[command(arg_required_else_help = true)]
pub struct FaultArgs {
    #[command(subcommand)]
    part: Option<Part>,
    #[command(flatten)]
    control: ControlArgs,
    /// Print the JSON Schema of the control topic's requests, with that of its replies under the key `reply`
    #[arg(long)]
    schema: bool,
}

#[derive(Subcommand, Clone, Debug)]
enum Part {
    /// List the faults of the run
    List,
    /// Heal or disarm a fault, or all
    Clear {
        /// The fault's id [default: all]
        id: Option<String>,
    },
    #[command(flatten)]
    Order(Box<args::OrderArgs>),
}

impl FaultArgs {
    /// Exit status 0, 2 for a mistake in arguments or an order that the world refuses, 3 when no run is live or none answers.
    #[must_use]
    pub fn run(self) -> ExitCode {
        if self.schema && self.part.is_none() {
            return match print(&schema()) {
                Ok(()) => ExitCode::SUCCESS,
                Err(error) => {
                    tell!("alliance fault: {error:#}");
                    ExitCode::from(3)
                }
            };
        }
        let command = match self.part {
            Some(Part::List) => Ok(ControlCommand::List),
            Some(Part::Clear { id }) => Ok(ControlCommand::Clear(id)),
            Some(Part::Order(order)) => order.into_order().map(ControlCommand::Fault),
            None => Err("say which fault, list or clear".to_owned()),
        };
        match command {
            // Printed alone: whoever asks for it wants to store it.
            Ok(_) if self.schema => refuse("--schema stands alone"),
            Ok(ControlCommand::Fault(order)) => {
                let acknowledged = order.clone();
                self.control.ask(
                    "fault",
                    ControlCommand::Fault(order),
                    move |reply| match reply {
                        Reply::Armed(armed) => acknowledge(armed, &acknowledged),
                        other => unexpected(other),
                    },
                )
            }
            Ok(command) => self.control.ask("fault", command, |reply| match reply {
                Reply::Cleared(cleared) => cleared_in_words(cleared),
                Reply::Faults(faults) if faults.is_empty() => "no faults".to_owned(),
                Reply::Faults(faults) => in_a_table(faults).trim_fmt(),
                other => unexpected(other),
            }),
            Err(why) => refuse(&why),
        }
    }
}

fn refuse(why: &str) -> ExitCode {
    tell!("alliance fault: {why}; try --help");
    ExitCode::from(2)
}

/// "f3: kill gold from tick 1234 (61.700 s)".
fn acknowledge(armed: &Armed, order: &Order) -> String {
    let begins = if order.fault.is_momentary() {
        "at"
    } else {
        "from"
    };
    let mut text = format!("{}: {}", armed.id, order.fault);
    match (&order.when, armed.tick, armed.t_ms) {
        (_, Some(tick), Some(t_ms)) => text += &format!(" {begins} tick {tick} ({t_ms})"),
        (Some(when), ..) => text += &format!(" when {when}"),
        _ => {}
    }
    for (word, span_s) in [("for", order.for_s), ("every", order.every_s)] {
        if let Some(span_s) = span_s {
            text += &format!(" {word} {span_s} s");
        }
    }
    text
}

fn cleared_in_words(cleared: &Cleared) -> String {
    if cleared.ids.is_empty() {
        return "there was nothing to clear".to_owned();
    }
    let (tick, t_ms) = (cleared.tick, cleared.t_ms);
    format!(
        "cleared {} from tick {tick} ({t_ms})",
        cleared.ids.join(", ")
    )
}

/// The faults of a run.
pub fn in_a_table(faults: &[FaultStatus]) -> Table {
    let mut table = table::new(["id", "fault", "phase", "applied", "healed", "hits"]);
    let time = |t_ms: Option<SimTime>| t_ms.map_or_else(|| "–".to_owned(), |t| t.to_string());
    for fault in faults {
        table.add_row([
            fault.id.clone(),
            fault.order.to_string(),
            fault.failed.as_ref().map_or_else(
                || phase(fault.phase).to_owned(),
                |why| format!("failed: {why}"),
            ),
            time(fault.applied_ms),
            time(fault.healed_ms),
            fault.hits.to_string(),
        ]);
    }
    for column in 3..=5 {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table
}

fn phase(phase: Phase) -> &'static str {
    match phase {
        Phase::Armed => "armed",
        Phase::InForce => "in force",
        Phase::Over => "over",
    }
}
