//! The definition of a mission in files: its section of a scenario, its tasks, behaviors and names. Its world and its robots'
//! controllers are defined elsewhere.

#![warn(missing_docs)]

use std::fmt::Debug;

use glam::Vec2;
use rand_chacha::ChaCha8Rng;

use super::columns::Column;
use super::expected_properties::ExpectedProperties;
use super::section::{MissionSection, Section};
use crate::fault::{FaultSpec, MissionFault, Order};
use crate::ids::TaskId;
use crate::{BehaviorSpec, Body, ParameterSpec, Problem, Robot, Scenario, UntypedTable};

/// The data of a mission. A scenario file with the section `[NAME]` belongs to this mission.
///
/// ```
/// use scenario::Vocabulary;
/// use scenario::mission::prelude::*;
/// use serde::{Deserialize, Serialize};
///
/// /// A mission in which robots knock at doors.
/// #[derive(Debug)]
/// struct Knock;
///
/// #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
/// #[serde(deny_unknown_fields)]
/// struct KnockSection {
///     doors: i64,
/// }
///
/// impl MissionData for Knock {
///     fn section(&self, text: UntypedTable<'_>) -> Result<Box<dyn Section>, Problem> {
///         read_section::<KnockSection>(text)
///     }
///
///     fn parameters(&self) -> Vec<ParameterSpec> {
///         let (default, range) = (ParameterDefault::Required, ParameterRange::Whole(1, 9));
///         vec![ParameterSpec::new("doors", "", default, "number of doors", range)]
///     }
///
///     fn vocabulary(&self) -> MissionVocabulary {
///         MissionVocabulary {
///             columns: const { &[Column::done("knocked", "knocked"), Column::left("left")] },
///             events: &["knocked"],
///             ..MissionVocabulary::NONE
///         }
///     }
///
///     fn catalog(&self, scenario: &Scenario) -> (Vec<String>, Vec<BehaviorSpec>) {
///         let doors = 0..scenario.section::<KnockSection>().doors;
///         one_behavior_each(doors.map(|door| format!("knock(door-{door})")))
///     }
/// }
///
/// let missions = vec![Mission::new("knock", "knock at every door", &Knock)];
/// let vocabulary = Vocabulary { missions, allocators: Vec::new() };
/// let read = |text| Scenario::parse("knock.toml", text, &vocabulary).map_err(|error| error.to_string());
/// assert_eq!(read("[knock]\ndoors = 3").unwrap().section::<KnockSection>().doors, 3);
/// assert_eq!(
///     read("[knock]\ndoors = 0").unwrap_err(),
///     "knock.toml:2: knock.doors: 0 is out of range; it must be a whole number from 1 to 9"
/// );
/// ```
pub trait MissionData: Debug + Send + Sync + 'static {
    /// Reads the mission's section into its own type, with `read_section`. Missing top-level keys
    /// have the defaults that [`parameters`](MissionData::parameters) declare.
    ///
    /// # Errors
    /// Returns the first key or value that does not fit.
    fn section(&self, text: UntypedTable<'_>) -> Result<Box<dyn Section>, Problem>;

    /// Removes values from the section that robots do not receive in advance.
    fn withhold(&self, _section: &mut MissionSection) {}

    /// Returns whether robots receive the obstacles of the scenario before the start, as a map. The default is false.
    fn knows_obstacles(&self, _scenario: &Scenario) -> bool {
        false
    }

    /// Returns the measure by which runs of the scenario are ranked. The default is the time to completion, which
    /// separates runs only if a mission can be completed at different times.
    fn objective(&self, _scenario: &Scenario) -> Objective {
        Objective::Time
    }

    /// Returns the dependencies between tasks and robots, for the class of the scenario in taxonomies. The default is
    /// none.
    fn dependencies(&self, _scenario: &Scenario) -> TaskDependencies {
        TaskDependencies::default()
    }

    /// Returns the team of a scenario that states none.
    fn team(&self) -> Vec<Robot> {
        let robot = |name: &str| Robot {
            name: name.to_owned(),
            ..Robot::default()
        };
        ["blue", "gold", "green"].map(robot).to_vec()
    }

    /// Returns a scenario with this number of robots and amount of work, 1 to 1,000,000 each; `None` if the mission has
    /// only one size.
    fn family(&self, _robots: usize, _size: usize) -> Option<Scenario> {
        None
    }

    /// Returns the keys of the mission's section in display order. The values of a scenario are checked against them.
    fn parameters(&self) -> Vec<ParameterSpec> {
        Vec::new()
    }

    /// Returns the declarations that are the same in every scenario.
    fn vocabulary(&self) -> MissionVocabulary;

    /// Returns the names of the tasks, and the behaviors in the order of their tasks. Both lists are complete and the
    /// same for the whole run. See [`one_behavior_each`].
    fn catalog(&self, scenario: &Scenario) -> (Vec<String>, Vec<BehaviorSpec>);

    /// Returns the properties of a behavior's work, which depend on the scenario.
    fn behavior_properties(
        &self,
        _scenario: &Scenario,
        _behavior: &BehaviorSpec,
    ) -> BehaviorProperties {
        BehaviorProperties::default()
    }

    /// Returns the groups of tasks that robots must execute at the same time, each group in ascending order. By default
    /// none.
    fn coalitions(&self, _scenario: &Scenario) -> Vec<Vec<TaskId>> {
        Vec::new()
    }

    /// Returns true if a robot's devices allow a behavior whose task and skill the robot has. By default every robot
    /// has every behavior.
    fn has_behavior(&self, robot: &Robot, behavior: &BehaviorSpec) -> bool {
        let _ = (robot, behavior);
        true
    }

    /// Returns the names of the skills that robots may have.
    fn skills(&self, _scenario: &Scenario) -> Vec<String> {
        Vec::new()
    }

    /// Returns the default ALLIANCE values of a robot's behavior.
    fn default_alliance_params(
        &self,
        scenario: &Scenario,
        robot: &Robot,
        behavior: &BehaviorSpec,
    ) -> DefaultAllianceParams {
        let _ = (scenario, robot, behavior);
        DefaultAllianceParams::COMMON
    }

    /// Returns a function that estimates the longest time between two signs of progress in a behavior, s, for a robot with
    /// this body and skill. The default is a trip across the room and half a turn.
    fn work_unit_s<'a>(&'a self, scenario: &'a Scenario) -> WorkUnit<'a> {
        Box::new(|body, _, _| {
            let (width, height) = (scenario.room.width_m, scenario.room.height_m);
            let way_m = (width * width + height * height).sqrt();
            f64::from(way_m / body.speed_m_s + 180.0 / body.turn_deg_s)
        })
    }

    /// Returns the names that an argument of the mission's faults accepts; see [`FaultRange::Name`].
    ///
    /// [`FaultRange::Name`]: crate::fault::FaultRange::Name
    fn fault_names(&self, _scenario: &Scenario, _key: &str) -> Vec<String> {
        Vec::new()
    }

    /// Checks an order beyond the declarations of the mission's [faults](MissionVocabulary::faults).
    ///
    /// # Errors
    /// Returns the first mistake.
    fn check_order(&self, _scenario: &Scenario, _order: &Order) -> Result<(), Problem> {
        Ok(())
    }

    /// Returns the longest interval between two events of a [time](super::columns::ColumnKind::Time) column of
    /// mission.csv before the next is late, s.
    fn max_event_interval_s(&self, _scenario: &Scenario, _column: &str) -> Option<f64> {
        None
    }

    /// Returns the properties that every run of the scenario must have.
    fn expected_properties(&self, _scenario: &Scenario) -> ExpectedProperties {
        ExpectedProperties::default()
    }

    /// Returns the maximum number of items that a fault of the mission adds.
    fn items_added(&self, _fault: &MissionFault) -> usize {
        0
    }

    /// Returns a function that checks whether robots search for items at a place, m, that they have not visited before.
    fn is_searched<'a>(&self, _scenario: &'a Scenario) -> IsSearched<'a> {
        Box::new(|_| true)
    }

    /// Estimates the time that a robot with this body needs to search everywhere for items, s, after no known item is
    /// left. Returns `None` if robots do not search.
    fn search_s(&self, _scenario: &Scenario, _body: &Body) -> Option<f64> {
        None
    }

    /// Returns a function that adds a random section, and the equipment for it, to a scenario with random room and
    /// robots. With `None`, random missions of this kind need the section in their scenario.
    fn random_section(&self) -> Option<DrawSection> {
        None
    }

    /// Returns rectangles that random missions keep free of obstacles: lower left and upper right corners, m.
    fn free_areas(&self, _scenario: &Scenario) -> Vec<[Vec2; 2]> {
        Vec::new()
    }

    /// Returns valid values of the mission's section that contradict each other or the time limit, and work to which no
    /// way leads. `alliance check` shows them. The scenario is checked, and robots have the devices and skills of the
    /// team. `starts` are their positions at the start, by rank, m.
    fn warnings(&self, _scenario: &Scenario, _starts: &[Vec2]) -> Vec<Problem> {
        Vec::new()
    }

    /// Returns a problem for each fault of the mission in the scenario's timeline that cannot take effect, such as work at a
    /// place that no robot reaches. The scenario is checked.
    fn faults_in_vain(&self, _scenario: &Scenario) -> Vec<Problem> {
        Vec::new()
    }

    /// Checks the places that the mission's section states, against the border and the obstacles. All ranges are
    /// checked by then.
    ///
    /// # Errors
    /// Returns the first place that no robot can use.
    fn check_places(&self, _scenario: &Scenario) -> Result<(), Problem> {
        Ok(())
    }

    /// Checks the mission's values beyond the declarations of its [`parameters`](MissionData::parameters). This check
    /// runs first: names and ranges of all other values are unchecked.
    ///
    /// # Errors
    /// Returns the first mistake.
    fn check(&self, _scenario: &Scenario) -> Result<(), Problem> {
        Ok(())
    }
}

