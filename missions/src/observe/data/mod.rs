//! Observe in files: the scenario section `[observe]`, the tasks and the terms.

mod area;
mod check;
mod family;
mod parameters;
mod section;
#[cfg(test)]
mod tests;

pub use area::Area;
pub use section::{ObserveSection, Policy, Region, TaskKind};

use glam::Vec2;
use scenario::fault::{EventTrigger, Order};
use scenario::mission::columns::Column;
use scenario::mission::data::{
    BehaviorProperties, DefaultAllianceParams, MissionData, MissionVocabulary, Objective,
    TaskDependencies, WorkUnit, one_behavior_each,
};
use scenario::mission::expected_properties::ExpectedProperties;
use scenario::mission::registry::{Mission, read_section};
use scenario::mission::section::Section;
use scenario::{BehaviorSpec, ParameterSpec, Problem, Robot, Scenario, UntypedTable};

use crate::duration::beyond_limit;

pub const MAX_TARGETS: usize = scenario::MAX_TASKS;

pub const OBSERVE: Mission = Mission::new(
    "observe",
    "moving targets that robots keep in sight (CMOMMT)",
    &Observe,
);

/// Ranks runs by the observed targets, because every run takes `duration_s`.
const OBJECTIVE: Objective = Objective::Figure {
    name: "observed",
    figure: "a",
    more_is_better: true,
    meaning: "Share of the targets in sight of at least one robot, over the entire run (A/n).",
};

#[derive(Debug)]
struct Observe;

impl MissionData for Observe {
    fn section(&self, text: UntypedTable<'_>) -> Result<Box<dyn Section>, Problem> {
        read_section::<ObserveSection>(text)
    }

    fn dependencies(&self, _: &Scenario) -> TaskDependencies {
        TaskDependencies {
            cross_schedule: Some("a target counts once, however many robots observe it"),
            ..TaskDependencies::default()
        }
    }

    fn family(&self, robots: usize, size: usize) -> Option<Scenario> {
        Some(family::family(robots, size))
    }

    fn parameters(&self) -> Vec<ParameterSpec> {
        parameters::all()
    }

    fn vocabulary(&self) -> MissionVocabulary {
        MissionVocabulary {
            scenarios: &builtin_scenarios!["cmommt", "cmommt-crowded"],
            size_option: Some("targets"),
            devices: &["targets"],
            measuring_devices: &["targets"],
            events: &["found", "lost"],
            continuous: true,
            verbs: &[("finds", "found"), ("loses", "lost")],
            columns: const {
                &[
                    Column::count("observed").with_label("targets observed"),
                    Column::count("pairs").with_label("pairs of robot and observed target"),
                ]
            },
            ..MissionVocabulary::NONE
        }
    }

    fn objective(&self, _: &Scenario) -> Objective {
        OBJECTIVE
    }

    fn catalog(&self, scenario: &Scenario) -> (Vec<String>, Vec<BehaviorSpec>) {
        let duties = ObserveSection::from_scenario(scenario)
            .policy
            .duties()
            .iter();
        one_behavior_each(duties.map(|duty| duty.name().to_owned()))
    }

    fn behavior_properties(&self, scenario: &Scenario, _: &BehaviorSpec) -> BehaviorProperties {
        BehaviorProperties {
            max_robots: scenario.robots.len() as u32,
            is_long_running: true,
            ..BehaviorProperties::default()
        }
    }

    /// Teammates at the same task are no reason to wait, so slow impatience almost equals fast impatience.
    fn default_alliance_params(
        &self,
        scenario: &Scenario,
        _: &Robot,
        behavior: &BehaviorSpec,
    ) -> DefaultAllianceParams {
        let section = ObserveSection::from_scenario(scenario);
        let fast_impatience = match section.policy.duties()[behavior.task.index()] {
            TaskKind::Observe => 100.0,
            TaskKind::Search => 20.0,
        };
        DefaultAllianceParams {
            broadcast_rate_hz: 1.0,
            ceased_after_s: 5.0,
            fast_impatience,
            slow_impatience: 0.99 * fast_impatience,
            willing_to_affect_s: section.duration_s,
            before_yielding_s: section.duration_s,
            before_giving_up_s: section.duration_s,
        }
    }

    fn work_unit_s<'a>(&'a self, scenario: &'a Scenario) -> WorkUnit<'a> {
        let duration_s = ObserveSection::from_scenario(scenario).duration_s;
        Box::new(move |_, _, _| duration_s)
    }

    fn expected_properties(&self, _: &Scenario) -> ExpectedProperties {
        ExpectedProperties {
            ends: true,
            ..ExpectedProperties::default()
        }
    }

    fn check_order(&self, scenario: &Scenario, order: &Order) -> Result<(), Problem> {
        let verbs = ["finds", "loses"];
        let when = order.when.as_ref();
        let Some(when) = when.filter(|when| verbs.contains(&when.what.as_str())) else {
            return Ok(());
        };
        let count = ObserveSection::from_scenario(scenario).n as usize;
        let exists = |object: &str| {
            EventTrigger::number_of(object, "t").is_some_and(|target| target < count)
        };
        when.check_object(exists, format!("name a target from t0 to t{}", count - 1))
    }

    fn warnings(&self, scenario: &Scenario, _: &[Vec2]) -> Vec<Problem> {
        let duration_s = ObserveSection::from_scenario(scenario).duration_s;
        let late = beyond_limit(scenario, "observe", duration_s);
        late.into_iter().collect()
    }

    fn check(&self, scenario: &Scenario) -> Result<(), Problem> {
        check::check(scenario)
    }
}
