//! The class of a scenario in two taxonomies of task allocation, with the reason of each part.
//!
//! - Gerkey and Matarić (Int. J. Robotics Research 23(9), 2004): robots work on one task at a time or on several (ST,
//!   MT); a task needs one robot or several (SR, MR); the allocation is instantaneous or extends over time (IA, TA).
//! - iTax (Korsah, Stentz and Dias, Int. J. Robotics Research 32(12), 2013): no dependencies between tasks (ND), within
//!   the schedule of a robot (ID), or across those of several robots (XD). Complex dependencies (CD), in which a task can
//!   be decomposed in several ways, cannot be stated in a scenario.

use std::fmt;

use missions::Registry;
use scenario::Scenario;
use scenario::mission::data::TaskDependencies;

/// A class of a taxonomy, with its reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    pub name: &'static str,
    pub reason: String,
}

/// The class of a scenario: the three parts of Gerkey and Matarić, then that of iTax.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TaskClass(pub [Part; 4]);

impl TaskClass {
    /// Returns the class of a scenario for the allocators of its robots.
    #[must_use]
    pub fn of(scenario: &Scenario) -> Self {
        let agents = Registry::current().agents();
        let deciders = scenario
            .robots
            .iter()
            .map(|robot| scenario.decider_of(robot));
        let planner = deciders
            .into_iter()
            .find(|name| agents.plans_sequences(name));
        Self::new(&scenario.mission().dependencies(scenario), planner)
    }

    /// Returns the class of a scenario with these dependencies. `planner` is the allocator of a robot that plans a sequence
    /// of tasks, if there is one.
    #[must_use]
    pub fn new(dependencies: &TaskDependencies, planner: Option<&str>) -> Self {
        let either =
            |cause: Option<&str>, [with, without]: [&'static str; 2], default: &str| Part {
                name: if cause.is_some() { with } else { without },
                reason: cause.unwrap_or(default).to_owned(),
            };
        let robots = either(
            dependencies.several_tasks,
            ["MT", "ST"],
            "a robot works on one task at a time",
        );
        let tasks = either(
            dependencies.several_robots,
            ["MR", "SR"],
            "one robot suffices for each task",
        );
        let time = match planner {
            Some(name) => Part {
                name: "TA",
                reason: format!("{name} plans a sequence of tasks for each robot"),
            },
            None => Part {
                name: "IA",
                reason: "each robot selects its next task only".to_owned(),
            },
        };
        let within =
            planner.map(|name| format!("with {name}, the way to a task depends on the one before"));
        let (name, reason) = match (
            dependencies.cross_schedule,
            dependencies.in_schedule,
            within,
        ) {
            (Some(cause), ..) => ("XD", cause.to_owned()),
            (None, Some(cause), _) => ("ID", cause.to_owned()),
            (None, None, Some(cause)) => ("ID", cause),
            (None, None, None) => ("ND", "no task depends on another one".to_owned()),
        };
        Self([robots, tasks, time, Part { name, reason }])
    }

    /// Returns the names of the parts, such as `ST-SR-IA, ND`.
    #[must_use]
    pub fn names(&self) -> String {
        let [robots, tasks, time, dependencies] = self.0.each_ref().map(|part| part.name);
        format!("{robots}-{tasks}-{time}, {dependencies}")
    }
}