/// Creates a [catalog](MissionData::catalog) with one behavior per task. The behavior has the task's name, and its kind
/// is the task's number.
pub fn one_behavior_each(tasks: impl Iterator<Item = String>) -> (Vec<String>, Vec<BehaviorSpec>) {
    let tasks: Vec<String> = tasks.collect();
    let behaviors = (0..=u32::MAX).zip(&tasks).map(|(task, name)| BehaviorSpec {
        name: name.clone(),
        task: TaskId(task),
        kind: task,
        skill: None,
    });
    let behaviors = behaviors.collect();
    (tasks, behaviors)
}

/// A function that estimates a unit of work by body, skill and behavior ([`MissionData::work_unit_s`]).
pub type WorkUnit<'a> = Box<dyn Fn(&Body, f64, &BehaviorSpec) -> f64 + 'a>;

/// A function that checks whether robots search a place ([`MissionData::is_searched`]).
pub type IsSearched<'a> = Box<dyn Fn(Vec2) -> bool + 'a>;

/// A function that writes a random section of a mission ([`MissionData::random_section`]). The result must be valid with any
/// room and robots.
pub type DrawSection = fn(&mut Scenario, &mut ChaCha8Rng);

/// A scenario that comes with a mission and can be run by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuiltinScenario {
    /// The name on the command line.
    pub name: &'static str,
    /// The text of the file, comments included.
    pub text: &'static str,
}

