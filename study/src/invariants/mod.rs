//! What must hold in every run, whatever goes wrong in it: looked at after every tick, from outside.
//!
//! - [`WorldState`] is what there is to look at. The checks know neither the world's code nor the agents', only what both say.
//! - [`items`]: each is in one place, and none comes or goes. [`solids`]: bodies overlap nothing solid. [`numbers`]: all are finite
//!   and in their range. [`activity`]: a robot does one thing at a time. [`exclusive`]: two robots that hear each other, as
//!   [`hearing`] says, do not go on with one exclusive task. [`termination`]: a mission that is covered, as [`coverage`] and
//!   [`strewn`] say, ends. [`replayed`]: a run from its inputs is the same run.

pub mod activity;
pub mod coverage;
pub mod exclusive;
pub mod hearing;
pub mod items;
pub mod numbers;
pub mod replayed;
pub mod solids;
pub mod strewn;
pub mod termination;
#[cfg(test)]
mod tests;
mod world_state;

use std::fmt;

use alliance_proto::ids::Tick;
use alliance_proto::scenario::Setup;
use world_server::simulation::Simulation;

use exclusive::Exclusive;
use items::Items;
use solids::Solids;
use termination::Termination;
pub use world_state::{Item, Rectangle, RobotState, WorldState, is_delivered};

/// Something that must hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Invariant {
    /// Every tick ends, and the next one follows.
    TicksGoOn,
    /// Every item is in one place; only faults add any, and where they are to be brought they stay.
    ItemsAccountedFor,
    /// No body overlaps anything solid, but for an obstacle that was put on it.
    NoOverlap,
    /// Every number is finite and in its range.
    NumbersInRange,
    /// A robot has one active behavior set at most.
    OneActiveBehavior,
    /// What the mission itself says must hold.
    MissionHolds,
    /// Two robots that hear each other do not both go on with an exclusive task.
    ExclusiveTasks,
    /// A mission that is covered ends (ALLIANCE.md §5).
    Termination,
    /// A run from its inputs is the same run.
    ReplayIdentical,
}

impl fmt::Display for Invariant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TicksGoOn => "ticks go on",
            Self::ItemsAccountedFor => "items accounted for",
            Self::NoOverlap => "no overlap",
            Self::NumbersInRange => "numbers in range",
            Self::OneActiveBehavior => "one active set",
            Self::MissionHolds => "mission holds",
            Self::ExclusiveTasks => "exclusive tasks",
            Self::Termination => "termination",
            Self::ReplayIdentical => "replay identical",
        })
    }
}

/// What did not hold, in one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{invariant}: tick {tick}: {what}")]
pub struct Violation {
    /// Which invariant.
    pub invariant: Invariant,
    /// In which tick.
    pub tick: Tick,
    /// Who and what.
    pub what: String,
}

/// All that is looked at while a run goes on.
pub struct Invariants {
    setup: Setup,
    items: Items,
    solids: Solids,
    exclusive: Exclusive,
    termination: Termination,
    /// The tick that is to end next.
    next: Tick,
}

impl Invariants {
    /// Of a run that has not begun.
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        Self {
            items: Items::new(&setup.scenario),
            solids: Solids::default(),
            exclusive: Exclusive::new(setup),
            termination: Termination::new(setup),
            next: 0,
            setup: setup.clone(),
        }
    }

    /// Looks at a run after each of its ticks.
    ///
    /// # Errors
    /// The first thing that does not hold.
    pub fn see(&mut self, simulation: &Simulation) -> Result<(), Violation> {
        if simulation.tick() == self.next {
            // Over before this tick, or stuck in it.
            return match simulation.outcome() {
                Some(_) => Ok(()),
                None => Err(Violation {
                    invariant: Invariant::TicksGoOn,
                    tick: self.next,
                    what: "it does not end".to_owned(),
                }),
            };
        }
        self.check(&WorldState::of(simulation))?;
        let world = simulation.world();
        world.mission().holds(world).map_err(|what| Violation {
            invariant: Invariant::MissionHolds,
            tick: simulation.tick().saturating_sub(1),
            what,
        })
    }

    /// Looks at what there is after a tick.
    ///
    /// # Errors
    /// The first thing that does not hold.
    pub fn check(&mut self, state: &WorldState) -> Result<(), Violation> {
        let scenario = &self.setup.scenario;
        let of = |invariant| {
            move |what| Violation {
                invariant,
                tick: state.tick,
                what,
            }
        };
        if state.tick != self.next {
            let what = format!("tick {} was to come", self.next);
            return Err(of(Invariant::TicksGoOn)(what));
        }
        self.next += 1;
        self.items
            .check(scenario, state)
            .map_err(of(Invariant::ItemsAccountedFor))?;
        self.solids
            .check(scenario, state)
            .map_err(of(Invariant::NoOverlap))?;
        numbers::check(&self.setup, state).map_err(of(Invariant::NumbersInRange))?;
        activity::check(scenario, state).map_err(of(Invariant::OneActiveBehavior))?;
        self.exclusive
            .check(scenario, state)
            .map_err(of(Invariant::ExclusiveTasks))?;
        self.termination
            .check(scenario, state)
            .map_err(of(Invariant::Termination))
    }
}