impl fmt::Display for TaskClass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "class {}", self.names())?;
        for part in &self.0 {
            write!(f, "\n  {}: {}", part.name, part.reason)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit;

    #[test]
    fn each_dependency_has_its_class() {
        let none = TaskDependencies::default();
        let some = Some("a reason");
        let table = [
            (none, None, "ST-SR-IA, ND"),
            (none, Some("cbba"), "ST-SR-TA, ID"),
            (
                TaskDependencies {
                    in_schedule: some,
                    ..none
                },
                None,
                "ST-SR-IA, ID",
            ),
            (
                TaskDependencies {
                    cross_schedule: some,
                    ..none
                },
                None,
                "ST-SR-IA, XD",
            ),
            (
                TaskDependencies {
                    in_schedule: some,
                    cross_schedule: some,
                    ..none
                },
                Some("cbba"),
                "ST-SR-TA, XD",
            ),
            (
                TaskDependencies {
                    several_robots: some,
                    cross_schedule: some,
                    ..none
                },
                None,
                "ST-MR-IA, XD",
            ),
            (
                TaskDependencies {
                    several_tasks: some,
                    ..none
                },
                None,
                "MT-SR-IA, ND",
            ),
        ];
        for (dependencies, planner, expected) in table {
            let class = TaskClass::new(&dependencies, planner);
            assert_eq!(class.names(), expected, "{dependencies:?}");
            let reasons = class
                .0
                .iter()
                .filter(|part| part.reason == "a reason")
                .count();
            let given = [
                dependencies.several_tasks,
                dependencies.several_robots,
                // iTax states the strongest dependency only.
                dependencies.cross_schedule.or(dependencies.in_schedule),
            ];
            assert_eq!(reasons, given.iter().flatten().count(), "{class}");
        }
    }

    #[test]
    fn the_keys_of_points_and_the_allocator_determine_the_class() {
        const POINTS: &str = "[service]\n[[service.kinds]]\nname = 'a'\nwork_s = { min = 1, max = 1 }\n\
            [[service.points]]\nkind = 'a'\nx_m = 3\ny_m = 3\n[[service.points]]\nkind = 'a'\nx_m = 5\ny_m = 3\n";
        const CHARGER: &str = "[[service.chargers]]\nx_m = 1\ny_m = 1\nrate_w = 10\n[energy]\n";
        let table = [
            ("alliance", "", "ST-SR-IA, ND"),
            ("cbaa", "", "ST-SR-IA, ND"),
            ("acbba", "", "ST-SR-TA, ID"),
            ("static", "", "ST-SR-TA, ID"),
            ("alliance", "opens_s = 5\nvalue = 2\n", "ST-SR-IA, ND"),
            ("alliance", "after = ['p0']\n", "ST-SR-IA, XD"),
            ("grape", "needs = { a = 2 }\n", "ST-MR-IA, XD"),
            ("cbba", "needs = { a = 1, b = 1 }\n", "ST-MR-TA, XD"),
            ("alliance", CHARGER, "ST-SR-IA, ID"),
            (
                "alliance",
                "demand = 2\n[[robots]]\nname = 'r'\ncapacity = 4\n",
                "ST-SR-IA, ID",
            ),
            ("alliance", "demand = 2\n", "ST-SR-IA, ND"),
        ];
        for (allocator, more, expected) in table {
            let scenario = testkit::scenario(&format!("allocator = '{allocator}'\n{POINTS}{more}"));
            assert_eq!(
                TaskClass::of(&scenario).names(),
                expected,
                "{allocator} with {more}"
            );
        }
        // One robot that plans is enough.
        let mixed = "[[robots]]\nname = 'r'\n[[robots]]\nname = 's'\nallocator = 'cbba'\n";
        let scenario = testkit::scenario(&format!("{POINTS}{mixed}"));
        assert_eq!(TaskClass::of(&scenario).names(), "ST-SR-TA, ID");
    }

    /// The page of each mission states the classes of its scenarios.
    #[test]
    fn the_pages_of_the_missions_state_the_classes() {
        const PAGES: [&str; 4] = [
            include_str!("../../../docs/missions/waste.md"),
            include_str!("../../../docs/missions/service.md"),
            include_str!("../../../docs/missions/push.md"),
            include_str!("../../../docs/missions/observe.md"),
        ];
        for known in Registry::built_in().vocabulary().builtins() {
            let class = TaskClass::of(&testkit::scenario(known.text)).names();
            let row = format!("| `{}` | {class} |", known.name);
            let is_stated = PAGES.iter().any(|page| page.contains(&row));
            assert!(is_stated, "the pages lack: {row}");
        }
    }
}
