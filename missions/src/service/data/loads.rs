//! Loads: the demands of points and the capacities of robots.

use std::collections::BTreeSet;

use scenario::{Catalog, KeyPath, Problem, Robot, Scenario};

use super::{Kind, Point, ServiceSection, TaskGranularity};

/// The tolerance of a sum of demands, as a share of the capacity. It covers rounding.
const ROUNDING: f64 = 1e-9;

/// Returns whether a robot with this load can take a further demand. A robot without a stated capacity always can.
#[must_use]
pub fn fits(load: f64, demand: f64, capacity: Option<f64>) -> bool {
    demand <= 0.0 || capacity.is_none_or(|capacity| load + demand <= capacity * (1.0 + ROUNDING))
}

/// Checks that a robot can derive from its readings whether it has taken the demand of a point.
pub(super) fn check_demand(point: &Point, kind: Option<&Kind>, at: KeyPath) -> Result<(), Problem> {
    if point.demand.is_none() {
        return Ok(());
    }
    if point.has_needs() {
        let what = "robots that work together carry nothing";
        return Err(Problem::at(at, what, "omit needs or demand"));
    }
    let Some(kind) = kind else { return Ok(()) };
    if kind.deadline_s.is_some() && point.deadline_s.is_none() {
        let what =
            "robots do not receive drawn deadlines, and cannot distinguish done from expired work";
        return Err(Problem::at(at, what, "state deadline_s of the point"));
    }
    if kind.workers == 1 && kind.kept {
        return Ok(());
    }
    let what = format!(
        "several robots may work on a point of the kind {}, and one takes the load",
        kind.name
    );
    let remedy = "omit it, or set workers = 1 and kept = true for the kind";
    Err(Problem::at(at, what, remedy))
}

/// Returns the points whose demands are above the capacities of all robots with their tasks, with the demands.
#[must_use]
pub fn too_heavy(scenario: &Scenario, catalog: &Catalog) -> Vec<(u32, f64)> {
    let section = ServiceSection::of(scenario);
    let demands = section.points.iter().zip(0_u32..);
    let mut heavy: Vec<(u32, f64)> = demands
        .filter_map(|(point, number)| Some((number, point.demand?)))
        .collect();
    if heavy.is_empty() {
        return heavy;
    }
    let task_of = |point: u32| match section.tasks {
        TaskGranularity::Points => point as usize,
        // The check of the scenario guarantees that the kind exists.
        TaskGranularity::Kinds => {
            let kind = &section.points[point as usize].kind;
            section.kind_named(kind).unwrap_or_default()
        }
    };
    for robot in &scenario.robots {
        let sets = catalog.behaviors_of(robot);
        let tasks = sets.map(|set| catalog.sets[set.index()].task.index());
        let tasks: BTreeSet<usize> = tasks.collect();
        heavy.retain(|(point, demand)| {
            !tasks.contains(&task_of(*point)) || !fits(0.0, *demand, robot.capacity)
        });
    }
    heavy
}

/// Checks that each demand fits into a robot with the task.
pub(super) fn check_capacities(scenario: &Scenario) -> Result<(), Problem> {
    let heavy = too_heavy(scenario, &Catalog::new(scenario));
    let Some((point, demand)) = heavy.first() else {
        return Ok(());
    };
    let at = KeyPath::new(["service", "points"]).index(*point as usize);
    let what = format!("no robot with the task of p{point} has a capacity of {demand}");
    let remedy = "reduce the demand, or give a robot more capacity";
    Err(Problem::at(at.key("demand"), what, remedy))
}

/// Returns a problem if the robots cannot take the demands of all points that are delivered nowhere.
pub(super) fn too_much(scenario: &Scenario) -> Option<Problem> {
    let kept = ServiceSection::of(scenario).points.iter();
    let kept = kept.filter(|point| point.deliver_to.is_none());
    let demand: f64 = kept.filter_map(|point| point.demand).sum();
    let capacities = scenario.robots.iter().map(|robot: &Robot| robot.capacity);
    let capacity = capacities.sum::<Option<f64>>()?;
    if fits(0.0, demand, Some(capacity)) {
        return None;
    }
    let what =
        format!("the demands add up to {demand}, and the capacities of the robots to {capacity}");
    let remedy = "give the robots more capacity, or the points deliver_to";
    Some(Problem::at(
        KeyPath::new(["service", "points"]),
        what,
        remedy,
    ))
}

