//! What a mission is in files: its part of a scenario, its tasks and behaviors, its words. Nothing of its world, nor of its
//! robots' minds.

use std::fmt::Debug;

use glam::Vec2;
use rand_chacha::ChaCha8Rng;

use super::columns::Column;
use super::promises::Promises;
use super::section::{MissionSection, Section};
use crate::fault::{FaultSpec, MissionFault, Order, OrderError};
use crate::ids::TaskId;
use crate::scenario::{BehaviorSpec, Body, ParameterSpec, Problem, Robot, Scenario, Unread};

/// A mission's data. A scenario whose file has the section `[NAME]` is one of this mission.
///
/// ```
/// use alliance_proto::mission::prelude::*;
/// use alliance_proto::scenario::Vocabulary;
/// use serde::{Deserialize, Serialize};
///
/// /// Doors to be knocked at.
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
///     fn section(&self, text: Unread<'_>) -> Result<Box<dyn Section>, Problem> {
///         section::<KnockSection>(text)
///     }
///
///     fn parameters(&self) -> Vec<ParameterSpec> {
///         let (default, range) = (ParameterDefault::Required, ParameterRange::Whole(1, 9));
///         vec![ParameterSpec::new("doors", "", default, "how many there are", range)]
///     }
///
///     fn terms(&self) -> Terms {
///         Terms {
///             columns: const { &[Column::done("knocked", "knocked"), Column::left("left")] },
///             events: &["knocked"],
///             ..Terms::NONE
///         }
///     }
///
///     fn catalog(&self, scenario: &Scenario) -> (Vec<String>, Vec<BehaviorSpec>) {
///         let doors = 0..scenario.section::<KnockSection>().doors;
///         one_behavior_each(doors.map(|door| format!("knock(door-{door})")))
///     }
/// }
///
/// let missions = vec![Mission::new("knock", "doors to be knocked at", &Knock)];
/// let vocabulary = Vocabulary { missions, allocators: Vec::new() };
/// let read = |text| Scenario::parse("knock.toml", text, &vocabulary).map_err(|error| error.to_string());
/// assert_eq!(read("[knock]\ndoors = 3").unwrap().section::<KnockSection>().doors, 3);
/// assert_eq!(
///     read("[knock]\ndoors = 0").unwrap_err(),
///     "knock.toml:2: knock.doors: 0 is out of range; it must be a whole number from 1 to 9"
/// );
/// ```
pub trait MissionData: Debug + Send + Sync + 'static {
    /// Its section, read by [`section`](super::known::section) as a type of its own. Keys at its top that are not stated have the
    /// defaults that its [`parameters`](MissionData::parameters) declare.
    ///
    /// # Errors
    /// The first key or value that does not fit.
    fn section(&self, text: Unread<'_>) -> Result<Box<dyn Section>, Problem>;

    /// Takes out of its section what robots are not told beforehand.
    fn brief(&self, _section: &mut MissionSection) {}

    /// The scenarios that come with it.
    fn scenarios(&self) -> &'static [BuiltinScenario] {
        &[]
    }

    /// Name of a scenario that states none; `None`: the mission's.
    fn scenario_name(&self) -> Option<&'static str> {
        None
    }

    /// The team of a scenario that states none.
    fn team(&self) -> Vec<Robot> {
        let robot = |name: &str| Robot {
            name: name.to_owned(),
            ..Robot::default()
        };
        ["blue", "gold", "green"].map(robot).to_vec()
    }

    /// The mission for so many robots with so much to do, 1 to 10,000 of each; `None`: it comes in one size only.
    fn family(&self, _robots: usize, _size: usize) -> Option<Scenario> {
        None
    }

    /// What the size of a [`family`](Self::family) counts: on the command line `--WORD` goes for `--size`.
    fn size_word(&self) -> Option<&'static str> {
        None
    }

    /// The keys of its section, in the order in which they are listed to people. What a scenario states is checked against them.
    fn parameters(&self) -> Vec<ParameterSpec> {
        Vec::new()
    }

    /// The words that it adds to those of every run.
    fn terms(&self) -> Terms;

    /// Tasks by name, and the behaviors in the order of their tasks: complete, and the same for the whole run. See
    /// [`one_behavior_each`].
    fn catalog(&self, scenario: &Scenario) -> (Vec<String>, Vec<BehaviorSpec>);

    /// How many robots may execute a behavior's task at once, where the scenario does not say: 1 is exclusive.
    fn max_robots(&self, _scenario: &Scenario, _behavior: &BehaviorSpec) -> u32 {
        1
    }

    /// Whether a robot that has the task of a behavior, and the skill that this takes, has the behavior: by devices. All have all,
    /// where it is not said.
    fn has_behavior(&self, robot: &Robot, behavior: &BehaviorSpec) -> bool {
        let _ = (robot, behavior);
        true
    }

    /// Names of the skills that robots may have.
    fn skills(&self, _scenario: &Scenario) -> Vec<String> {
        Vec::new()
    }

    /// The ALLIANCE values of a robot's behavior where nothing is stated.
    fn built_in(&self, scenario: &Scenario, robot: &Robot, behavior: &BehaviorSpec) -> BuiltIn {
        let _ = (scenario, robot, behavior);
        BuiltIn::COMMON
    }

    /// Longest unit of work of a behavior for a robot of that body, which is that good at it, from one sign of progress to the next,
    /// s: an estimate. Across the room and half a turn, where it is not said.
    fn unit_s(&self, scenario: &Scenario, body: &Body, skill: f64, behavior: &BehaviorSpec) -> f64 {
        let _ = (skill, behavior);
        let (width, height) = (scenario.room.width_m, scenario.room.height_m);
        let way_m = (width * width + height * height).sqrt();
        f64::from(way_m / body.speed_m_s + 180.0 / body.turn_deg_s)
    }

    /// Faults of its own.
    fn faults(&self) -> &'static [FaultSpec] {
        &[]
    }

    /// Checks of an order what only the mission knows, beyond what its [`faults`](MissionData::faults) say.
    ///
    /// # Errors
    /// The first mistake.
    fn check_order(&self, _scenario: &Scenario, _order: &Order) -> Result<(), OrderError> {
        Ok(())
    }

    /// How long the [time](super::columns::ColumnKind::Time) of a column of mission.csv may lie back before the next is late, s.
    fn period_s(&self, _scenario: &Scenario, _column: &str) -> Option<f64> {
        None
    }

    /// What holds of its runs for those who look at them from outside.
    fn promises(&self, _scenario: &Scenario) -> Promises {
        Promises::default()
    }

    /// Most items that a fault of its own adds.
    fn items_added(&self, _fault: &MissionFault) -> usize {
        0
    }

    /// Whether robots look for items at that place, m, without having been there before.
    fn is_looked_for(&self, _scenario: &Scenario, _place: Vec2) -> bool {
        true
    }

    /// How long a robot of that body takes to look for items everywhere, from when it knows of none that is left, s: an estimate;
    /// `None` where robots do not.
    fn search_s(&self, _scenario: &Scenario, _body: &Body) -> Option<f64> {
        None
    }

    /// How often the work of a behavior is due again, s, where that is so.
    fn due_every_s(&self, _scenario: &Scenario, _behavior: &BehaviorSpec) -> Option<f64> {
        None
    }

    /// Whether a behavior's task has many units of work, so that whoever has it stays at it.
    fn goes_on(&self, _behavior: &BehaviorSpec) -> bool {
        false
    }

    /// Writes a random section of its own into a scenario whose room and robots have been drawn, and what robots have for it; `None`:
    /// random missions are of it only with the section of their scenario.
    fn random(&self) -> Option<Draw> {
        None
    }

    /// Rectangles that random missions keep free of obstacles: lower left and upper right corners, m.
    fn kept_free(&self, _scenario: &Scenario) -> Vec<[Vec2; 2]> {
        Vec::new()
    }

    /// Checks what the scenario says of this mission, beyond what its [`parameters`](MissionData::parameters) say: it comes before
    /// that. Names and ranges of everything else have not been checked yet.
    ///
    /// # Errors
    /// The first mistake.
    fn check(&self, _scenario: &Scenario) -> Result<(), Problem> {
        Ok(())
    }
}

