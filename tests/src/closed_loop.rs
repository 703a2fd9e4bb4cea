//! Whole missions in one process at full speed, with their results.

use in_process::Team;
use missions::waste::data::ItemCounts;
use proto::readings::Pose;
use proto::tick::Outcome;
use run_log::{LogLevel, MemoryLog};
use scenario::ids::RobotId;
use scenario::mission::FigureValue;
use scenario::time::SimTime;
use scenario::{Scenario, Setup};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mission {
    pub outcome: Outcome,
    /// The simulated time at the end.
    pub took: SimTime,
    /// The positions of the items at the end.
    pub items: ItemCounts,
}

/// Runs a scenario to its end. `watch` receives all poses by rank after each tick.
///
/// # Panics
/// Panics if the scenario is invalid.
pub fn run(
    scenario: Scenario,
    seed: u64,
    mut watch: impl FnMut(SimTime, &[Pose], ItemCounts),
) -> Mission {
    let setup = match Setup::resolve(scenario, seed, None) {
        Ok(resolved) => resolved.setup,
        Err(error) => panic!("{error}"),
    };
    let robots = setup.scenario.robots.len() as u16;
    let mut team = match Team::new(setup, LogLevel::Off, MemoryLog::default()) {
        Ok(team) => team,
        Err(error) => panic!("{error}"),
    };
    loop {
        let outcome = match team.tick() {
            Ok(outcome) => outcome,
            Err(error) => panic!("{error}"),
        };
        let world = team.simulation().world();
        let poses: Vec<Pose> = (0..robots).map(|rank| world.pose(RobotId(rank))).collect();
        let items = counts(&team.simulation().mission_row());
        watch(world.now(), &poses, items);
        if let Some(outcome) = outcome {
            return Mission {
                outcome,
                took: world.now(),
                items,
            };
        }
    }
}

/// Returns the item counts of a row of mission.csv.
fn counts(row: &[FigureValue]) -> ItemCounts {
    let count = |place: usize| row[place].count() as u32;
    ItemCounts {
        in_spills: count(0),
        carried: count(1),
        on_floor: count(2),
        delivered: count(3),
    }
}
