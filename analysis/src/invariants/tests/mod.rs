//! Hand-made violations that the checks must find, and states that they must accept.

mod exclusive;
mod runs;
mod termination;
mod world;

use glam::Vec2;
use missions::waste::data::{default_scenario, default_setup};
use proto::control::{FaultStatus, Phase};
use proto::telemetry::BehaviorState;
use proto::tick::Outcome;
use run_log::{LogLevel, MemoryLog};
use scenario::fault::Order;
use scenario::ids::{BehaviorId, ItemId, RobotId};
use scenario::time::SimTime;
use scenario::{Preset, Scenario, Setup};
use world_server::world::{ComponentId, ObstacleId};

use super::*;
use crate::testkit;
use in_process::Team;

const TOP: BehaviorId = BehaviorId(2);
const BOTTOM: BehaviorId = BehaviorId(3);

fn setup() -> Setup {
    default_setup(1)
}

/// Returns the default mission after its first tick.
fn beginning() -> WorldState {
    let mut team = Team::new(setup(), LogLevel::Off, MemoryLog::default()).unwrap();
    team.tick().unwrap();
    WorldState::from_simulation(team.simulation())
}

/// Runs a mission to its end and checks every tick.
fn checked(setup: Setup) -> (Team<MemoryLog>, Outcome) {
    let mut invariants = Invariants::new(&setup);
    let mut team = Team::new(setup, LogLevel::Off, MemoryLog::default()).unwrap();
    loop {
        let outcome = team.tick().unwrap();
        invariants.check_simulation(team.simulation()).unwrap();
        if let Some(outcome) = outcome {
            return (team, outcome);
        }
    }
}

/// Advances the state by one tick.
fn next(state: &mut WorldState) {
    state.tick += 1;
    state.now = SimTime(state.tick * setup().scenario.step_ms);
}

/// Checks a good tick, and then a changed one.
fn check_changed(change: impl FnOnce(&mut WorldState)) -> Result<(), Violation> {
    let mut invariants = Invariants::new(&setup());
    let mut state = beginning();
    invariants.check(&state).unwrap();
    next(&mut state);
    change(&mut state);
    invariants.check(&state)
}

#[track_caller]
fn violates(invariant: Invariant, what: &str, change: impl FnOnce(&mut WorldState)) {
    let violation = check_changed(change).unwrap_err();
    assert_eq!(violation.invariant, invariant, "{violation}");
    assert!(violation.description.contains(what), "{violation}");
    let line = violation.to_string();
    assert!(
        line.starts_with(&format!("{invariant}: tick 1: ")),
        "{line}"
    );
    assert_eq!(line.lines().count(), 1);
}

/// Returns a fault that has been in force for a long time.
fn in_force(order: &str) -> FaultStatus {
    let order: Order = serde_json::from_str(order).unwrap();
    FaultStatus {
        id: "f1".to_owned(),
        order,
        phase: Phase::InForce,
        applied_ms: None,
        healed_ms: None,
        hits: 0,
        failed: None,
    }
}

fn set_state(world: &mut WorldState, rank: usize, set: BehaviorId, state: BehaviorState) {
    let mut motivations = world.robots[rank].motivations.iter_mut();
    let entry = motivations.find(|entry| entry.set == set).unwrap();
    (entry.state, entry.motivation) = (state, 100.0);
}
