//! Service in scenario files: the section `[service]`, its tasks and terms.

mod check;
mod dependencies;
mod family;
mod faults;
mod loads;
mod objective;
mod parameters;
mod paths;
mod points;
mod precedence;
mod random;
mod room;
mod section;
mod slots;
mod terms;
#[cfg(test)]
mod tests;
mod warnings;
mod ways;

pub use faults::{POINT, refuse_order};
pub use loads::{fits, too_heavy};
pub use objective::{DEADLOCKS, VALUE_COLLECTED, VALUE_LOST};
pub use paths::{Destination, Origin, Paths};
pub use points::{PointSpec, points};
pub use precedence::{predecessors, successors};
pub use room::crew_reach_m;
pub use section::{
    Charger, CostMeasure, Interval, Kind, KnowledgeSource, Point, RandomPoints, ServiceSection,
    TaskGranularity,
};
pub use slots::{Slot, Slots};
pub use terms::{Terms, terms};
pub use ways::Ways;

use glam::Vec2;
use scenario::fault::Order;
use scenario::ids::TaskId;
use scenario::mission::columns::Column;
use scenario::mission::data::{
    BehaviorProperties, DefaultAllianceParams, DrawSection, MissionData, MissionVocabulary,
    Objective, TaskDependencies, WorkUnit,
};
use scenario::mission::expected_properties::ExpectedProperties;
use scenario::mission::registry::{Mission, read_section};
use scenario::mission::section::Section;
use scenario::{BehaviorSpec, Body, ParameterSpec, Problem, Robot, Scenario, UntypedTable};

pub const MAX_POINTS: usize = scenario::MAX_TASKS;
pub const MAX_KINDS: usize = 10_000;

pub const SERVICE: Mission = Mission::new(
    "service",
    "points of work that arrive, take time and skills, and may expire or come back",
    &Service,
);

/// The number that a behavior's kind contains besides the kind of work, if the behavior fills a slot of a point.
const SLOT: u32 = MAX_KINDS as u32 + 1;

/// Returns the kind of work of a behavior; `None` for a point that a fault adds.
fn kind_of<'s>(section: &'s ServiceSection, behavior: &BehaviorSpec) -> Option<&'s Kind> {
    section.kinds.get((behavior.kind % SLOT) as usize)
}

#[derive(Debug)]
struct Service;

impl MissionData for Service {
    fn section(&self, text: UntypedTable<'_>) -> Result<Box<dyn Section>, Problem> {
        read_section::<ServiceSection>(text)
    }

    fn family(&self, robots: usize, size: usize) -> Option<Scenario> {
        Some(family::family(robots, size))
    }

    fn parameters(&self) -> Vec<ParameterSpec> {
        parameters::all()
    }

    fn vocabulary(&self) -> MissionVocabulary {
        MissionVocabulary {
            scenarios: &builtin_scenarios![
                "l-alliance-abstract",
                "janitorial",
                "space-greedy",
                "course-project",
                "sadcher-coalitions",
                "vrptw",
                "long-endurance",
            ],
            size_option: Some("points"),
            has_loads: true,
            faults: faults::ALL,
            devices: &["points", "effect"],
            measuring_devices: &["points"],
            events: &[
                "arrived",
                "begun",
                "left",
                "done",
                "expired",
                "deadlock",
                "charging",
                "charged",
                "picked-up",
                "load-lost",
            ],
            verbs: &[
                ("begins", "begun"),
                ("leaves", "left"),
                ("finishes", "done"),
            ],
            columns: const {
                &[
                    Column::left("open"),
                    Column::count("started"),
                    Column::done("done", "done"),
                    Column::expired("expired"),
                    Column::real("work_left_s").with_label("work at open points"),
                    Column::count("pending").with_label("still to arrive"),
                ]
            },
            ..MissionVocabulary::NONE
        }
    }

    fn knows_obstacles(&self, scenario: &Scenario) -> bool {
        ServiceSection::of(scenario).costs == CostMeasure::Path
    }

    fn objective(&self, scenario: &Scenario) -> Objective {
        objective::objective(ServiceSection::of(scenario))
    }

    fn dependencies(&self, scenario: &Scenario) -> TaskDependencies {
        dependencies::dependencies(scenario)
    }

    fn catalog(&self, scenario: &Scenario) -> (Vec<String>, Vec<BehaviorSpec>) {
        let section = ServiceSection::of(scenario);
        if section.tasks == TaskGranularity::Points && section.points.iter().any(Point::has_needs) {
            return slots::catalog(section);
        }
        let skill = |kind: usize| Some(section.kinds.get(kind)?.name.clone());
        let (tasks, kinds): (Vec<String>, Vec<usize>) = match section.tasks {
            TaskGranularity::Points => {
                // A point that a fault adds may be of any kind.
                let spare = std::iter::repeat_n(usize::MAX, section.spare as usize);
                let kinds: Vec<usize> = section.kinds_of_points().chain(spare).collect();
                let tasks = (0..kinds.len()).map(|point| format!("serve(p{point})"));
                (tasks.collect(), kinds)
            }
            TaskGranularity::Kinds => {
                let kinds = section.kinds.iter();
                let tasks = kinds.map(|kind| format!("serve({})", kind.name));
                (tasks.collect(), (0..section.kinds.len()).collect())
            }
        };
        let behaviors = tasks.iter().zip(kinds).zip(0..=u32::MAX);
        let behaviors = behaviors.map(|((name, kind), task)| BehaviorSpec {
            name: name.clone(),
            task: TaskId(task),
            kind: kind.min(MAX_KINDS) as u32,
            skill: skill(kind),
        });
        let behaviors = behaviors.collect();
        (tasks, behaviors)
    }

