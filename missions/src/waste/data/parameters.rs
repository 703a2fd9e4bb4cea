//! The keys of `[waste]` with their defaults, ranges and descriptions.

use super::check::MAX_ITEMS;
use scenario::ParameterDefault::{Flag, Number, Required, Whole, Words};
use scenario::{ParameterRange, ParameterSpec};

const LENGTH: ParameterRange = ParameterRange::Above(0.0, 1e3);
const FRACTION: ParameterRange = ParameterRange::Within(0.0, 1.0);

pub(super) fn all() -> Vec<ParameterSpec> {
    let items = i64::from(MAX_ITEMS);
    vec![
        ParameterSpec::new(
            "spills",
            "",
            Words("two, top and bottom"),
            "the initial spill locations",
            ParameterRange::Other("a list of 1 to 10,000 tables"),
        ),
        ParameterSpec::new(
            "spills.name",
            "",
            Required,
            "name of the spill, its task and its behavior set",
            ParameterRange::Other("a name"),
        ),
        ParameterSpec::new(
            "spills.items",
            "",
            Whole(12),
            "number of items at the start",
            ParameterRange::Whole(0, items),
        ),
        ParameterSpec::new(
            "spills.x_fraction",
            "",
            Words("1/3"),
            "center, as a fraction of the room's width",
            FRACTION,
        ),
        ParameterSpec::new(
            "spills.y_fraction",
            "",
            Number(0.5),
            "center, as a fraction of the room's height",
            FRACTION,
        ),
        ParameterSpec::new(
            "spill_radius_m",
            "m",
            Number(0.8),
            "radius of each spill",
            LENGTH,
        ),
        ParameterSpec::new(
            "item_radius_m",
            "m",
            Number(0.05),
            "radius of an item, at most that of a spill",
            LENGTH,
        ),
        ParameterSpec::new(
            "deposit.radius_m",
            "m",
            Number(1.0),
            "radius of each deposit",
            LENGTH,
        ),
        ParameterSpec::new(
            "deposit.x_fraction",
            "",
            Number(0.8),
            "center of the deposit, as a fraction of the room's width",
            FRACTION,
        ),
        ParameterSpec::new(
            "deposit.y_fraction",
            "",
            Number(0.5),
            "center of the deposit, as a fraction of the room's height",
            FRACTION,
        ),
        ParameterSpec::new(
            "further_deposits",
            "",
            Words("none"),
            "centers of additional deposits",
            ParameterRange::Other("a list of up to 9,999 tables"),
        ),
        ParameterSpec::new(
            "report_site.width_m",
            "m",
            Number(0.6),
            "width of the report site",
            LENGTH,
        ),
        ParameterSpec::new(
            "report_site.height_m",
            "m",
            Number(3.0),
            "height of the report site",
            LENGTH,
        ),
        ParameterSpec::new(
            "report_site.color_s",
            "s",
            Number(5.0),
            "time for which the site shows its changed color after a report",
            ParameterRange::Within(0.0, 1e9),
        ),
        ParameterSpec::new(
            "report_period_s",
            "s",
            Number(120.0),
            "desired time between two reports",
            ParameterRange::Above(0.0, 1e9),
        ),
        ParameterSpec::new(
            "border_known",
            "",
            Flag(false),
            "whether the robots know the border beforehand",
            ParameterRange::Flag,
        ),
        ParameterSpec::new(
            "respawn",
            "",
            Flag(false),
            "whether delivered items return to a spill (foraging); the run then ends by time only",
            ParameterRange::Flag,
        ),
        ParameterSpec::new(
            "duration_s",
            "s",
            Words("limit_s"),
            "duration of foraging; requires respawn",
            ParameterRange::Above(0.0, 1e9),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use serde_json::Value;

    use super::*;
    use crate::waste::data::{Spill, Spot, WasteSection};

    /// Returns `[waste]` with every key set.
    fn section() -> Value {
        let section = WasteSection {
            spills: vec![Spill::default()],
            further_deposits: vec![Spot {
                x_fraction: 0.0,
                y_fraction: 0.0,
            }],
            border_known: true,
            respawn: true,
            duration_s: Some(600.0),
            ..WasteSection::default()
        };
        serde_json::to_value(section).unwrap()
    }

    #[test]
    fn all_keys_are_listed() {
        let mut keys = BTreeSet::new();
        for (key, value) in section().as_object().unwrap() {
            let below = value.get(0).unwrap_or(value).as_object();
            keys.extend(
                below
                    .into_iter()
                    .flatten()
                    .map(|(below, _)| format!("{key}.{below}")),
            );
            if !value.is_object() {
                keys.insert(key.clone());
            }
        }
        // Keys of a further deposit need no entry: they state only its place.
        keys.retain(|key| !key.starts_with("further_deposits."));
        let listed: BTreeSet<String> = all()
            .iter()
            .map(|parameter| parameter.key.to_owned())
            .collect();
        assert_eq!(listed, keys);
    }

    #[test]
    fn listed_defaults_match_the_section() {
        let section = section();
        for parameter in all() {
            let steps = parameter.key.split('.');
            let in_force = steps.fold(&section, |value, key| &value.get(0).unwrap_or(value)[key]);
            match parameter.default {
                Number(number) => assert_eq!(in_force.as_f64().unwrap() as f32, number as f32),
                Whole(number) => assert_eq!(in_force.as_i64(), Some(number)),
                _ => {}
            }
        }
    }
}
