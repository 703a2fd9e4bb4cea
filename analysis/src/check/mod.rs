//! `alliance check`: explains a scenario's parameters before a run.
//!
//! - [`class`]: the class of the scenario in taxonomies of task allocation;
//! - [`forecast`]: times of activation, takeover, yielding and giving up, in closed form;
//! - [`mod@warnings`]: valid parameters that contradict each other;
//! - `show`: the result as a table or as JSON.

pub mod class;
pub mod forecast;
mod show;
pub mod warnings;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use glam::Vec2;
use missions::Registry;
use scenario::{Scenario, Setup, StepOrder};
use terminal::stderr_line;
use world_server::faults::in_vain::in_vain;
use world_server::mission_args::{Known, MissionArgs};
use world_server::size::SizeArgs;

use crate::compare::metrics::Metric;
use crate::compare::primary;
use crate::exit_status;
use class::TaskClass;
use forecast::{Forecast, forecasts};
use warnings::{Warning, warnings};

/// Explain a scenario's parameters and report conflicts
#[derive(Args, Clone, Debug)]
pub struct CheckCommand {
    /// Name of a built-in scenario, or a TOML file
    #[arg(value_name = "SCENARIO|FILE")]
    scenario: Option<String>,
    #[command(flatten)]
    size: SizeArgs,
    /// Parameter file in the thesis' form (Fig. 3.4); overrides the scenario
    #[arg(long, value_name = "FILE")]
    params: Option<PathBuf>,
    /// Print the result as JSON on stdout
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    pub class: TaskClass,
    /// The metric that ranks runs of the scenario in comparisons and searches.
    pub primary: Metric,
    /// One forecast per robot and behavior set, by rank and in catalog order.
    pub forecasts: Vec<Forecast>,
    pub warnings: Vec<Warning>,
    /// Values of the scenario that contradict each other, as `KEY: problem; remedy`.
    pub contradictions: Vec<String>,
}

impl Check {
    /// Explains a setup whose robots start at these positions, by rank, m.
    #[must_use]
    pub fn new(setup: &Setup, starts: &[Vec2]) -> Self {
        let forecasts = forecasts(setup);
        let warnings = warnings(setup, &forecasts);
        Self {
            class: TaskClass::of(&setup.scenario),
            primary: primary::of_scenario(&setup.scenario),
            forecasts,
            warnings,
            contradictions: contradictions(&setup.scenario, starts),
        }
    }
}

/// Returns the contradictions of a scenario, for example work to which no way leads, as lines before a run: the first
/// ones, and the number of the others.
pub fn contradictions_before_run(setup: &Setup) -> anyhow::Result<Vec<String>> {
    let world = Registry::current().worlds().find(&setup.scenario)?;
    let starts = world.start_poses(&setup.scenario)?;
    let starts: Vec<Vec2> = starts.iter().map(|pose| pose.position).collect();
    let mut found = contradictions(&setup.scenario, &starts);
    let more = found.len().saturating_sub(NOTES);
    found.truncate(NOTES);
    if more > 0 {
        found.push(format!(
            "{more} more contradictions; `alliance check` names them"
        ));
    }
    Ok(found)
}

/// The largest number of contradictions that a run names.
const NOTES: usize = 3;

/// Returns values of the scenario that contradict each other or its time limit, and work to which no way leads.
fn contradictions(scenario: &Scenario, starts: &[Vec2]) -> Vec<String> {
    let of_mission = scenario.mission().warnings(scenario, starts);
    in_vain(scenario)
        .into_iter()
        .chain(of_mission)
        .map(|problem| problem.to_string())
        .collect()
}

impl CheckCommand {
    /// Runs the command. Exit status: 0 with or without warnings, 2 for invalid input.
    #[must_use]
    pub fn run(&self, known: &Known) -> ExitCode {
        let checked = self.setup(known).map(|(setup, starts)| {
            let check = Check::new(&setup, &starts);
            if self.json {
                let text = format_args!("{:#}\n", show::json(&setup, &check));
                return terminal::print_result("alliance check", text, ExitCode::SUCCESS);
            }
            stderr_line!("{}", show::text(&setup, &check).trim_end_matches('\n'));
            ExitCode::SUCCESS
        });
        exit_status("check", checked, 2)
    }

    /// Resolves the scenario and the start positions. Other options of a run do not change the result.
    fn setup(&self, known: &Known) -> anyhow::Result<(Setup, Vec<Vec2>)> {
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
        let setup = mission.setup(known)?;
        let world = known.worlds.find(&setup.scenario)?;
        let starts = world.start_poses(&setup.scenario)?;
        let positions = starts.iter().map(|pose| pose.position).collect();
        Ok((setup, positions))
    }
}

#[cfg(test)]
mod tests;
