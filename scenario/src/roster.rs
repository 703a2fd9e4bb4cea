//! The robots of a run by name and by id.

use std::collections::BTreeMap;

use super::Robot;
use crate::ids::RobotId;

/// The robots of a run: names in the order of ranks, and ids by name.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Roster {
    names: Vec<String>,
    ids: BTreeMap<String, RobotId>,
}

impl Roster {
    /// Creates the roster of a team, given in rank order.
    #[must_use]
    pub fn new(robots: &[Robot]) -> Self {
        let names: Vec<String> = robots.iter().map(|robot| robot.name.clone()).collect();
        Self {
            ids: names.iter().cloned().zip((0..).map(RobotId)).collect(),
            names,
        }
    }

    #[must_use]
    pub fn find(&self, name: &str) -> Option<RobotId> {
        self.ids.get(name).copied()
    }

    /// Returns the name of a robot of this roster.
    #[must_use]
    pub fn name(&self, robot: RobotId) -> &str {
        self.names.get(robot.index()).map_or("?", String::as_str)
    }

    pub fn names(&self) -> impl ExactSizeIterator<Item = &str> + Clone {
        self.names.iter().map(String::as_str)
    }
}
