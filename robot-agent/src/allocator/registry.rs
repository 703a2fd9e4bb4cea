//! The allocators and the missions' robot sides that a program knows.

use std::sync::Arc;

use alliance_proto::scenario::{Setup, Vocabulary};
use serde::de::DeserializeOwned;

use super::{Allocator, ConfigError, Kind, Prepared, Typed};
use crate::allocators::alliance::Alliance;
use crate::allocators::ble::Ble;
use crate::allocators::cbba::{Acbba, Cbaa, Cbba};
use crate::allocators::first_come::FirstCome;
use crate::allocators::fixed::Fixed;
use crate::allocators::grape::Grape;
use crate::allocators::lalliance::LAlliance;
use crate::allocators::murdoch::Murdoch;
use crate::allocators::nearest::{Nearest, NearestSilent};
use crate::allocators::oracle::Oracle;
use crate::allocators::random::Random;
use crate::allocators::threshold::Threshold;
use crate::mission::{MissionMind, SharedMission};

/// The allocators and the missions' robot sides that a program knows, by name.
#[derive(Clone, Debug)]
pub struct AgentRegistry {
    kinds: Vec<Arc<dyn Kind>>,
    minds: Vec<Arc<dyn Kind>>,
    missions: Vec<MissionMind>,
}

impl AgentRegistry {
    /// The allocators that come with the simulator, and no mission.
    #[must_use]
    pub fn built_in() -> Self {
        Self {
            kinds: vec![Arc::new(Alliance), Arc::new(LAlliance)],
            minds: Vec::new(),
            missions: Vec::new(),
        }
        .allocator::<Nearest>(
            "nearest",
            "the applicable task of highest utility, whatever the others do",
        )
        .allocator::<NearestSilent>(
            "nearest-silent",
            "the same with the radio off: nothing is said and nothing heard, not even what is known of the mission",
        )
        .allocator::<FirstCome>(
            "first-come",
            "the best task that nobody is heard to execute; kept until a unit of it is done",
        )
        .allocator::<Random>(
            "random",
            "any applicable task, drawn anew from time to time",
        )
        .allocator::<Fixed>(
            "static",
            "the tasks that an assignment before the start gave to the robot",
        )
        .allocator::<Oracle>(
            "oracle",
            "a reference: the best assignment in each step, from the truth that no robot knows",
        )
        .allocator::<Ble>(
            "ble",
            "broadcast of local eligibility: the best pairs of robots and tasks, decided anew by all at once",
        )
        .allocator::<Murdoch>(
            "murdoch",
            "auctions: the best bid of those who are free gets a contract, renewed as long as it answers",
        )
        .allocator::<Cbaa>(
            "cbaa",
            "bids for one task at a time, and agrees by consensus",
        )
        .allocator::<Cbba>(
            "cbba",
            "bids for a bundle of tasks, and agrees by consensus",
        )
        .allocator::<Acbba>("acbba", "as cbba, but only what has changed is said")
        .allocator::<Grape>(
            "grape",
            "moves to the coalition of most use to it, until nobody wants to move",
        )
        .allocator::<Threshold>(
            "threshold",
            "draws tasks, the more readily the longer they are due and the more it has done of them",
        )
    }

    /// With one more, or another one under that name.
    #[must_use]
    pub fn allocator<A: Allocator>(self, name: &'static str, about: &'static str) -> Self
    where
        A::Config: DeserializeOwned,
    {
        self.kind(Arc::new(Typed::<A>::new(name, about)))
    }

    /// The same of one that is no type of its own, such as a rule in another language.
    #[must_use]
    pub fn kind(mut self, kind: Arc<dyn Kind>) -> Self {
        let name = kind.spec().name;
        self.kinds.retain(|known| known.spec().name != name);
        self.kinds.push(kind);
        self
    }

    /// With a mind that scenarios otherwise take for a [program of its own](alliance_proto::scenario::Robot::mind), or another one under
    /// that name. It is no allocator that a scenario could choose.
    #[must_use]
    pub fn mind(mut self, kind: Arc<dyn Kind>) -> Self {
        let name = kind.spec().name;
        self.minds.retain(|known| known.spec().name != name);
        self.minds.push(kind);
        self
    }

    /// Whether it has the mind of that name.
    #[must_use]
    pub fn has_mind(&self, name: &str) -> bool {
        self.minds.iter().any(|known| known.spec().name == name)
    }

    /// With one more mission, or another one under that name.
    #[must_use]
    pub fn mission(mut self, mind: MissionMind) -> Self {
        self.missions.retain(|known| known.data != mind.data);
        self.missions.push(mind);
        self
    }

    /// What scenarios may say of them: all, in the order in which they were added.
    #[must_use]
    pub fn vocabulary(&self) -> Vocabulary {
        Vocabulary {
            missions: self.missions.iter().map(|mind| mind.data).collect(),
            allocators: self.kinds.iter().map(|kind| kind.spec()).collect(),
        }
    }

    /// The mind of that name, for a run.
    ///
    /// # Errors
    /// When there is none, or it does not fit to the run.
    pub fn prepare_mind(
        &self,
        name: &str,
        setup: &Setup,
    ) -> Result<Arc<dyn Prepared>, ConfigError> {
        let kind = self.minds.iter().find(|kind| kind.spec().name == name);
        let unknown = || ConfigError {
            subject: format!("mind '{name}'"),
            why: "this program does not have it".to_owned(),
        };
        kind.ok_or_else(unknown)?.prepare(setup)
    }

    /// The allocator of that name, with the parameters of a run.
    ///
    /// # Errors
    /// When there is none, or the parameters are not such as it takes.
    pub fn prepare(&self, name: &str, setup: &Setup) -> Result<Arc<dyn Prepared>, ConfigError> {
        let kind = self.kinds.iter().find(|kind| kind.spec().name == name);
        let unknown = || {
            let names: Vec<_> = self
                .vocabulary()
                .allocators
                .iter()
                .map(|it| it.name)
                .collect();
            ConfigError {
                subject: format!("allocators.{name}"),
                why: format!("there is no such allocator; there are {}", names.join(", ")),
            }
        };
        kind.ok_or_else(unknown)?.prepare(setup)
    }

    /// What the robots of a run have in common for its mission.
    ///
    /// # Errors
    /// When there is no robot side of it.
    pub fn shared(&self, setup: &Setup) -> Result<Arc<dyn SharedMission>, ConfigError> {
        let mission = setup.catalog.mission;
        let mind = self.missions.iter().find(|known| known.data == mission);
        let mind = mind.ok_or_else(|| {
            let names: Vec<_> = self.missions.iter().map(|it| it.data.name()).collect();
            ConfigError {
                subject: format!("mission {}", mission.name()),
                why: format!("there is no such mission; there are {}", names.join(", ")),
            }
        })?;
        Ok((mind.shared)(setup))
    }
}
