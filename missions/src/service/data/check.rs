//! Checks of `[service]` beyond the ranges of its parameters.

use std::collections::BTreeSet;

use glam::Vec2;
use scenario::limits::check_known;
use scenario::{Catalog, KeyPath, Problem, Scenario};
use world_server::world::Places;

use super::points::free_place;
use super::room::has_room;
use super::{CostMeasure, Interval, Kind, MAX_POINTS, Point, ServiceSection};
use super::{loads, paths, precedence, slots};
use crate::coverage::uncovered_tasks;

/// The maximum number of tasks: points, spare ones and slots.
const MAX_TASKS: usize = 60_000;

pub(super) fn check(scenario: &Scenario) -> Result<(), Problem> {
    let section = ServiceSection::of(scenario);
    let at = KeyPath::new(["service"]);
    for (key, number) in [
        ("duration_s", section.duration_s),
        ("coalition_wait_s", section.coalition_wait_s),
        ("reserve", section.reserve),
    ] {
        is_finite(number, at.key(key))?;
    }
    for (index, kind) in section.kinds.iter().enumerate() {
        let at = at.key("kinds").index(index);
        is_finite(kind.period_s, at.key("period_s"))?;
        in_order(&kind.work_s, at.key("work_s"))?;
        if let Some(deadline_s) = &kind.deadline_s {
            in_order(deadline_s, at.key("deadline_s"))?;
        }
        fit(scenario, kind.workers, "a point", at.key("workers"))?;
    }
    let known = section.kinds.iter().map(|kind| kind.name.as_str());
    let known: BTreeSet<&str> = known.collect();
    let points = section.points.iter().map(|point| Some(&point.kind));
    let random = section.random.iter().map(|batch| batch.kind.as_ref());
    for (list, kinds) in [
        ("points", points.collect::<Vec<_>>()),
        ("random", random.collect()),
    ] {
        for (index, kind) in kinds.into_iter().enumerate() {
            let Some(kind) = kind.filter(|kind| !known.contains(kind.as_str())) else {
                continue;
            };
            let at = at.key(list).index(index).key("kind");
            let known = section.kinds.iter().map(|kind| kind.name.as_str());
            check_known(at, "there is no kind", kind, known)?;
        }
    }
    let mut kinds = section.kinds_of_points();
    for (index, point) in section.points.iter().enumerate() {
        let at = at.key("points").index(index);
        let kind = kinds.next().map(|kind| &section.kinds[kind]);
        check_point(scenario, index, point, kind, at.clone())?;
        loads::check_demand(point, kind, at.key("demand"))?;
        slots::check_needs(scenario, point, at.key("needs"))?;
    }
    check_costs(scenario)?;
    precedence::check(section)?;
    check_energy(scenario)?;
    let count = section.kinds_of_points().count();
    let all = count + section.spare as usize;
    if all == 0 {
        let what = "there are no points";
        return Err(Problem::at(at, what, "give points, random or spare"));
    }
    if all > MAX_POINTS {
        let what = format!("more than {MAX_POINTS} points in all");
        let remedy = "give fewer points, random and spare";
        return Err(Problem::at(at, what, remedy));
    }
    let slots = section.points.iter().flat_map(|point| point.needs.values());
    let tasks = all + slots.map(|count| *count as usize).sum::<usize>();
    if tasks > MAX_TASKS {
        let what = format!("more than {MAX_TASKS} points and slots in all");
        return Err(Problem::at(at, what, "give fewer points or needs"));
    }
    if section.uncovered || has_unknown_skill(scenario) {
        // The check of skills, which runs later, reports an unknown skill.
        return Ok(());
    }
    let problem = beyond_the_team(scenario).next();
    problem.map_or(Ok(()), |problem| {
        Err(problem.or_remedy("set uncovered = true"))
    })
}

/// Returns what the team cannot do: slots, loads and tasks, the first of each.
pub(super) fn beyond_the_team(scenario: &Scenario) -> impl Iterator<Item = Problem> {
    let checks = [slots::check_filled, loads::check_capacities, covered];
    let problems = checks.into_iter().map(move |check| check(scenario).err());
    problems.flatten()
}

