//! The scenario against which orders are checked.

use crate::limits::check_known;
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

    pub(super) fn set(&self, key: impl Into<KeyPath>, set: &str) -> Checked {
        let known = self.catalog.sets.iter().map(|set| set.name.as_str());
        check_known(key, "there is no behavior set", set, known)
    }
}