/// The ALLIANCE parameters of one behavior (ALLIANCE.md §1). They must satisfy the rules between parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DefaultAllianceParams {
    /// ρ: the number of heartbeats per second.
    pub broadcast_rate_hz: f64,
    /// τ: the silence after which a teammate counts as inactive, s.
    pub ceased_after_s: f64,
    /// δ_fast: the growth of motivation while no teammate executes the task, motivation/s.
    pub fast_impatience: f64,
    /// δ_slow: the growth of motivation while a teammate executes the task, motivation/s.
    pub slow_impatience: f64,
    /// φ: the time for which a teammate's activity slows the growth, s.
    pub willing_to_affect_s: f64,
    /// ψ: the time on a task before a robot yields it to a teammate, s.
    pub before_yielding_s: f64,
    /// λ: the time on a task before a robot gives it up, s.
    pub before_giving_up_s: f64,
}

impl DefaultAllianceParams {
    /// Values for work of about half a minute.
    pub const COMMON: Self = Self {
        broadcast_rate_hz: 1.0,
        ceased_after_s: 5.0,
        fast_impatience: 10.0,
        slow_impatience: 0.5,
        willing_to_affect_s: 60.0,
        before_yielding_s: 120.0,
        before_giving_up_s: 240.0,
    };
}

