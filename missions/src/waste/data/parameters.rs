//! The keys of `[waste]` with their defaults, ranges and descriptions.

use super::check::MAX_ITEMS;
use scenario::ParameterDefault::{Flag, Number, Required, Whole, Words};
use scenario::ParameterRange::{self, Above, Other, Within};
use scenario::ParameterSpec;

pub(super) fn all() -> Vec<ParameterSpec> {
    let length =
        |key, default, about| ParameterSpec::new(key, "m", Number(default), about, Above(0.0, 1e3));
    let fraction =
        |key, default, about| ParameterSpec::new(key, "", default, about, Within(0.0, 1.0));
    let time = |key, default, about| ParameterSpec::new(key, "s", default, about, Above(0.0, 1e9));
    let flag = |key, about| ParameterSpec::new(key, "", Flag(false), about, ParameterRange::Flag);
    let tables = |key, default, about, range| {
        ParameterSpec::new(key, "", Words(default), about, Other(range))
    };
    vec![
        tables(
            "spills",
            "two, top and bottom",
            "the initial spill locations",
            "a list of 1 to 10,000 tables",
        ),
        ParameterSpec::new(
            "spills.name",
            "",
            Required,
            "name of the spill, its task and its behavior set",
            Other("a name"),
        ),
        ParameterSpec::new(
            "spills.items",
            "",
            Whole(12),
            "number of items at the start",
            ParameterRange::Whole(0, i64::from(MAX_ITEMS)),
        ),
        fraction(
            "spills.x_fraction",
            Words("1/3"),
            "center, as a fraction of the room's width",
        ),
        fraction(
            "spills.y_fraction",
            Number(0.5),
            "center, as a fraction of the room's height",
        ),
        length("spill_radius_m", 0.8, "radius of each spill"),
        length(
            "item_radius_m",
            0.05,
            "radius of an item, at most that of a spill",
        ),
        length("deposit.radius_m", 1.0, "radius of each deposit"),
        fraction(
            "deposit.x_fraction",
            Number(0.8),
            "center of the deposit, as a fraction of the room's width",
        ),
        fraction(
            "deposit.y_fraction",
            Number(0.5),
            "center of the deposit, as a fraction of the room's height",
        ),
        tables(
            "further_deposits",
            "none",
            "centers of additional deposits",
            "a list of up to 9,999 tables",
        ),
        length("report_site.width_m", 0.6, "width of the report site"),
        length("report_site.height_m", 3.0, "height of the report site"),
        ParameterSpec::new(
            "report_site.color_s",
            "s",
            Number(5.0),
            "time for which the site shows its changed color after a report",
            Within(0.0, 1e9),
        ),
        time(
            "report_period_s",
            Number(120.0),
            "desired time between two reports",
        ),
        flag(
            "border_known",
            "whether the robots know the border beforehand",
        ),
        flag(
            "respawn",
            "whether delivered items return to a spill (foraging); the run then ends by time only",
        ),
        time(
            "duration_s",
            Words("limit_s"),
            "duration of foraging; requires respawn",
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
    fn all_keys_are_listed_with_their_defaults() {
        let section = section();
        let mut keys = BTreeSet::new();
        for (key, value) in section.as_object().unwrap() {
            let below = value.get(0).unwrap_or(value).as_object();
            let below = below.into_iter().flatten();
            keys.extend(below.map(|(below, _)| format!("{key}.{below}")));
            if !value.is_object() {
                keys.insert(key.clone());
            }
        }
        // Keys of a further deposit need no entry: they state only its place.
        keys.retain(|key| !key.starts_with("further_deposits."));
        let listed: BTreeSet<_> = all().iter().map(|each| each.key.to_owned()).collect();
        assert_eq!(listed, keys);
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
