//! The states in which faults take effect: the active behaviors and the phase of the mission.
//!
//! A schedule that reaches a new state is worth changing further, as in coverage-guided fuzzing (Zalewski, American
//! Fuzzy Lop, 2013). A state is a kind of fault with its mode, the behavior of the target robot, whether that robot
//! carries a load, the quarter of the mission's work that is done, and the number of other faults in force.

use std::collections::BTreeSet;

use proto::control::{FaultStatus, Phase};
use proto::telemetry::BehaviorState;
use scenario::ids::RobotId;
use scenario::mission::columns::Progress;
use world_server::simulation::Simulation;
use xxhash_rust::xxh3::xxh3_64;

use crate::invariants::WorldState;

/// The largest number of other faults in force that states distinguish.
const OTHERS: usize = 2;

/// The parts of the mission's work that states distinguish.
const PHASES: u64 = 4;

/// The states that one run has covered.
#[derive(Default)]
pub struct Coverage {
    /// By fault: true once it has taken effect.
    has_begun: Vec<bool>,
    states: BTreeSet<u32>,
}

impl Coverage {
    /// Adds the states of faults that have taken effect since the last call.
    pub fn look(
        &mut self,
        simulation: &Simulation,
        state: &WorldState,
        progress: Option<&Progress>,
    ) {
        self.has_begun.resize(state.faults.len(), false);
        let in_force = |fault: &&FaultStatus| fault.phase == Phase::InForce;
        let in_force = state.faults.iter().filter(in_force).count();
        let phase = progress.map_or(0, |progress| {
            PHASES * progress.done / progress.total().max(1)
        });
        for (fault, has_begun) in state.faults.iter().zip(&mut self.has_begun) {
            if *has_begun || fault.phase == Phase::Armed {
                continue;
            }
            *has_begun = true;
            let others = in_force.saturating_sub(1).min(OTHERS);
            let kind = (fault.order.fault.name(), fault.order.fault.mode());
            let target = fault.order.fault.robot();
            let target = target.and_then(|name| simulation.robot_named(name));
            let at: Vec<RobotId> = match target {
                Some(robot) => vec![robot],
                None => simulation.barrier().robots().collect(),
            };
            for robot in at {
                let levels = simulation.levels(robot);
                let mut levels = levels.iter();
                let active = levels.find(|level| level.state == BehaviorState::Active);
                let active = active.map(|level| level.set);
                let is_laden = state.robots[robot.index()].carrying.is_some();
                let text = format!("{kind:?} {active:?} {is_laden} {phase} {others}");
                // 32 bits distinguish the few thousand states of a hunt.
                self.states.insert(xxh3_64(text.as_bytes()) as u32);
            }
        }
    }

    /// Returns the states in ascending order.
    #[must_use]
    pub fn into_states(self) -> Vec<u32> {
        self.states.into_iter().collect()
    }
}