    fn behavior_properties(
        &self,
        scenario: &Scenario,
        behavior: &BehaviorSpec,
    ) -> BehaviorProperties {
        let section = ServiceSection::of(scenario);
        let kind = kind_of(section, behavior);
        BehaviorProperties {
            max_robots: match (section.tasks, kind) {
                (TaskGranularity::Points, Some(kind)) if behavior.kind < SLOT => kind.workers,
                _ => 1,
            },
            recurrence_s: kind.and_then(|kind| kind.period_s),
            priority: match section.tasks {
                TaskGranularity::Points => section.priority(behavior.task.index()),
                TaskGranularity::Kinds => 0,
            },
            ..BehaviorProperties::default()
        }
    }

    /// Returns the slots of each point that has several.
    fn coalitions(&self, scenario: &Scenario) -> Vec<Vec<TaskId>> {
        let section = ServiceSection::of(scenario);
        if section.tasks == TaskGranularity::Kinds {
            return Vec::new();
        }
        let slots = Slots::new(section);
        let tasks = |slots: &[Slot]| slots.iter().map(|slot| slot.task).collect();
        let several = slots.iter().filter(|(_, slots)| slots.len() > 1);
        several.map(|(_, slots)| tasks(slots)).collect()
    }

    fn skills(&self, scenario: &Scenario) -> Vec<String> {
        ServiceSection::of(scenario).skills()
    }

    /// Derives the built-in parameters from the unit of work: patience for two units, perseverance for four.
    fn default_alliance_params(
        &self,
        scenario: &Scenario,
        robot: &Robot,
        behavior: &BehaviorSpec,
    ) -> DefaultAllianceParams {
        let body = scenario.body_of(robot);
        let unit_s = unit_s(scenario, &body, robot.skill_at(behavior), behavior);
        DefaultAllianceParams {
            broadcast_rate_hz: 1.0,
            ceased_after_s: 5.0,
            fast_impatience: 20.0,
            slow_impatience: f64::min(10.0, scenario.alliance.threshold / (2.0 * unit_s)),
            willing_to_affect_s: 2.0 * unit_s,
            before_yielding_s: 2.0 * unit_s,
            before_giving_up_s: 4.0 * unit_s,
        }
    }

    fn work_unit_s<'a>(&'a self, scenario: &'a Scenario) -> WorkUnit<'a> {
        Box::new(|body, skill, behavior| unit_s(scenario, body, skill, behavior))
    }

    fn random_section(&self) -> Option<DrawSection> {
        Some(random::draw_section)
    }

    fn fault_names(&self, scenario: &Scenario, _key: &str) -> Vec<String> {
        let kinds = ServiceSection::of(scenario).kinds.iter();
        kinds.map(|kind| kind.name.clone()).collect()
    }

    fn check_order(&self, scenario: &Scenario, order: &Order) -> Result<(), Problem> {
        if let Some(when) = &order.when {
            faults::check_trigger(scenario, when)?;
        }
        faults::check(scenario, order)
    }

    /// Returns the promises of a run. It ends unless a task is uncovered, points keep coming back,
    /// one robot is not enough for a point, or the robots may be full.
    fn expected_properties(&self, scenario: &Scenario) -> ExpectedProperties {
        let section = ServiceSection::of(scenario);
        let comes_back = section.kinds.iter().any(|kind| kind.period_s.is_some());
        ExpectedProperties {
            ends: !section.uncovered
                && !section
                    .points
                    .iter()
                    .any(|point| point.has_needs() || point.demand.is_some())
                && (!comes_back || section.duration_s.is_some()),
            ..ExpectedProperties::default()
        }
    }

    /// Returns the squares of the stated points, each with room for a robot.
    fn free_areas(&self, scenario: &Scenario) -> Vec<[Vec2; 2]> {
        let section = ServiceSection::of(scenario);
        let points = section.points.iter().flat_map(|point| {
            let deliver_to = point.deliver_to.map(Vec2::from);
            [Some(Vec2::new(point.x_m, point.y_m)), deliver_to]
        });
        let chargers = section.chargers.iter().map(Charger::place);
        let places = points.flatten().chain(chargers);
        let radius_m = scenario.body.radius_m;
        places.map(|at| [at - radius_m, at + radius_m]).collect()
    }

    fn warnings(&self, scenario: &Scenario, starts: &[Vec2]) -> Vec<Problem> {
        warnings::warnings(scenario, starts)
    }

    fn faults_in_vain(&self, scenario: &Scenario) -> Vec<Problem> {
        faults::in_vain(scenario)
    }

    fn check_places(&self, scenario: &Scenario) -> Result<(), Problem> {
        check::check_places(scenario)
    }

    fn check(&self, scenario: &Scenario) -> Result<(), Problem> {
        check::check(scenario)
    }
}

/// Returns the longest duration of a unit of work, s: the way across the room to a point, and all of its work.
fn unit_s(scenario: &Scenario, body: &Body, skill: f64, behavior: &BehaviorSpec) -> f64 {
    let section = ServiceSection::of(scenario);
    let across_m = scenario.room.width_m.hypot(scenario.room.height_m);
    let way_m = (across_m - section.reach_m).max(0.0);
    let drive_s = if way_m > 0.0 {
        f64::from(way_m / body.speed_m_s + 180.0 / body.turn_deg_s)
    } else {
        0.0
    };
    let of_kind = kind_of(section, behavior);
    let longest = section.kinds.iter().map(|kind| kind.work_s.max);
    let work_s = of_kind.map_or_else(|| longest.fold(0.0, f64::max), |kind| kind.work_s.max);
    drive_s + work_s / skill
}
