//! `alliance check`: explains a scenario's parameters before a run.
//!
//! - [`forecast`]: times of activation, takeover, yielding and giving up, in closed form;
//! - [`mod@warnings`]: valid parameters that contradict each other;
//! - `show`: the result as a table or as JSON.

pub mod forecast;
mod show;
pub mod warnings;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use scenario::{Setup, StepOrder};
use terminal::stderr_line;
use world_server::mission_args::{Known, MissionArgs};
use world_server::size::SizeArgs;

use forecast::{Forecast, forecasts};
use warnings::{Warning, warnings};

/// Explain the parameters of a scenario, and warn about contradictions
#[derive(Args, Clone, Debug)]
pub struct CheckCommand {
    /// Scenario: name of a built-in one, or a TOML file
    #[arg(value_name = "SCENARIO|FILE")]
    scenario: Option<String>,
    #[command(flatten)]
    size: SizeArgs,
    /// Parameter file in the thesis' format (Fig. 3.4); its values override the scenario's
    #[arg(long, value_name = "FILE")]
    params: Option<PathBuf>,
    /// Print the result as JSON on stdout
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// One forecast per robot and behavior set, by rank and in catalog order.
    pub forecasts: Vec<Forecast>,
    pub warnings: Vec<Warning>,
}

impl Check {
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        let forecasts = forecasts(setup);
        let warnings = warnings(setup, &forecasts);
        Self {
            forecasts,
            warnings,
        }
    }
}

impl CheckCommand {
    /// Runs the command. Exit status: 0 with or without warnings, 2 for invalid input.
    #[must_use]
    pub fn run(&self, known: &Known) -> ExitCode {
        match self.setup(known) {
            Ok(setup) => {
                let check = Check::new(&setup);
                if self.json {
                    let json = show::json(&setup, &check);
                    let text = format_args!("{json:#}\n");
                    return terminal::print_result("alliance check", text, ExitCode::SUCCESS);
                }
                stderr_line!("{}", show::text(&setup, &check).trim_end_matches('\n'));
                ExitCode::SUCCESS
            }
            Err(error) => {
                stderr_line!("alliance check: {error:#}");
                ExitCode::from(2)
            }
        }
    }

    /// Resolves the scenario. Other options of a run do not change the result.
    fn setup(&self, known: &Known) -> anyhow::Result<Setup> {
        let mission = MissionArgs {
            scenario: self.scenario.clone(),
            size: self.size.clone(),
            seed: 1,
            params: self.params.clone(),
            profile: None,
            step_order: None::<StepOrder>,
            allocator: None,
            limit: None,
        };
        mission.setup(known)
    }
}

#[cfg(test)]
mod tests;
