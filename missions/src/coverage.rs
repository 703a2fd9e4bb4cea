//! Tasks that no robot can do.

use std::collections::BTreeSet;

use scenario::{Catalog, Scenario};

/// Returns the tasks for which no robot has a behavior, as indices of the catalog.
pub(crate) fn uncovered_tasks(scenario: &Scenario, catalog: &Catalog) -> BTreeSet<usize> {
    let mut left: BTreeSet<usize> = (0..catalog.tasks.len()).collect();
    for robot in &scenario.robots {
        // A large team mostly covers all tasks early.
        if left.is_empty() {
            break;
        }
        for behavior in catalog.behaviors_of(robot) {
            left.remove(&catalog.sets[behavior.index()].task.index());
        }
    }
    left
}
