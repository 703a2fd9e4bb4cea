//! The fault of service: an additional point.

use scenario::fault::{Fault, FaultArgument, FaultRange, FaultSpec, Order};
use scenario::{Problem, Scenario};

use super::{ServiceSection, TaskGranularity};

pub const POINT: &str = "point";

pub(super) const ALL: &[FaultSpec] = &[FaultSpec {
    name: POINT,
    about: "a point of work arrives",
    arguments: &[
        FaultArgument::new("x_m", "place, m", FaultRange::X, None),
        FaultArgument::new("y_m", "place, m", FaultRange::Y, None),
        FaultArgument::new(
            "kind",
            "name of its kind in the scenario",
            FaultRange::Name,
            Some(0.0),
        ),
    ],
}];

/// Rejects points for which no task is left: each needs one that `spare` reserves, if points are tasks.
pub(super) fn check(scenario: &Scenario, order: &Order) -> Result<(), Problem> {
    let section = ServiceSection::of(scenario);
    let Fault::Mission(fault) = &order.fault else {
        return Ok(());
    };
    if fault.name != POINT || section.tasks == TaskGranularity::Kinds {
        return Ok(());
    }
    let spare = section.spare;
    if spare == 0 {
        let what = "no task is reserved for another point";
        let remedy = "set service.spare to the number of points that faults add";
        return Err(Problem::at(["fault", POINT], what, remedy));
    }
    let Some(every_s) = order.every_s else {
        return Ok(());
    };
    let first_s = order.at_s.unwrap_or_default();
    let times = ((scenario.limit_s - first_s) / every_s).max(0.0).floor() + 1.0;
    if times <= f64::from(spare) {
        return Ok(());
    }
    let what = format!("{times} points until limit_s are more than service.spare, {spare}");
    let remedy = "order them less often, or increase service.spare";
    Err(Problem::at(["every_s"], what, remedy))
}
