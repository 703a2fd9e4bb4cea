//! Where is searched: each parameter between two bounds, as a coordinate from 0 to 1.

use serde::{Deserialize, Serialize};
use toml::Value;

use crate::sweep::design::Change;

/// Digits of a value that count: so a scenario file has exactly what was tried, and reads well.
const DIGITS: i32 = 4;

/// Bounds of a parameter, as a plan has them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// The least value.
    pub from: Value,
    /// The greatest.
    pub to: Value,
    /// Whether its logarithm is searched: where bounds span decades.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub log: bool,
    /// The key whose value it is a multiple of: so a rule such as "less than that one" is built in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub times: Option<String>,
}

/// A parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its key in the scenario.
    pub key: String,
    from: f64,
    to: f64,
    log: bool,
    whole: bool,
    /// The place among the parameters of that which it is a multiple of.
    times: Option<usize>,
}

impl Parameter {
    /// One between bounds; `before` are those that it may be a multiple of.
    ///
    /// # Errors
    /// What is wrong with the bounds, and what would be right.
    pub fn new(key: &str, range: &Range, before: &[Self]) -> Result<Self, String> {
        let number = |value: &Value| match value {
            Value::Integer(number) => Some(*number as f64),
            Value::Float(number) if number.is_finite() => Some(*number),
            _ => None,
        };
        let (Some(from), Some(to)) = (number(&range.from), number(&range.to)) else {
            return Err(format!(
                "from {} to {} are no numbers; write {{ from = 1.0, to = 10.0 }}",
                range.from, range.to
            ));
        };
        if from >= to {
            return Err(format!(
                "the lower bound {from} is not below the upper one, {to}; write the lesser one first"
            ));
        }
        if range.log && from <= 0.0 {
            return Err(format!(
                "the lower bound {from} has no logarithm; take one above 0, or leave log out"
            ));
        }
        let times = match &range.times {
            None => None,
            Some(of) => Some(before.iter().position(|it| it.key == *of).ok_or_else(|| {
                format!("it is a multiple of '{of}', which is none of the parameters above it; state that one first")
            })?),
        };
        Ok(Self {
            key: key.to_owned(),
            from,
            to,
            log: range.log,
            whole: range.from.is_integer() && range.to.is_integer(),
            times,
        })
    }

    /// Its bounds, for people.
    #[must_use]
    pub fn bounds(&self, all: &[Self]) -> String {
        let log = if self.log { ", by logarithm" } else { "" };
        let times = match self.times {
            Some(place) => {
                let key = &all[place].key;
                format!(" times its {}", key.rsplit('.').next().unwrap_or(key))
            }
            None => String::new(),
        };
        format!("{} to {}{times}{log}", self.from, self.to)
    }

    /// The value at a coordinate from 0 to 1.
    fn at(&self, coordinate: f64) -> f64 {
        let value = if self.log {
            let (from, to) = (libm::log(self.from), libm::log(self.to));
            libm::exp(from + (to - from) * coordinate)
        } else {
            self.from + (self.to - self.from) * coordinate
        };
        value.clamp(self.from, self.to)
    }
}

/// The values of all parameters at a point, each rounded.
#[must_use]
pub fn values(parameters: &[Parameter], point: &[f64]) -> Vec<f64> {
    let mut values: Vec<f64> = Vec::with_capacity(parameters.len());
    for (parameter, coordinate) in parameters.iter().zip(point) {
        let factor = parameter.times.map_or(1.0, |place| values[place]);
        let value = parameter.at(*coordinate) * factor;
        values.push(if parameter.whole {
            value.round()
        } else {
            rounded(value)
        });
    }
    values
}

/// These values as changes of a scenario.
#[must_use]
pub fn changes(parameters: &[Parameter], values: &[f64]) -> Vec<Change> {
    let each = parameters.iter().zip(values);
    each.map(|(parameter, value)| Change {
        path: parameter.key.split('.').map(str::to_owned).collect(),
        value: if parameter.whole {
            Value::Integer(*value as i64)
        } else {
            Value::Float(*value)
        },
    })
    .collect()
}

/// To [`DIGITS`] significant digits, by its text: 0.1 is 0.1.
fn rounded(value: f64) -> f64 {
    let text = format!("{value:.*e}", DIGITS as usize - 1);
    text.parse().unwrap_or(value)
}

/// A coordinate that lies outside, mirrored at the bounds until it lies inside: a search without bounds meets one with them.
#[must_use]
pub fn folded(coordinate: f64) -> f64 {
    let period = coordinate.rem_euclid(2.0);
    period.min(2.0 - period)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(from: f64, to: f64, log: bool, times: Option<&str>) -> Range {
        Range {
            from: Value::Float(from),
            to: Value::Float(to),
            log,
            times: times.map(str::to_owned),
        }
    }

    #[test]
    fn coordinates_and_values_by_hand() {
        let fast = Parameter::new("a.fast", &range(1.0, 100.0, true, None), &[]).unwrap();
        let slow = range(0.0, 0.5, false, Some("a.fast"));
        let slow = Parameter::new("a.slow", &slow, std::slice::from_ref(&fast)).unwrap();
        let count = Range {
            from: Value::Integer(1),
            to: Value::Integer(4),
            log: false,
            times: None,
        };
        let all = [fast, slow, Parameter::new("b.n", &count, &[]).unwrap()];
        // The middle of the logarithms of 1 and 100 is that of 10; half of 0.5 times 10.
        assert_eq!(values(&all, &[0.5, 0.5, 0.5]), [10.0, 2.5, 3.0]);
        assert_eq!(values(&all, &[0.0, 1.0, 0.0]), [1.0, 0.5, 1.0]);
        assert_eq!(values(&all, &[1.0, 0.0, 1.0]), [100.0, 0.0, 4.0]);
        let thirds = values(&all, &[0.0, 2.0 / 3.0, 1.0]);
        assert_eq!(thirds, [1.0, 0.3333, 4.0]);
        let made = changes(&all, &thirds);
        assert_eq!(made[1].path, ["a", "slow"]);
        assert_eq!(made[2].value, Value::Integer(4));
        assert_eq!(all[1].bounds(&all), "0 to 0.5 times its fast");
    }

    #[test]
    fn what_lies_outside_is_mirrored() {
        let cases = [
            (0.3, 0.3),
            (-0.3, 0.3),
            (1.25, 0.75),
            (2.25, 0.25),
            (-1.5, 0.5),
            (1.0, 1.0),
        ];
        for (outside, inside) in cases {
            assert!((folded(outside) - inside).abs() < 1e-12, "{outside}");
        }
    }

    #[test]
    fn bounds_that_are_none() {
        let said = |range: &Range| Parameter::new("a", range, &[]).unwrap_err();
        assert!(said(&range(5.0, 5.0, false, None)).starts_with("the lower bound 5 is not below"));
        assert!(said(&range(6.0, 5.0, false, None)).starts_with("the lower bound 6 is not below"));
        assert!(said(&range(0.0, 5.0, true, None)).contains("no logarithm"));
        assert!(said(&range(1.0, 5.0, true, Some("b"))).contains("none of the parameters above"));
        let words = Range {
            from: Value::String("low".to_owned()),
            ..range(0.0, 1.0, false, None)
        };
        assert!(said(&words).contains("are no numbers"));
    }
}
