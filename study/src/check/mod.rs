//! `alliance check`: what a scenario's parameters mean, before anything runs.
//!
//! - [`forecast`]: when sets activate, take over, yield and give up, in closed form;
//! - [`mod@warnings`]: parameters that do not go together;
//! - `show`: the same as a table for people or JSON for programs.

pub mod forecast;
mod show;
pub mod warnings;

use std::path::PathBuf;
use std::process::ExitCode;

use alliance_proto::scenario::{Setup, StepOrder};
use alliance_proto::{tell, terminal};
use clap::Args;
use world_server::args::{Known, MissionArgs};
use world_server::size::SizeArgs;

use forecast::{Forecast, forecasts};
use warnings::{Warning, warnings};

/// Say what the parameters of a scenario mean, and which of them do not go together.
#[derive(Args, Clone, Debug)]
pub struct CheckCommand {
    /// Scenario: the name of a built-in one, or a TOML file
    #[arg(value_name = "SCENARIO|FILE")]
    scenario: Option<String>,
    #[command(flatten)]
    size: SizeArgs,
    /// Parameter file of the thesis' form (Fig. 3.4); its values beat the scenario's
    #[arg(long, value_name = "FILE")]
    params: Option<PathBuf>,
    /// Print the result as JSON on stdout
    #[arg(long)]
    json: bool,
}

/// Everything that is known of a scenario's parameters before it runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// One per robot and behavior set, by rank and in the catalog's order.
    pub forecasts: Vec<Forecast>,
    /// What does not go together.
    pub warnings: Vec<Warning>,
}

impl Check {
    /// Works it out.
    #[must_use]
    pub fn of(setup: &Setup) -> Self {
        let forecasts = forecasts(setup);
        let warnings = warnings(setup, &forecasts);
        Self {
            forecasts,
            warnings,
        }
    }
}

impl CheckCommand {
    /// Exit status 0, with or without warnings, or 2 for a mistake in scenario or parameters.
    #[must_use]
    pub fn run(&self, known: &Known) -> ExitCode {
        match self.setup(known) {
            Ok(setup) => {
                let check = Check::of(&setup);
                if self.json {
                    let json = show::json(&setup, &check);
                    let text = format_args!("{json:#}\n");
                    return terminal::answer("alliance check", text, ExitCode::SUCCESS);
                }
                tell!("{}", show::text(&setup, &check).trim_end_matches('\n'));
                ExitCode::SUCCESS
            }
            Err(error) => {
                tell!("alliance check: {error:#}");
                ExitCode::from(2)
            }
        }
    }

    /// Nothing that a run takes beside scenario and parameters changes the answer.
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