/// Checks that the shortest ways can be computed in a short time.
fn check_costs(scenario: &Scenario) -> Result<(), Problem> {
    let solid = scenario.obstacles.iter().filter(|each| each.is_solid());
    let (count, most) = (solid.count(), paths::MOST_OBSTACLES);
    if ServiceSection::of(scenario).costs == CostMeasure::Line || count <= most {
        return Ok(());
    }
    let what = format!("the room has {count} solid obstacles, more than {most}");
    let remedy = "set costs = 'line', or give fewer obstacles";
    Err(Problem::at(["service", "costs"], what, remedy))
}

/// Checks that robots can reach the stated points and chargers, and that there is room for drawn points.
pub(super) fn check_places(scenario: &Scenario) -> Result<(), Problem> {
    let section = ServiceSection::of(scenario);
    let places = Places::of(scenario);
    let points = section.points.iter().enumerate().map(|(index, point)| {
        let at = KeyPath::new(["service", "points"]).index(index);
        (
            format!("p{index}"),
            "the point",
            Vec2::new(point.x_m, point.y_m),
            at,
        )
    });
    let chargers = section.chargers.iter().enumerate().map(|(index, charger)| {
        let at = KeyPath::new(["service", "chargers"]).index(index);
        (
            format!("the charger c{index}"),
            "the charger",
            charger.place(),
            at,
        )
    });
    let deliveries = section
        .points
        .iter()
        .enumerate()
        .filter_map(|(index, point)| {
            let at = KeyPath::new(["service", "points"]).index(index);
            let name = format!("the delivery of p{index}");
            Some((
                name,
                "the place",
                Vec2::from(point.deliver_to?),
                at.key("deliver_to"),
            ))
        });
    for (name, thing, place, at) in points.chain(chargers).chain(deliveries) {
        let (x_m, y_m, reach_m) = (place.x, place.y, section.reach_m);
        if places.can_be_worked_on(place, reach_m) {
            continue;
        }
        let mut obstacles = scenario.obstacles.iter();
        let over = obstacles.position(|each| each.is_solid() && each.contains(x_m, y_m));
        let (what, remedy) = match over {
            Some(obstacle) => (
                format!("{name} at ({x_m}, {y_m}) lies in the solid obstacles[{obstacle}]"),
                "move one of them".to_owned(),
            ),
            None => (
                format!(
                    "no robot has room within reach_m, {reach_m} m, of {name} at ({x_m}, {y_m})"
                ),
                format!("move {thing} away from walls and obstacles, or increase reach_m"),
            ),
        };
        return Err(Problem::at(at, what, remedy));
    }
    if section.random.is_empty() || free_place(scenario, &places).is_some() {
        return Ok(());
    }
    let what = "the obstacles leave no place for a drawn point";
    Err(Problem::at(
        KeyPath::new(["service", "random"]),
        what,
        "take obstacles away",
    ))
}

/// Checks that chargers and reserve have an effect, and that the robots have room at the chargers.
fn check_energy(scenario: &Scenario) -> Result<(), Problem> {
    let section = ServiceSection::of(scenario);
    let at = KeyPath::new(["service"]);
    for (index, charger) in section.chargers.iter().enumerate() {
        let at = at.key("chargers").index(index);
        if scenario.energy.is_none() {
            let what = "the scenario simulates no energy";
            return Err(Problem::at(
                at,
                what,
                "add a section [energy], or omit the charger",
            ));
        }
        fit(scenario, charger.slots, "the charger", at.key("slots"))?;
    }
    if section.reserve.is_some() && section.chargers.is_empty() {
        let what = "there is no charger";
        return Err(Problem::at(
            at.key("reserve"),
            what,
            "add [[service.chargers]], or omit it",
        ));
    }
    Ok(())
}

