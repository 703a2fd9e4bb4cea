//! The names of a run, which stand in its tables.

use std::sync::Arc;

use alliance_proto::ids::{BehaviorId, RobotId, TaskId};
use alliance_proto::scenario::{Catalog, Roster, Setup};
use alliance_proto::team::BroadcastKind;

/// The names that stand in the tables for the ids of a run.
#[derive(Clone, Debug)]
pub(super) struct Names {
    pub roster: Arc<Roster>,
    catalog: Arc<Catalog>,
    bulletins: [&'static str; 2],
}

impl Names {
    pub fn of(setup: &Setup) -> Self {
        Self {
            roster: Arc::clone(&setup.roster),
            catalog: Arc::clone(&setup.catalog),
            bulletins: setup.catalog.mission.terms().bulletins,
        }
    }

    /// Name of a robot of the scenario.
    pub fn robot(&self, robot: RobotId) -> &str {
        self.roster.name(robot)
    }

    /// Names by rank.
    pub fn robots(&self) -> impl Iterator<Item = &str> {
        self.roster.names()
    }

    pub fn broadcast(&self, kind: BroadcastKind) -> &'static str {
        kind.name(self.bulletins)
    }

    pub fn set(&self, set: Option<BehaviorId>) -> &str {
        set.map_or("", |set| self.catalog.behavior_name(set))
    }

    pub fn task(&self, task: Option<TaskId>) -> &str {
        task.map_or("", |task| self.catalog.task_name(task))
    }

    /// The task of a behavior set.
    pub fn task_of(&self, set: BehaviorId) -> &str {
        self.task(self.catalog.sets.get(set.index()).map(|set| set.task))
    }
}
