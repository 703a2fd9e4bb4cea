//! `alliance allocators`: lists the allocators, or the parameters of one.

use std::process::ExitCode;

use analysis::table;
use clap::Args;
use missions::Registry;
use scenario::{AllocatorSpec, name_remedy};
use terminal::stderr_line;

use crate::parameters::blocks;

/// List the allocators, or the parameters of one.
#[derive(Args, Clone, Debug)]
pub struct AllocatorsCommand {
    /// Allocator whose parameters to list
    name: Option<String>,
}

impl AllocatorsCommand {
    /// Prints the list or the description. Exit status 0, or 2 for an unknown name.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let specs = Registry::current().vocabulary().allocators;
        let Some(name) = &self.name else {
            let listed = specs.iter().map(|spec| (spec.name, spec.about));
            return say(table::list(listed));
        };
        if let Some(spec) = specs.iter().find(|spec| spec.name == name) {
            return say(description(spec));
        }
        stderr_line!(
            "alliance allocators: there is no allocator '{name}'; {}",
            name_remedy(name, specs.iter().map(|spec| spec.name))
        );
        ExitCode::from(2)
    }
}

fn say(text: String) -> ExitCode {
    terminal::print_result("alliance allocators", text, ExitCode::SUCCESS)
}

/// Returns the description of an allocator with a block for each parameter.
fn description(spec: &AllocatorSpec) -> String {
    let mut text = format!("{}: {}\n", spec.name, spec.about);
    if spec.name == AllocatorSpec::alliance().name {
        text +=
            "\nIts parameters are in [alliance]; `alliance scenarios reference` explains each.\n";
    } else if spec.parameters.is_empty() {
        text += "\nIt has no parameters.\n";
    } else {
        text += &format!("\n[allocators.{}]\n", spec.name);
    }
    text += &blocks(&spec.parameters);
    text
}