/// The [catalog](MissionData::catalog) of a mission whose tasks have a behavior each, of the task's name; its kind is the task's number.
pub fn one_behavior_each(tasks: impl Iterator<Item = String>) -> (Vec<String>, Vec<BehaviorSpec>) {
    let tasks: Vec<String> = tasks.collect();
    let behaviors = (0..=u16::MAX).zip(&tasks).map(|(task, name)| BehaviorSpec {
        name: name.clone(),
        task: TaskId(task),
        kind: task.into(),
        skill: None,
    });
    let behaviors = behaviors.collect();
    (tasks, behaviors)
}

/// Draws what a scenario says of a mission ([`MissionData::random`]). What it draws can be read and run with any room and robots.
pub type Draw = fn(&mut Scenario, &mut ChaCha8Rng);

/// A scenario that comes with a mission, and can be run by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuiltinScenario {
    /// What it is run by.
    pub name: &'static str,
    /// Its file, comments included.
    pub text: &'static str,
}

/// ALLIANCE's values of one behavior (ALLIANCE.md §1). They keep the rules among themselves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BuiltIn {
    /// ρ, heartbeats per second.
    pub broadcast_rate_hz: f64,
    /// τ, s.
    pub ceased_after_s: f64,
    /// δ_fast, motivation/s.
    pub fast_impatience: f64,
    /// δ_slow toward every teammate, motivation/s.
    pub slow_impatience: f64,
    /// φ toward every teammate, s.
    pub willing_to_affect_s: f64,
    /// ψ, s.
    pub before_yielding_s: f64,
    /// λ, s.
    pub before_giving_up_s: f64,
}

impl BuiltIn {
    /// They suit work of half a minute or so.
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

/// The words of a mission.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terms {
    /// Sensing devices of this mission alone, which can break.
    pub devices: &'static [&'static str],
    /// Those of them that tell lengths, so that they can be noisy or biased.
    pub measuring_devices: &'static [&'static str],
    /// Kinds of notes in events.csv that its robots write.
    pub notes: &'static [&'static str],
    /// Devices that a robot may have or lack (`[[robots]] devices`).
    pub optional_devices: &'static [&'static str],
    /// Kinds of events in events.csv that only this mission knows.
    pub events: &'static [&'static str],
    /// Those of `events` that are an effect of the robot's work though no column of mission.csv counts them. The report takes a robot for
    /// productive up to its last effect.
    pub effects: &'static [&'static str],
    /// Whether the work itself is the effect: a robot is productive as long as a behavior set is active.
    pub continuous: bool,
    /// Verbs that faults can wait for, each with the kind of the event that it stands for.
    pub verbs: &'static [(&'static str, &'static str)],
    /// Names of its two kinds of bulletins: last chunk of their keys, and `kind` in messages.csv.
    pub bulletins: [&'static str; 2],
    /// Columns of mission.csv after the time.
    pub columns: &'static [Column],
}

impl Terms {
    /// Those of a mission that has none: a start for others.
    pub const NONE: Self = Self {
        devices: &[],
        measuring_devices: &[],
        notes: &[],
        optional_devices: &[],
        events: &[],
        effects: &[],
        continuous: false,
        verbs: &[],
        bulletins: ["first", "second"],
        columns: &[],
    };
}
