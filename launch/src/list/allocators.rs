//! `alliance list allocators`: the allocators, or the parameters of one.

use analysis::table;
use missions::Registry;
use scenario::AllocatorSpec;
use scenario::limits::check_known;

use super::parameters::blocks;

/// Returns the list, or the description of one allocator.
pub fn text(name: Option<&str>) -> anyhow::Result<String> {
    let specs = Registry::current().vocabulary().allocators;
    let Some(name) = name else {
        let listed = specs.iter().map(|spec| (spec.name, spec.about));
        return Ok(table::list(listed));
    };
    let names = specs.iter().map(|spec| spec.name);
    check_known((), "there is no allocator", name, names)?;
    let wanted = specs.iter().filter(|spec| spec.name == name);
    Ok(wanted.map(description).collect())
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
