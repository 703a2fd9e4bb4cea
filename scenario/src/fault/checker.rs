//! The scenario against which orders are checked, and the errors of checks.

use crate::limits::readable;
use crate::{Catalog, Scenario, name_remedy};

/// The longest time, s, as in scenario files.
pub(super) const LONGEST_S: f64 = 1e9;

/// The farthest place and the largest size, m, as in scenario files.
pub(super) const FARTHEST_M: f64 = 1e3;

/// An order that is not valid. It displays as one line: field, problem and remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: {problem}; {remedy}", field.join("."))]
pub struct OrderError {
    /// The path to the value, from the order down.
    pub field: Vec<String>,
    /// The problem with the value.
    pub problem: String,
    /// A remedy for the problem.
    pub remedy: String,
}

pub(super) type Checked = Result<(), OrderError>;

/// A scenario against which orders are checked.
pub struct Checker<'s> {
    pub(super) scenario: &'s Scenario,
    pub(super) catalog: &'s Catalog,
}

impl Checker<'_> {
    pub(super) fn robot(&self, field: &[&str], robot: &str) -> Checked {
        let mut known = self.scenario.robots.iter().map(|robot| robot.name.as_str());
        if known.clone().any(|name| name == robot) {
            return Ok(());
        }
        let what = format!("the scenario has no robot '{robot}'");
        Err(wrong(field, what, &name_remedy(robot, &mut known)))
    }

    pub(super) fn set(&self, field: &[&str], set: &str) -> Checked {
        let mut known = self.catalog.sets.iter().map(|set| set.name.as_str());
        if known.clone().any(|name| name == set) {
            return Ok(());
        }
        let what = format!("there is no behavior set '{set}'");
        Err(wrong(field, what, &name_remedy(set, &mut known)))
    }
}

pub(super) fn share(field: &[&str], value: impl Into<f64>) -> Checked {
    within(field, value, 0.0, 1.0, "")
}

pub(super) fn above_zero(field: &[&str], value: impl Into<f64>, to: f64, unit: &str) -> Checked {
    let value = value.into();
    if value > 0.0 && value <= to {
        return Ok(());
    }
    let remedy = format!("it must be above 0 and at most {to} {unit}");
    Err(wrong(
        field,
        format!("{value} is out of range"),
        remedy.trim_end(),
    ))
}

pub(super) fn within(
    field: &[&str],
    value: impl Into<f64>,
    from: f64,
    to: f64,
    unit: &str,
) -> Checked {
    let value = value.into();
    if (from..=to).contains(&value) {
        return Ok(());
    }
    let (from, to) = (readable(from), readable(to));
    let remedy = format!("it must be at least {from} and at most {to} {unit}");
    Err(wrong(
        field,
        format!("{} is out of range", readable(value)),
        remedy.trim_end(),
    ))
}

pub(super) fn wrong(field: &[&str], what: String, remedy: &str) -> OrderError {
    OrderError::at(field, what, remedy)
}

impl OrderError {
    /// Creates an error at a field of the order.
    #[must_use]
    pub fn at(field: &[&str], what: String, remedy: &str) -> Self {
        Self {
            field: field.iter().map(|key| (*key).to_owned()).collect(),
            problem: what,
            remedy: remedy.to_owned(),
        }
    }
}
