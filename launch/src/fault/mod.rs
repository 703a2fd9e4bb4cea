//! `alliance fault`: injects, lists and clears faults in a live run.

mod command;
#[cfg(test)]
mod tests;
mod timing;

use std::process::ExitCode;

use analysis::table;
use clap::{Args, Subcommand};
use comfy_table::Table;
use proto::control::{Armed, Cleared, ControlCommand, FaultStatus, Phase, Reply, schema};
use scenario::Problem;
use scenario::fault::Order;
use scenario::time::SimTime;
use terminal::{fail, stderr_line};

use crate::control::{ControlArgs, print, unexpected};

pub(crate) use command::examples_of;

/// Inject, list and clear faults in a live run
#[derive(Args, Clone, Debug)]
#[command(arg_required_else_help = true)]
pub struct FaultArgs {
    #[command(subcommand)]
    action: Option<Action>,
    #[command(flatten)]
    control: ControlArgs,
    /// Print the JSON Schema of control requests, and of replies (key `reply`)
    #[arg(long)]
    schema: bool,
}

#[derive(Subcommand, Clone, Debug)]
enum Action {
    /// List the faults of the run
    List,
    /// Clear or disarm a fault, or all faults
    Clear {
        /// Id of the fault [default: all]
        id: Option<String>,
    },
    #[command(flatten)]
    Order(Box<command::FaultCommand>),
}

impl FaultArgs {
    /// Executes the command. Exit status 0, 2 for a mistake in the arguments or a refused order, 3 if no run is live or none answers.
    #[must_use]
    pub fn run(self) -> ExitCode {
        if self.schema && self.action.is_none() {
            return match print(&schema()) {
                Ok(()) => ExitCode::SUCCESS,
                Err(error) => fail("alliance fault", &error, 3),
            };
        }
        let command = match self.action {
            Some(Action::List) => Ok(ControlCommand::List),
            Some(Action::Clear { id }) => Ok(ControlCommand::Clear(id)),
            Some(Action::Order(order)) => order.into_order().map(ControlCommand::Fault),
            None => Err(Problem::of_value("a fault, list or clear is required", "")),
        };
        match command {
            // The schema is printed alone, so that it can be stored.
            Ok(_) if self.schema => refuse("--schema cannot be combined with a command"),
            Ok(ControlCommand::Fault(order)) => {
                let acknowledged = order.clone();
                self.control
                    .send_command(
                        "fault",
                        ControlCommand::Fault(order),
                        move |reply| match reply {
                            Reply::Armed(armed) => acknowledge(armed, &acknowledged),
                            other => unexpected(other),
                        },
                    )
            }
            Ok(command) => self
                .control
                .send_command("fault", command, |reply| match reply {
                    Reply::Cleared(cleared) => cleared_in_words(cleared),
                    Reply::Faults(faults) if faults.is_empty() => "no faults".to_owned(),
                    Reply::Faults(faults) => in_a_table(faults).trim_fmt(),
                    other => unexpected(other),
                }),
            Err(problem) => refuse(&problem.to_string()),
        }
    }
}

fn refuse(why: &str) -> ExitCode {
    stderr_line!("alliance fault: {why}; try --help");
    ExitCode::from(2)
}

/// Returns the acknowledgement of a fault, such as "f3: kill gold from tick 1234 (61.700 s)".
fn acknowledge(armed: &Armed, order: &Order) -> String {
    let begins = if order.fault.is_instantaneous() {
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
        return "no faults to clear".to_owned();
    }
    let (tick, t_ms) = (cleared.tick, cleared.t_ms);
    format!(
        "cleared {} from tick {tick} ({t_ms})",
        cleared.ids.join(", ")
    )
}

/// Returns a table of the faults of a run.
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
    table::align_right(&mut table, 3..=5);
    table
}

fn phase(phase: Phase) -> &'static str {
    match phase {
        Phase::Armed => "armed",
        Phase::InForce => "in force",
        Phase::Over => "over",
    }
}
