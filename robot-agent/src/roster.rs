//! Who takes part in a run, and what there is to do.

use std::collections::BTreeMap;

use alliance_proto::ids::RobotId;
use alliance_proto::scenario::{Catalog, Scenario};

/// Names and ids: the same for all robots of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Roster {
    /// Tasks and behavior sets.
    pub catalog: Catalog,
    ranks: BTreeMap<String, RobotId>,
}

impl Roster {
    /// The roster of a scenario.
    #[must_use]
    pub fn of(scenario: &Scenario) -> Self {
        let names = scenario.robots.iter().map(|robot| robot.name.clone());
        Self {
            catalog: Catalog::of(scenario),
            ranks: names.zip((0..).map(RobotId)).collect(),
        }
    }

    /// The robot of that name.
    #[must_use]
    pub fn rank_of(&self, name: &str) -> Option<RobotId> {
        self.ranks.get(name).copied()
    }
}
