//! `alliance list allocators`: the allocators, or the parameters of one.

use analysis::table;
use anyhow::bail;
use clap::Args;
use missions::Registry;
use scenario::{AllocatorSpec, name_remedy};

use super::parameters::blocks;

/// List the allocators, or the parameters of one
#[derive(Args, Clone, Debug, Default)]
pub struct AllocatorsCommand {
    /// Allocator whose parameters to list
    #[arg(value_name = "ALLOCATOR")]
    allocator: Option<String>,
}

impl AllocatorsCommand {
    /// Returns the list or the description.
    pub fn text(&self) -> anyhow::Result<String> {
        let specs = Registry::current().vocabulary().allocators;
        let Some(name) = &self.allocator else {
            let listed = specs.iter().map(|spec| (spec.name, spec.about));
            return Ok(table::list(listed));
        };
        match specs.iter().find(|spec| spec.name == name) {
            Some(spec) => Ok(description(spec)),
            None => bail!(
                "there is no allocator '{name}'; {}",
                name_remedy(name, specs.iter().map(|spec| spec.name))
            ),
        }
    }
}

/// Returns the description of an allocator with a block for each parameter.
fn description(spec: &AllocatorSpec) -> String {
    let mut text = format!("{}: {}\n", spec.name, spec.about);
    if spec.name == AllocatorSpec::alliance().name {
        text += "\nIts parameters are in [alliance]; `alliance list scenarios reference` explains each.\n";
    } else if spec.parameters.is_empty() {
        text += "\nIt has no parameters.\n";
    } else {
        text += &format!("\n[allocators.{}]\n", spec.name);
    }
    text += &blocks(&spec.parameters);
    text
}
