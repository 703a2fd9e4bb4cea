//! Drawn levels of a robot's decisions, one for each of its behavior sets.

use std::borrow::Cow;

use proto::telemetry::{BehaviorState, Motivation};
use proto::tick::Report;
use proto::view::LevelUnit;
use scenario::{Robot, Scenario, Setup};

/// Returns the levels after a step, in the order of the catalog: motivations, or else utilities. A utility is 0 if the
/// behavior set is not applicable. Before the first report there are no levels, and the allocator's name determines
/// their kind.
pub fn levels<'r>(
    report: &'r Report,
    setup: &Setup,
    robot: &Robot,
) -> (LevelUnit, Cow<'r, [Motivation]>) {
    if report.incarnation == 0 {
        let measure = match setup.scenario.decider_of(robot) {
            Scenario::DEFAULT_ALLOCATOR => LevelUnit::Motivation,
            _ => LevelUnit::Utility,
        };
        return (measure, Cow::Borrowed(&[]));
    }
    if !report.motivations.is_empty() {
        return (LevelUnit::Motivation, Cow::Borrowed(&report.motivations));
    }
    let catalog = &setup.catalog;
    let mut rows = vec![None; catalog.sets.len()];
    for row in &report.allocation {
        if let Some(place) = rows.get_mut(row.behavior.index()) {
            *place = Some(row);
        }
    }
    let utilities = catalog.behaviors_of(robot).map(|set| {
        let row = rows[set.index()];
        Motivation {
            set,
            motivation: row.map_or(0.0, |row| row.utility),
            sensory_feedback: row.is_some(),
            state: if report.active == Some(set) {
                BehaviorState::Active
            } else {
                BehaviorState::Hibernating
            },
            ..Motivation::default()
        }
    });
    (LevelUnit::Utility, utilities.collect())
}