/// Checks the window, the delivery and the name of a point.
fn check_point(
    scenario: &Scenario,
    index: usize,
    point: &Point,
    kind: Option<&Kind>,
    at: KeyPath,
) -> Result<(), Problem> {
    for (key, number) in [
        ("work_s", point.work_s),
        ("opens_s", point.opens_s),
        ("deadline_s", point.deadline_s),
        ("value", point.value),
        ("demand", point.demand),
    ] {
        is_finite(number, at.key(key))?;
    }
    if let (Some(opens_s), Some(deadline_s)) = (point.opens_s, point.deadline_s)
        && deadline_s <= opens_s
    {
        let what = format!(
            "p{index} closes {deadline_s} s after its arrival, and opens after {opens_s} s"
        );
        let remedy = "give a deadline_s above opens_s";
        return Err(Problem::at(at.key("deadline_s"), what, remedy));
    }
    if let Some([x_m, y_m]) = point.deliver_to {
        let at = at.key("deliver_to");
        scenario.room.range_x().check(at.index(0), x_m)?;
        scenario.room.range_y().check(at.index(1), y_m)?;
        if point.has_needs() {
            let what = "robots that work together carry nothing";
            return Err(Problem::at(at, what, "omit needs or deliver_to"));
        }
        if kind.is_some_and(|kind| kind.period_s.is_some()) {
            let what = format!("p{index} comes back, and its load may be on the way then");
            return Err(Problem::at(at, what, "omit period_s or deliver_to"));
        }
    }
    let name = point.name.as_deref();
    let number = name.and_then(|name| name.strip_prefix('p')?.parse::<usize>().ok());
    if number.is_some_and(|number| number != index) {
        let what = format!("the name of p{index} is that of another point");
        return Err(Problem::at(at.key("name"), what, "give another name"));
    }
    Ok(())
}

/// Checks that an optional number is finite. The check of ranges takes other numbers for absent ones.
fn is_finite(number: Option<f64>, at: KeyPath) -> Result<(), Problem> {
    match number.filter(|number| !number.is_finite()) {
        None => Ok(()),
        Some(number) => {
            let what = format!("{number} does not fit");
            Err(Problem::at(at, what, "write a number"))
        }
    }
}

fn in_order(between: &Interval, at: KeyPath) -> Result<(), Problem> {
    if between.min <= between.max {
        return Ok(());
    }
    let what = format!("min {} is above max {}", between.min, between.max);
    Err(Problem::at(at, what, "write the lower one as min"))
}

/// Checks that the workers of a point fit side by side within its reach.
fn fit(scenario: &Scenario, workers: u32, thing: &str, at: KeyPath) -> Result<(), Problem> {
    let reach_m = ServiceSection::of(scenario).reach_m;
    if has_room(scenario, reach_m, workers) {
        return Ok(());
    }
    // One robot always has room.
    let most = (1..workers)
        .rev()
        .find(|fewer| has_room(scenario, reach_m, *fewer))
        .unwrap_or(1);
    let what = format!(
        "{workers} robots of radius {} m have no room within reach_m, {reach_m} m, of {thing}",
        scenario.body.radius_m
    );
    let remedy = format!("give at most {most}, or a longer reach_m");
    Err(Problem::at(at, what, remedy))
}

/// Returns whether a robot states a skill that no work requires.
fn has_unknown_skill(scenario: &Scenario) -> bool {
    let known: BTreeSet<String> = ServiceSection::of(scenario).skills().into_iter().collect();
    let own_skills = scenario
        .robots
        .iter()
        .flat_map(|robot| robot.skills.iter().flatten());
    let mut skills = scenario.skills.iter().chain(own_skills);
    skills.any(|(skill, _)| !known.contains(skill))
}

/// Checks that each task has a robot.
fn covered(scenario: &Scenario) -> Result<(), Problem> {
    let section = ServiceSection::of(scenario);
    let catalog = Catalog::new(scenario);
    let uncovered = uncovered_tasks(scenario, &catalog);
    let Some(&task) = uncovered.first() else {
        return Ok(());
    };
    let name = &catalog.tasks[task].name;
    let what = match &catalog.sets[task].skill {
        Some(skill) => format!("no robot has {name} among its tasks and the skill {skill}"),
        None => format!("no robot has {name} among its tasks"),
    };
    let others = match uncovered.len() - 1 {
        0 => String::new(),
        1 => ", and 1 more task that no robot can do".to_owned(),
        more => format!(", and {more} more tasks that no robot can do"),
    };
    let is_stated = task < section.points.len();
    let list = if is_stated { "points" } else { "kinds" };
    let remedy = "assign them to a robot";
    let at = KeyPath::new(["service", list]);
    Err(Problem::at(at, what + &others, remedy))
}
