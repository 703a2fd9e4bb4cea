//! The fault of service: an additional point.

use glam::Vec2;
use scenario::fault::{
    EventTrigger, Fault, FaultArgument, FaultRange, FaultSpec, MissionFault, Order,
};
use scenario::time::SimTime;
use scenario::{KeyPath, Problem, Scenario};
use world_server::world::Places;

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
    // An order by hand without a time begins now, so that its number of times depends on the state of the run.
    if order.at_s.is_none() {
        return Ok(());
    }
    let times = times(scenario, order);
    if times <= u64::from(spare) {
        return Ok(());
    }
    let what = format!("{times} points until limit_s are more than service.spare, {spare}");
    let remedy = "order them less often, or increase service.spare";
    Err(Problem::at(["every_s"], what, remedy))
}

/// Rejects a trigger by a point that cannot exist.
pub(super) fn check_trigger(scenario: &Scenario, when: &EventTrigger) -> Result<(), Problem> {
    if !["begins", "leaves", "finishes"].contains(&when.what.as_str()) {
        return Ok(());
    }
    let count = ServiceSection::of(scenario).max_points();
    let exists =
        |object: &str| EventTrigger::number_of(object, "p").is_some_and(|point| point < count);
    let last = count.saturating_sub(1);
    when.check_object(exists, format!("name a point from p0 to p{last}"))
}

/// Returns the number of times that an order of a scenario takes effect before the run ends.
fn times(scenario: &Scenario, order: &Order) -> u64 {
    let at = order.at().unwrap_or(SimTime::ZERO);
    let due = order.when.is_none().then_some(at);
    order.times(due, scenario.limit_s, scenario.step_ms)
}

/// Returns a problem for each point of the timeline at a place where no robot can work, and for more points than
/// reserved tasks.
pub(super) fn in_vain(scenario: &Scenario) -> Vec<Problem> {
    let section = ServiceSection::of(scenario);
    let places = Places::of(scenario);
    let at = KeyPath::new(["faults", "timeline"]);
    let mut found = Vec::new();
    let mut added = 0;
    for (index, order) in scenario.faults.timeline.iter().enumerate() {
        let Fault::Mission(fault) = &order.fault else {
            continue;
        };
        if fault.name != POINT {
            continue;
        }
        added += times(scenario, order);
        if let Some(what) = without_access(section, fault, &places) {
            let remedy = "move the point away from walls and obstacles";
            found.push(Problem::at(at.index(index), what, remedy));
        }
    }
    let spare = section.spare;
    if section.tasks == TaskGranularity::Points && added > u64::from(spare) {
        let what = format!("the faults add {added} points, more than service.spare, {spare}");
        found.push(Problem::at(at, what, "increase service.spare"));
    }
    found
}

/// Returns a text if no robot can ever work at the place of an additional point.
fn without_access(
    section: &ServiceSection,
    fault: &MissionFault,
    places: &Places,
) -> Option<String> {
    let number = |key| fault.get(key).unwrap_or_default() as f32;
    let at = Vec2::new(number("x_m"), number("y_m"));
    let is_reached = places.can_be_worked_on(at, section.reach_m);
    (!is_reached).then(|| format!("no robot can work at ({}, {})", at.x, at.y))
}

/// Returns the reason why an order during a run must fail: no robot can work at the place, or `spare` leaves no task. Each
/// ordered point reserves one. `points` is the number of points so far. The other arguments are those of
/// `MissionWorld::refuse_order`.
pub fn refuse_order(
    section: &ServiceSection,
    points: usize,
    fault: &MissionFault,
    times: u64,
    ordered: &[(&MissionFault, u64)],
    places: &Places,
) -> Option<Problem> {
    if fault.name != POINT {
        return None;
    }
    if let Some(what) = without_access(section, fault, places) {
        let remedy = "choose a place away from walls and obstacles";
        return Some(Problem::at(["fault", POINT], what, remedy));
    }
    let ordered = ordered.iter().filter(|(fault, _)| fault.name == POINT);
    let reserved = ordered.fold(0_u64, |sum, (_, times)| sum.saturating_add(*times));
    let free = section.max_points().saturating_sub(points) as u64;
    let needed = reserved.saturating_add(times);
    if section.tasks == TaskGranularity::Kinds || needed <= free {
        return None;
    }
    let spare = u64::from(section.spare);
    let taken = spare.saturating_sub(free).saturating_add(reserved);
    let what = format!(
        "{times} to add and {taken} in use or reserved by earlier orders are more than service.spare, {spare}"
    );
    let remedy = "clear an order, or increase service.spare";
    Some(Problem::at(["fault", POINT], what, remedy))
}
