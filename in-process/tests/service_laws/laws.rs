//! The laws, from the log of a run.

use std::collections::{BTreeMap, BTreeSet};

use missions::service::data::{ServiceSection, Terms, points, predecessors, terms};
use run_log::{EventRow, PoseRow};
use scenario::time::SimTime;
use scenario::{Robot, Scenario};

use crate::Run;

/// The loads of the robots, by the events of a run.
struct Loads<'r> {
    capacities: BTreeMap<&'r str, f64>,
    /// The demands that a robot keeps for the rest of the run.
    taken: BTreeMap<&'r str, f64>,
    /// The load on its way, by robot: the point and its demand.
    carried: BTreeMap<&'r str, (usize, f64)>,
}

impl<'r> Loads<'r> {
    fn new(scenario: &'r Scenario) -> Self {
        let robots = scenario.robots.iter();
        let capacities = robots.filter_map(|robot| Some((robot.name.as_str(), robot.capacity?)));
        Self {
            capacities: capacities.collect(),
            taken: BTreeMap::new(),
            carried: BTreeMap::new(),
        }
    }

    /// Records an event of a point with these terms, and checks that its robot carries at most its capacity.
    fn record(&mut self, event: &'r EventRow, point: usize, terms: Terms) {
        let robot = event.robot.as_str();
        match event.kind.as_str() {
            "picked-up" => {
                self.carried.insert(robot, (point, terms.demand));
            }
            "done" if terms.deliver_to.is_none() => {
                *self.taken.entry(robot).or_default() += terms.demand;
            }
            _ => self.carried.retain(|_, (carried, _)| *carried != point),
        }
        let carried = self.carried.get(robot).map_or(0.0, |(_, demand)| *demand);
        let load = carried + self.taken.get(robot).copied().unwrap_or_default();
        let capacity = self.capacities.get(robot).copied().unwrap_or(f64::INFINITY);
        assert!(load <= capacity + 1e-6, "{event:?}: {load} of {capacity}");
    }
}

fn number_of(subject: &str) -> usize {
    subject
        .trim_start_matches('p')
        .parse()
        .expect("the name of a point")
}

/// Checks that the robots at work on a point have its skill, and fill all of its slots.
fn check_crew(run: &Run, number: usize, crew: &BTreeSet<&str>) {
    let section = ServiceSection::of(&run.scenario);
    let robots = run.scenario.robots.iter();
    let robots: Vec<&Robot> = robots
        .filter(|robot| crew.contains(robot.name.as_str()))
        .collect();
    let has = |robot: &Robot, skill: &str| robot.skill(skill).unwrap_or(1.0) > 0.0;
    match section.points.get(number).filter(|point| point.has_needs()) {
        Some(point) if !crew.is_empty() => {
            let slots = point.needs.iter();
            let slots =
                slots.flat_map(|(skill, count)| std::iter::repeat_n(skill, *count as usize));
            let slots: Vec<&String> = slots.collect();
            assert_eq!(crew.len(), slots.len(), "p{number}: {crew:?} for {slots:?}");
            assert!(
                can_fill(&robots, &slots, &has),
                "p{number}: {crew:?} for {slots:?}"
            );
        }
        Some(_) => {}
        None => {
            let kind = section.kinds_of_points().nth(number).unwrap();
            let skill = &section.kinds[kind].name;
            assert!(
                robots.iter().all(|robot| has(robot, skill)),
                "p{number}: {crew:?} without {skill}"
            );
        }
    }
}

/// Returns whether the robots can fill the slots, each robot one.
fn can_fill(robots: &[&Robot], slots: &[&String], has: &impl Fn(&Robot, &str) -> bool) -> bool {
    let Some((slot, rest)) = slots.split_first() else {
        return robots.is_empty();
    };
    (0..robots.len()).any(|index| {
        let others: Vec<&Robot> = robots[..index]
            .iter()
            .chain(&robots[index + 1..])
            .copied()
            .collect();
        has(robots[index], slot) && can_fill(&others, rest, has)
    })
}

