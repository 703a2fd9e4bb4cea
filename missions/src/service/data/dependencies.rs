//! The dependencies between tasks and robots that a section states, for the class of the scenario.

use scenario::Scenario;
use scenario::mission::data::TaskDependencies;

use super::{Point, ServiceSection};

/// Returns the dependencies of a scenario, each with the key that causes it.
pub(super) fn dependencies(scenario: &Scenario) -> TaskDependencies {
    let section = ServiceSection::of(scenario);
    let any = |has: fn(&Point) -> bool| section.points.iter().any(has);
    let has_needs = any(Point::has_needs);
    let has_order = any(|point| !point.after.is_empty());
    let has_loads = any(|point| point.demand.is_some())
        && scenario.robots.iter().any(|robot| robot.capacity.is_some());
    TaskDependencies {
        several_tasks: None,
        several_robots: has_needs.then_some("points need several robots at once (needs)"),
        in_schedule: if has_loads {
            Some("the demands of a robot's points share its capacity (demand)")
        } else {
            let has_energy = scenario.energy.is_some();
            has_energy.then_some("the points of a robot share its battery (energy)")
        },
        cross_schedule: match (has_needs, has_order) {
            (true, _) => Some("the robots of a point must be there at the same time (needs)"),
            (false, true) => Some("points wait for points of other robots (after)"),
            (false, false) => None,
        },
    }
}
