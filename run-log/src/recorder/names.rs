//! The names of a run's ids, as its tables contain them.

use std::sync::Arc;

use proto::team::BroadcastKind;
use proto::telemetry::NoteKind;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::mission::data::MissionVocabulary;
use scenario::{Catalog, Roster, Setup};

#[derive(Clone, Debug)]
pub(super) struct Names {
    pub roster: Arc<Roster>,
    catalog: Arc<Catalog>,
    vocabulary: MissionVocabulary,
}

impl Names {
    pub fn of(setup: &Setup) -> Self {
        Self {
            roster: Arc::clone(&setup.roster),
            catalog: Arc::clone(&setup.catalog),
            vocabulary: setup.catalog.mission.vocabulary(),
        }
    }

    pub fn robot(&self, robot: RobotId) -> &str {
        self.roster.name(robot)
    }

    /// Returns the name of a robot whose number can be wrong, because another program sent it.
    pub fn known_robot(&self, robot: RobotId) -> &str {
        self.roster.names().nth(robot.index()).unwrap_or("?")
    }

    pub fn robots(&self) -> impl Iterator<Item = &str> {
        self.roster.names()
    }

    pub fn broadcast(&self, kind: BroadcastKind) -> &'static str {
        kind.name(self.vocabulary.bulletins)
    }

    pub fn note(&self, kind: NoteKind) -> &'static str {
        kind.as_str(self.vocabulary.notes)
    }

    pub fn set(&self, set: Option<BehaviorId>) -> &str {
        set.map_or("", |set| self.catalog.behavior_name(set))
    }

    pub fn task(&self, task: Option<TaskId>) -> &str {
        task.map_or("", |task| self.catalog.task_name(task))
    }

    pub fn task_of(&self, set: BehaviorId) -> &str {
        self.task(self.catalog.sets.get(set.index()).map(|set| set.task))
    }
}