/// Checks the laws of all classes.
pub fn check(run: &Run) {
    let section = ServiceSection::of(&run.scenario);
    let terms = terms(section);
    let of_point = |number: usize| terms.get(number).copied().unwrap_or(Terms::NONE);
    let specs = points(&run.scenario, run.seed);
    let before = predecessors(section);
    let mut outcomes: BTreeMap<usize, &str> = BTreeMap::new();
    let mut crews: BTreeMap<usize, BTreeSet<&str>> = BTreeMap::new();
    let mut loads = Loads::new(&run.scenario);
    let mut now = SimTime::ZERO;
    let (mut collected, mut lost) = (0.0, 0.0);
    for event in &run.events {
        let kind = event.kind.as_str();
        if ["picked-up", "load-lost", "done", "expired"].contains(&kind) {
            let number = number_of(&event.subject);
            loads.record(event, number, of_point(number));
        }
        if !["begun", "left", "load-lost", "done", "expired"].contains(&kind) {
            continue;
        }
        if event.t_ms > now {
            now = event.t_ms;
            crews
                .iter()
                .for_each(|(point, crew)| check_crew(run, *point, crew));
        }
        let number = number_of(&event.subject);
        let crew = crews.entry(number).or_default();
        match kind {
            "begun" => assert!(crew.insert(&event.robot), "{event:?} twice"),
            // A robot that carries the load of a point does not leave it.
            "load-lost" => assert!(crew.remove(event.robot.as_str()), "{event:?} without work"),
            "left" => assert!(crew.remove(event.robot.as_str()), "{event:?} without work"),
            "done" => {
                // The event names the robots of the last step.
                let by = event.detail.split_once(", by ");
                let by = by.map(|(_, names)| names.split(", ").collect());
                check_crew(run, number, &by.unwrap_or_else(|| std::mem::take(crew)));
                crew.clear();
            }
            _ => crew.clear(),
        }
        let (opens, closes) = of_point(number).window(0);
        match kind {
            "begun" | "done" => {
                for before in before.get(number).into_iter().flatten() {
                    let outcome = outcomes.get(&(*before as usize));
                    assert_eq!(outcome, Some(&"done"), "{event:?} before p{before}");
                }
                assert!(event.t_ms >= opens, "{event:?} before {opens}");
                assert!(
                    closes.is_none_or(|closes| event.t_ms < closes),
                    "{event:?} after {closes:?}"
                );
                assert_eq!(
                    outcomes.get(&number),
                    None,
                    "{event:?} of a point that is over"
                );
            }
            "expired" => {
                let is_late = closes.is_some_and(|closes| event.t_ms >= closes);
                let mut before = before.get(number).into_iter().flatten();
                let has_expired =
                    |before: &u32| outcomes.get(&(*before as usize)) == Some(&"expired");
                assert!(is_late || before.any(has_expired), "{event:?}");
            }
            _ => {}
        }
        if kind == "done" || kind == "expired" {
            assert_eq!(outcomes.insert(number, kind), None, "{event:?} twice");
            *(if kind == "done" {
                &mut collected
            } else {
                &mut lost
            }) += specs[number].value;
        }
    }
    let figure = |name: &str| {
        run.log
            .run
            .result
            .mission
            .get(name)
            .number()
            .unwrap_or(-1.0)
    };
    let sum = ["done", "expired", "unreachable", "uncovered", "open"].map(figure);
    assert_eq!(sum.iter().sum::<f64>(), specs.len() as f64, "{sum:?}");
    assert_eq!(figure("total"), specs.len() as f64);
    let count = |kind: &str| {
        outcomes
            .values()
            .filter(|outcome| **outcome == kind)
            .count() as f64
    };
    assert_eq!(
        (figure("done"), figure("expired")),
        (count("done"), count("expired"))
    );
    assert_eq!(
        (figure("value_collected"), figure("value_lost")),
        (collected, lost)
    );
}

/// Checks that the energy of each robot is between 0 and the capacity, and that a robot without energy has no task.
pub fn check_energy(run: &Run) {
    let Some(energy) = &run.scenario.energy else {
        return;
    };
    let rows: Vec<PoseRow> = run.log.rows().unwrap();
    for robot in &run.scenario.robots {
        let own = rows.iter().filter(|row| row.robot == robot.name);
        let mut was_empty = false;
        for row in own {
            let left_j = row.energy.unwrap();
            let capacity_j = energy.capacity_j;
            assert!(
                (0.0..=f64::from(capacity_j)).contains(&f64::from(left_j)),
                "{row:?}"
            );
            assert!(
                !(was_empty && left_j == 0.0) || row.behavior_set.is_empty(),
                "{row:?}"
            );
            was_empty = left_j == 0.0;
        }
    }
    let used_j = run.log.run.result.mission.get("energy_used_j").number();
    assert!(used_j > Some(0.0), "{used_j:?}");
}
