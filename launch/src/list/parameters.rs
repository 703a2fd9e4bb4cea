//! Text descriptions of the parameters of allocators and missions.

use scenario::{ParameterDefault, ParameterSpec};

/// Returns a block for each parameter: key, default and unit, then the meaning and the range. The unit is omitted for a default in words.
pub fn blocks(parameters: &[ParameterSpec]) -> String {
    let mut text = String::new();
    for parameter in parameters {
        let unit = match parameter.default {
            ParameterDefault::Required | ParameterDefault::Words(_) => String::new(),
            _ => format!(" {}", parameter.unit),
        };
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
