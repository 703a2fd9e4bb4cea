//! Parameters of allocators and missions, for people.

use alliance_proto::scenario::ParameterSpec;

/// A block for each: key, default and unit, and below it what it means and what it may be.
pub fn blocks(parameters: &[ParameterSpec]) -> String {
    let mut text = String::new();
    for parameter in parameters {
        let unit = format!(" {}", parameter.unit);
        text += &format!(
            "{} = {}{}\n    {}; {}\n",
            parameter.key,
            parameter.default,
            unit.trim_end(),
            parameter.about,
            parameter.range
        );
    }
    text
}
