//! Faults that cannot take effect in any course of the run.

use glam::Vec2;
use scenario::fault::Fault;
use scenario::{KeyPath, Problem, Scenario};

use crate::world::Places;

/// Returns a problem for each fault of the scenario's timeline that cannot take effect. The scenario is checked.
#[must_use]
pub fn in_vain(scenario: &Scenario) -> Vec<Problem> {
    let faults = &scenario.faults;
    let mut found = faults.beyond_limit(scenario.limit_s, scenario.step_ms);
    let at = KeyPath::new(["faults", "timeline"]);
    let places = Places::of(scenario);
    for (index, order) in faults.timeline.iter().enumerate() {
        let problem = refuse_place(&order.fault, &places);
        found.extend(problem.map(|problem| problem.under(at.index(index))));
    }
    found.extend(scenario.mission().faults_in_vain(scenario));
    found
}

/// Returns a problem if a fault moves a robot to a place where none can ever stand.
pub(crate) fn refuse_place(fault: &Fault, places: &Places) -> Option<Problem> {
    let Fault::MoveRobot(to) = fault else {
        return None;
    };
    let can_stand = places.can_stand(Vec2::new(to.x_m, to.y_m));
    (!can_stand).then(|| {
        let what = "the place is outside the border or on an obstacle of the scenario";
        Problem::at(["fault", fault.name()], what, "choose another place")
    })
}
