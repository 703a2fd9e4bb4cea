//! `alliance list scenarios`: the built-in scenarios, or the file of one.

use analysis::table;
use missions::Registry;
use scenario::Scenario;
use scenario::limits::check_known;
use world_server::size::SizeArgs;

/// Returns the list, or the text of one scenario or of a member of a mission's family.
pub fn text(name: Option<&str>, size: &SizeArgs) -> anyhow::Result<String> {
    let vocabulary = Registry::current().vocabulary();
    if let Some(sized) = size.scenario(name, &vocabulary)? {
        return Ok(sized.to_toml()?);
    }
    let Some(name) = name else {
        let listed = vocabulary.builtins().map(|scenario| {
            let description = Scenario::parse(scenario.name, scenario.text, &vocabulary)
                .map_or_else(|error| error.to_string(), |parsed| parsed.description);
            (scenario.name, description)
        });
        return Ok(table::list(listed));
    };
    let names = vocabulary.builtins().map(|scenario| scenario.name);
    check_known((), "no built-in scenario", name, names)?;
    let wanted = vocabulary.builtin(name);
    Ok(wanted.map_or_else(String::new, |scenario| scenario.text.to_owned()))
}