#[cfg(test)]
mod tests {
    use scenario::testkit::refusals;

    use super::*;
    use crate::fixtures::{parse, read};
    use crate::service::data::{SERVICE, points};

    /// Returns a scenario with two points and two robots, with these lines for the kind, the first point and gold.
    fn text(kind: &str, point: &str, gold: &str) -> String {
        format!(
            "[service]\n[[service.kinds]]\nname = 'box'\nwork_s = {{ min = 1, max = 1 }}\n{kind}\n\
             [[service.points]]\nkind = 'box'\nx_m = 3\ny_m = 3\n{point}\n\
             [[service.points]]\nkind = 'box'\nx_m = 5\ny_m = 3\ndemand = 2\ndeadline_s = 90\n\
             [[robots]]\nname = 'gold'\n{gold}\n[[robots]]\nname = 'blue'\ncapacity = 4\n"
        )
    }

    #[test]
    fn mistakes_give_one_line_of_error() {
        let texts = [
            text("", "demand = -1", ""),
            text("", "demand = nan", ""),
            text("", "demand = 2", "capacity = -1"),
            text("", "demand = 5", "capacity = 4.5"),
            text("", "demand = 5", "tasks = ['serve(p1)']"),
            text("", "demand = 2\nneeds = { box = 2 }", ""),
            text("workers = 2", "", ""),
            text("kept = false", "", ""),
            text("deadline_s = { min = 9, max = 9 }", "demand = 1", ""),
            "waste = {}\n[[robots]]\nname = 'gold'\ncapacity = 3\n".to_owned(),
        ];
        insta::assert_snapshot!(refusals("s.toml", texts, read));
        for valid in [
            text("", "demand = 5", ""),
            text("", "demand = 4.5", "capacity = 4.5"),
            text(
                "deadline_s = { min = 9, max = 9 }",
                "demand = 1\ndeadline_s = 50",
                "",
            ),
            text("", "demand = 5", "capacity = 1")
                .replace("[service]", "[service]\nuncovered = true"),
        ] {
            let scenario = parse(&valid);
            assert_eq!(parse(&scenario.to_toml().unwrap()), scenario);
            assert_eq!(points(&scenario, 1)[1].demand, 2.0);
        }
    }

    #[test]
    fn demands_above_all_capacities_give_a_warning() {
        let warnings = |point: &str, gold: &str| {
            let warnings = SERVICE.warnings(&parse(&text("", point, gold)), &[]);
            let lines: Vec<String> = warnings.iter().map(ToString::to_string).collect();
            lines.join("\n")
        };
        assert_eq!(warnings("demand = 4", "capacity = 2"), "");
        assert_eq!(
            warnings("demand = 4", "capacity = 1.5"),
            "service.points: the demands add up to 6, and the capacities of the robots to 5.5; \
             give the robots more capacity, or the points deliver_to"
        );
        assert_eq!(warnings("demand = 4", ""), "", "gold carries any load");
        assert_eq!(
            warnings("demand = 4\ndeliver_to = [1, 1]", "capacity = 1"),
            ""
        );
        // What the team cannot do is a warning if the scenario allows it.
        let text = text("", "demand = 5\ndeliver_to = [1, 1]", "capacity = 1");
        let text = text.replace("[service]", "[service]\nuncovered = true");
        let warnings = SERVICE.warnings(&parse(&text), &[]);
        let lines: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        assert_eq!(
            lines,
            [
                "service.points[0].demand: no robot with the task of p0 has a capacity of 5; \
              reduce the demand, or give a robot more capacity"
            ]
        );
    }

    #[test]
    fn rounding_does_not_exceed_the_capacity() {
        let load = [0.1; 9].iter().sum::<f64>();
        assert!(load + 0.1 != 1.0 && fits(load, 0.1, Some(1.0)));
        assert!(!fits(load, 0.11, Some(1.0)) && fits(load, 0.11, None));
        assert!(
            fits(5.0, 0.0, Some(1.0)),
            "a robot that is full works on points without a demand"
        );
    }
}
