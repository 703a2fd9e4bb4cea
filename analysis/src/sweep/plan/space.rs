//! The search space: each parameter between two bounds, as a coordinate from 0 to 1.

use scenario::Problem;
use serde::{Deserialize, Serialize};
use toml::Value;

use crate::columns::rounded;
use crate::sweep::design::Change;

/// The number of significant digits of a value, so that a scenario file contains exactly the tried value.
const DIGITS: usize = 4;

/// The share of a parameter's range within which a value counts as at a bound.
const BOUND_SHARE: f64 = 0.02;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    pub from: Value,
    pub to: Value,
    /// Uses the logarithm in the search; for bounds that span decades.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub log: bool,
    /// The key that this value is a multiple of. It enforces relations such as "less than that key".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub times: Option<String>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    pub key: String,
    from: f64,
    to: f64,
    log: bool,
    whole: bool,
    /// The index of the parameter that this one is a multiple of.
    times: Option<usize>,
}

impl Parameter {
    /// Creates a parameter. `before` contains the parameters that it may be a multiple of.
    ///
    /// # Errors
    /// Returns the problem with the bounds and its remedy.
    pub fn new(key: &str, range: &Range, before: &[Self]) -> Result<Self, Problem> {
        let problem = |what: String, remedy| Problem::of_value(what, remedy);
        let number = |value: &Value| match value {
            Value::Integer(number) => Some(*number as f64),
            Value::Float(number) if number.is_finite() => Some(*number),
            _ => None,
        };
        let (Some(from), Some(to)) = (number(&range.from), number(&range.to)) else {
            let what = format!("from {} to {} are not numbers", range.from, range.to);
            return Err(problem(what, "write { from = 1.0, to = 10.0 }"));
        };
        if from >= to {
            let what = format!("the lower bound {from} is not below the upper one, {to}");
            return Err(problem(what, "write the smaller bound first"));
        }
        if range.log && from <= 0.0 {
            let what = format!("the lower bound {from} has no logarithm");
            return Err(problem(what, "take a bound above 0, or remove log"));
        }
        let times = match &range.times {
            None => None,
            Some(of) => {
                let place = before.iter().position(|parameter| parameter.key == *of);
                let what = || {
                    format!("it is a multiple of '{of}', which is none of the parameters above it")
                };
                Some(place.ok_or_else(|| problem(what(), "write that one first"))?)
            }
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

    #[must_use]
    pub fn bounds(&self, all: &[Self]) -> String {
        let log = if self.log { ", logarithmic" } else { "" };
        let times = match self.times {
            Some(place) => {
                let key = &all[place].key;
                format!(" times its {}", key.rsplit('.').next().unwrap_or(key))
            }
            None => String::new(),
        };
        format!("{} to {}{times}{log}", self.from, self.to)
    }

    /// Returns a note if a value is so near to a bound that a better one may lie beyond it. `values` are those of all
    /// parameters, and this one is at `place`.
    #[must_use]
    pub fn bound_reached(&self, values: &[f64], place: usize) -> Option<&'static str> {
        let factor = self.times.map_or(1.0, |place| values[place]);
        let range = [self.from, self.to].map(|bound| bound * factor);
        let scale = |value: f64| if self.log { libm::log(value) } else { value };
        let [from, value, to] = [range[0], values[place], range[1]].map(scale);
        let share = (value - from) / (to - from);
        if share <= BOUND_SHARE {
            Some("at its lower bound")
        } else if share >= 1.0 - BOUND_SHARE {
            Some("at its upper bound")
        } else {
            None
        }
    }

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

#[must_use]
pub fn values(parameters: &[Parameter], point: &[f64]) -> Vec<f64> {
    let mut values: Vec<f64> = Vec::with_capacity(parameters.len());
    for (parameter, coordinate) in parameters.iter().zip(point) {
        let factor = parameter.times.map_or(1.0, |place| values[place]);
        let value = parameter.at(*coordinate) * factor;
        values.push(if parameter.whole {
            value.round()
        } else {
            rounded(value, DIGITS)
        });
    }
    values
}

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

/// Reflects a coordinate at the bounds until it lies inside, so that an unbounded search respects them.
#[must_use]
pub fn reflected(coordinate: f64) -> f64 {
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
    fn values_match_hand_calculation() {
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
        // The mean of the logarithms of 1 and 100 is that of 10; half of 0.5 times 10.
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
    fn a_value_at_a_bound_is_noted() {
        let fast = Parameter::new("a.fast", &range(1.0, 60.0, true, None), &[]).unwrap();
        let slow = range(0.0, 0.5, false, Some("a.fast"));
        let slow = Parameter::new("a.slow", &slow, std::slice::from_ref(&fast)).unwrap();
        let notes = |values: [f64; 2]| {
            [
                fast.bound_reached(&values, 0),
                slow.bound_reached(&values, 1),
            ]
        };
        let (low, high) = (Some("at its lower bound"), Some("at its upper bound"));
        assert_eq!(notes([59.41, 10.0]), [high, None]);
        assert_eq!(notes([50.0, 24.8]), [None, high]);
        assert_eq!(notes([1.05, 0.0]), [low, low]);
        // A zero factor leaves no range.
        assert_eq!(notes([0.0, 0.0])[1], None);
    }

    #[test]
    fn coordinates_outside_are_reflected() {
        let cases = [
            (0.3, 0.3),
            (-0.3, 0.3),
            (1.25, 0.75),
            (2.25, 0.25),
            (-1.5, 0.5),
            (1.0, 1.0),
        ];
        for (outside, inside) in cases {
            assert!((reflected(outside) - inside).abs() < 1e-12, "{outside}");
        }
    }

    #[test]
    fn words_are_no_bounds() {
        let words = Range {
            from: Value::String("low".to_owned()),
            ..range(0.0, 1.0, false, None)
        };
        let error = Parameter::new("a", &words, &[]).unwrap_err().to_string();
        assert!(error.contains("are not numbers"), "{error}");
    }
}
