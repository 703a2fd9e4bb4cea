//! Invariants: conditions that every run must satisfy after every tick, under any fault.
//!
//! - [`WorldState`]: the checked state. The checks use only the output of the world and the agents, not their code.
//! - [`items`]: every item is in one place. [`solids`]: bodies overlap nothing solid. [`numbers`]: numbers are finite
//!   and in range. [`activity`]: a robot has at most one active set. [`exclusive`]: two robots that receive each other
//!   ([`reception`]) do not both continue an exclusive task. [`termination`]: a covered mission ends ([`coverage`],
//!   [`strewn`]). [`replayed`]: a replay gives the same run.

pub mod activity;
pub mod coverage;
pub mod exclusive;
pub mod items;
pub mod numbers;
pub mod reception;
pub mod replayed;
pub mod solids;
pub mod strewn;
pub mod termination;
#[cfg(test)]
mod tests;
mod world_state;

use scenario::Setup;
use scenario::ids::Tick;
use world_server::simulation::Simulation;

use exclusive::Exclusive;
use items::Items;
use solids::Solids;
use termination::Termination;
pub use world_state::{Item, Rectangle, RobotState, WorldState, is_delivered};

/// A condition that every run must satisfy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Invariant {
    /// Every tick ends and is followed by the next.
    #[error("ticks go on")]
    TicksGoOn,
    /// Every item is in one place. Only faults add items, and delivered items stay.
    #[error("items accounted for")]
    ItemsAccountedFor,
    /// No body overlaps anything solid, except an obstacle that was put on it.
    #[error("no overlap")]
    NoOverlap,
    /// Every number is finite and in its range.
    #[error("numbers in range")]
    NumbersInRange,
    /// A robot has at most one active behavior set.
    #[error("one active set")]
    OneActiveBehavior,
    /// The mission's own invariants hold.
    #[error("mission holds")]
    MissionHolds,
    /// Two robots that receive each other's messages do not both continue an exclusive task.
    #[error("exclusive tasks")]
    ExclusiveTasks,
    /// A covered mission ends.
    #[error("termination")]
    Termination,
    /// A replay gives the same run.
    #[error("replay identical")]
    ReplayIdentical,
}

/// A violated invariant, in one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{invariant}: tick {tick}: {description}")]
pub struct Violation {
    pub invariant: Invariant,
    pub tick: Tick,
    pub description: String,
}

pub struct Invariants {
    setup: Setup,
    items: Items,
    solids: Solids,
    exclusive: Exclusive,
    termination: Termination,
    /// The tick that must end next.
    next: Tick,
}

impl Invariants {
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

    /// Checks a run after each of its ticks. The error is the first violation.
    pub fn check_simulation(&mut self, simulation: &Simulation) -> Result<(), Violation> {
        if simulation.tick() == self.next {
            // The run ended before this tick, or is stuck in it.
            return match simulation.outcome() {
                Some(_) => Ok(()),
                None => Err(Violation {
                    invariant: Invariant::TicksGoOn,
                    tick: self.next,
                    description: "the tick does not end".to_owned(),
                }),
            };
        }
        self.check(&WorldState::from_simulation(simulation))?;
        let world = simulation.world();
        world
            .mission()
            .check_invariants(world)
            .map_err(|what| Violation {
                invariant: Invariant::MissionHolds,
                tick: simulation.tick().saturating_sub(1),
                description: what,
            })
    }

    /// Checks a state after a tick. The error is the first violation.
    pub fn check(&mut self, state: &WorldState) -> Result<(), Violation> {
        let scenario = &self.setup.scenario;
        let of = |invariant| {
            move |what| Violation {
                invariant,
                tick: state.tick,
                description: what,
            }
        };
        if state.tick != self.next {
            let what = format!("tick {} was expected", self.next);
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
