//! `alliance list missions`: the missions, or the parameters of one.

use analysis::table;
use missions::Registry;
use scenario::limits::check_known;
use scenario::mission::registry::Mission;

use super::parameters::blocks;

/// Returns the list, or the description of one mission.
pub fn text(name: Option<&str>) -> anyhow::Result<String> {
    let missions = Registry::current().vocabulary().missions;
    let Some(name) = name else {
        let listed = missions.iter();
        let listed = listed.map(|mission| (mission.name(), mission.about()));
        return Ok(table::list(listed));
    };
    let names = missions.iter().map(|mission| mission.name());
    check_known((), "there is no mission", name, names)?;
    let wanted = missions.iter().filter(|mission| mission.name() == name);
    Ok(wanted.copied().map(description).collect())
}

/// Returns the description of a mission with a block for each parameter.
fn description(mission: Mission) -> String {
    let (name, about) = (mission.name(), mission.about());
    format!(
        "{name}: {about}\n\n[{name}]\n{}",
        blocks(&mission.parameters())
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_is_described_with_its_default() {
        for mission in Registry::built_in().vocabulary().missions {
            let text = description(mission);
            for parameter in mission.parameters() {
                let line = format!("\n{} = {}", parameter.key, parameter.default);
                assert!(text.contains(&line), "{line}");
                assert!(text.contains(parameter.about), "{line}");
            }
        }
    }
}
