//! The scenario against which orders are checked.

use crate::limits::{MAX_BURST_ROBOTS, check_known};
use crate::{Catalog, KeyPath, Problem, Scenario};

pub(super) type Checked = Result<(), Problem>;

/// A scenario against which orders are checked.
pub struct Checker<'s> {
    pub(super) scenario: &'s Scenario,
    pub(super) catalog: &'s Catalog,
}

impl Checker<'_> {
    pub(super) fn robot(&self, key: impl Into<KeyPath>, robot: &str) -> Checked {
        self.scenario.find_robot(key, robot).map(|_| ())
    }

    /// Checks that the team is small enough for bursts of losses, which need memory for each link.
    pub(super) fn bursts(&self, field: impl Into<KeyPath>) -> Checked {
        let robots = self.scenario.robots.len();
        if robots <= MAX_BURST_ROBOTS {
            return Ok(());
        }
        let what = format!("bursts of losses among {robots} robots need too much memory");
        let remedy = format!("use independent losses, or at most {MAX_BURST_ROBOTS} robots");
        Err(Problem::at(field, what, remedy))
    }

    pub(super) fn set(&self, key: impl Into<KeyPath>, set: &str) -> Checked {
        let known = self.catalog.sets.iter().map(|set| set.name.as_str());
        check_known(key, "there is no behavior set", set, known)
    }
}