/// The measure by which runs of a scenario are ranked. Equal runs are ranked by [`Time`](Self::Time).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Objective {
    /// The simulated time until the mission is complete. A run that does not complete it counts twice the time limit
    /// (PAR2). Less is better.
    Time,
    /// The amount of finished work, for scenarios in which work can be lost. More is better.
    Done,
    /// A figure in run.json, such as a rate in scenarios in which every run takes the same time.
    Figure {
        /// The name in comparisons, such as `observed`.
        name: &'static str,
        /// The name of the figure in run.json, such as `a`.
        figure: &'static str,
        /// True if a larger value is better.
        more_is_better: bool,
        /// The definition, in one sentence.
        meaning: &'static str,
    },
}

/// The properties of a behavior's work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BehaviorProperties {
    /// The number of robots that may execute the task at once, unless the scenario states it; 1, the default, is
    /// exclusive.
    pub max_robots: u32,
    /// The interval after which the work is due again, s; `None`, the default, for work that does not recur.
    pub recurrence_s: Option<f64>,
    /// The priority of the task, unless the scenario states another one than 0; 0 is the default.
    pub priority: i32,
    /// True if the task has many units of work, so that a robot keeps the task. The default is false.
    pub is_long_running: bool,
}

impl Default for BehaviorProperties {
    fn default() -> Self {
        Self {
            max_robots: 1,
            recurrence_s: None,
            priority: 0,
            is_long_running: false,
        }
    }
}

/// The dependencies between tasks and robots in a scenario, each with its reason; `None` if there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TaskDependencies {
    /// The reason why a robot works on several tasks at once.
    pub several_tasks: Option<&'static str>,
    /// The reason why a task needs several robots at once.
    pub several_robots: Option<&'static str>,
    /// The reason why a task depends on the other tasks of the same robot.
    pub in_schedule: Option<&'static str>,
    /// The reason why a task depends on the tasks of other robots.
    pub cross_schedule: Option<&'static str>,
}

/// The declarations of a mission that are the same in every scenario.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MissionVocabulary {
    /// The scenarios that come with the mission.
    pub scenarios: &'static [BuiltinScenario],
    /// The name of a scenario that states none; `None` means the mission's name.
    pub scenario_name: Option<&'static str>,
    /// The unit of a [family](MissionData::family)'s size. The command line accepts `--WORD` instead of `--size`.
    pub size_option: Option<&'static str>,
    /// The faults that the mission defines.
    pub faults: &'static [FaultSpec],
    /// The sensing devices of this mission alone, which faults can break.
    pub devices: &'static [&'static str],
    /// The devices among them that measure lengths, so that faults can make them noisy or biased.
    pub measuring_devices: &'static [&'static str],
    /// The kinds of notes in events.csv that the mission's robots write.
    pub notes: &'static [&'static str],
    /// True if robots carry loads up to their `capacity`.
    pub has_loads: bool,
    /// The devices that a robot may have or lack (`[[robots]] devices`).
    pub optional_devices: &'static [&'static str],
    /// The kinds of events in events.csv that only this mission has.
    pub events: &'static [&'static str],
    /// The kinds in `events` that are an effect of a robot's work, although no column of mission.csv counts them. The
    /// report takes a robot as productive up to its last effect.
    pub effects: &'static [&'static str],
    /// True if the work itself is the effect: a robot is productive while a behavior set is active.
    pub continuous: bool,
    /// The verbs that can trigger faults, each with the kind of its event. Such an event is work of its robot, by which
    /// takeovers differ from negotiation.
    pub verbs: &'static [(&'static str, &'static str)],
    /// The names of the two kinds of bulletins: the last chunk of their keys, and `kind` in messages.csv.
    pub bulletins: [&'static str; 2],
    /// The columns of mission.csv after the time.
    pub columns: &'static [Column],
}

impl MissionVocabulary {
    /// A mission without any declarations, as a base for others.
    pub const NONE: Self = Self {
        scenarios: &[],
        scenario_name: None,
        size_option: None,
        faults: &[],
        devices: &[],
        measuring_devices: &[],
        notes: &[],
        has_loads: false,
        optional_devices: &[],
        events: &[],
        effects: &[],
        continuous: false,
        verbs: &[],
        bulletins: ["first", "second"],
        columns: &[],
    };
}
