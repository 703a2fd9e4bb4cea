//! `alliance run --allocate-only`: the allocation alone. Robots do not move, and exchange messages in rounds until the
//! allocation stays the same.
//!
//! A round is a tick: each robot receives the broadcasts of the previous round, steps and sends. The allocation of a
//! robot consists of its active task and of the tasks that it holds by a bid or contract, in its own view.

mod objective;
mod show;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use anyhow::Context as _;
use in_process::{BodyCommand, Team};
use proto::team::BroadcastKind;
use run_log::{LogLevel, MemoryLog};
use scenario::Setup;
use scenario::ids::{RobotId, TaskId};
use world_server::simulation::Simulation;

pub use objective::Objective;
pub use show::{json, text};

/// The number of rounds without a change after which an allocation is stable. Rules by motivation need up to ten
/// seconds of simulated time from one decision to the next.
pub const STABLE_ROUNDS: u64 = 200;
/// The default limit of rounds. Robots give up a task after a minute without progress, and 1,000 steps of 50 ms are less.
pub const DEFAULT_ROUNDS: &str = "1000";

/// The allocation that a team agrees on, with its cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Allocation {
    /// The tasks of each robot, by rank.
    pub robots: Vec<BTreeSet<TaskId>>,
    /// The number of rounds until the last change.
    pub rounds: u64,
    /// False if no robot has a task, or if the allocation changed in the last [`STABLE_ROUNDS`] rounds before the limit.
    pub is_stable: bool,
    /// The number of broadcasts of allocators until the last change, each counted once for all receivers.
    pub messages: u64,
    /// The number of heartbeats until the last change.
    pub heartbeats: u64,
    /// The total size of all broadcasts until the last change, bytes.
    pub bytes: u64,
    /// The objective values; `None` for missions without tasks at places.
    pub objective: Option<Objective>,
}

/// Runs communication rounds until the allocation is stable, but at most `limit` rounds.
///
/// # Errors
/// Returns an error if the run cannot start or a tick fails.
pub fn allocate(setup: &Setup, limit: u64) -> anyhow::Result<Allocation> {
    let mut team = Team::new(setup.clone(), LogLevel::Off, MemoryLog::default())?;
    team.count_traffic();
    let halt = BodyCommand {
        speed_m_s: 0.0,
        turn_rad_s: 0.0,
        // The action contains the confirmation of announced tasks.
        action: None,
    };
    let robots = robots(setup);
    for robot in &robots {
        team.drive(*robot, Some(halt));
    }
    let mut found = Allocation {
        robots: vec![BTreeSet::new(); robots.len()],
        rounds: 0,
        is_stable: false,
        messages: 0,
        heartbeats: 0,
        bytes: 0,
        objective: None,
    };
    for round in 1..=limit {
        let outcome = team.tick()?;
        let now = current(team.simulation(), &robots);
        if now != found.robots {
            let traffic = team.traffic().context("broadcasts are counted")?;
            let count = |kind: BroadcastKind| {
                let mut counts = traffic.by_kind();
                counts
                    .find(|(each, _)| *each == kind)
                    .map_or(0, |(_, count)| count.messages)
            };
            found = Allocation {
                robots: now,
                rounds: round,
                messages: count(BroadcastKind::Allocation),
                heartbeats: count(BroadcastKind::Heartbeat),
                bytes: traffic.by_kind().map(|(_, count)| count.bytes).sum(),
                ..found
            };
        }
        // Some rules wait before their first decision.
        let is_empty = found.robots.iter().all(BTreeSet::is_empty);
        if !is_empty && round - found.rounds >= STABLE_ROUNDS {
            found.is_stable = true;
            break;
        }
        if outcome.is_some() {
            break;
        }
    }
    found.objective = Objective::new(setup, &found.robots)?;
    Ok(found)
}

/// Returns the robots of a team, by rank.
fn robots(setup: &Setup) -> Vec<RobotId> {
    let ranks = (0..=u32::MAX).take(setup.scenario.robots.len());
    ranks.map(RobotId).collect()
}

/// Returns the tasks of each robot after a round.
fn current(simulation: &Simulation, robots: &[RobotId]) -> Vec<BTreeSet<TaskId>> {
    let catalog = simulation.catalog();
    let of_robot = |robot: &RobotId| {
        let rows = simulation.allocation(*robot).iter();
        let held = rows
            .filter(|row| row.holder == Some(*robot))
            .map(|row| row.task);
        let active = simulation.active(*robot);
        let active = active.map(|behavior| catalog.sets[behavior.index()].task);
        held.chain(active).collect()
    };
    robots.iter().map(of_robot).collect()
}
