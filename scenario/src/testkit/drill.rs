//! A mission for tests that are independent of any real mission. Robots can allocate its tasks, but the tasks have no
//! effect in the world.

use crate::fault::{FaultArgument, FaultRange, FaultSpec};
use crate::ids::TaskId;
use crate::mission::columns::Column;
use crate::mission::data::{DefaultAllianceParams, MissionData, MissionVocabulary, WorkUnit};
use crate::mission::registry::Mission;
use crate::mission::registry::read_section;
use crate::mission::section::Section;
use crate::{BehaviorSpec, Problem, Robot, Scenario, Setup, UntypedTable, Vocabulary};

/// The drill mission with the tasks `find`, `move(top)`, `move(bottom)` and `report`. `find` has two behaviors, and one
/// of them needs a device that not all robots have. A robot whose skill `lift` is 0 cannot execute the `move` tasks.
pub const DRILL: Mission = Mission::new("drill", "tasks for tests", &Drill);

/// Returns the vocabulary of tests: the drill and ALLIANCE.
#[must_use]
pub fn vocabulary() -> Vocabulary {
    Vocabulary {
        missions: vec![DRILL],
        allocators: vec![crate::AllocatorSpec::alliance()],
    }
}

/// Returns the drill scenario for the robots blue (which has the optional device), gold and green.
#[must_use]
pub fn default_scenario() -> Scenario {
    // All keys of the mission's section are optional, so this cannot fail.
    #[allow(clippy::expect_used)]
    Scenario::for_mission(DRILL).expect("a scenario of the drill")
}

#[must_use]
pub fn default_setup(seed: u64) -> Setup {
    // The scenario has no external dependencies, so this cannot fail.
    #[allow(clippy::expect_used)]
    let resolved =
        Setup::resolve(default_scenario(), seed, None).expect("the default scenario is valid");
    resolved.setup
}

/// Returns a drill scenario with two different robots. Blue has all devices and skills of the team; gold has its own
/// values.
#[must_use]
pub fn unlike_robots() -> Setup {
    const TEXT: &str = "devices = ['horn']
        body.push_m_s = 0.3
        skills.lift = 2
        drill = {}
        [[robots]]
        name = 'blue'
        [[robots]]
        name = 'gold'
        speed_m_s = 0.25
        push_m_s = 0.1
        turn_deg_s = 45
        devices = ['side-border']
        skills = {}
        tasks = ['find', 'report']";
    // The scenario has no external dependencies, so this cannot fail.
    #[allow(clippy::expect_used)]
    let scenario =
        Scenario::parse("unlike.toml", TEXT, &vocabulary()).expect("the scenario is valid");
    #[allow(clippy::expect_used)]
    let resolved = Setup::resolve(scenario, 1, None).expect("the scenario is valid");
    resolved.setup
}

#[derive(Debug)]
struct Drill;

const FAULTS: &[FaultSpec] = &[FaultSpec {
    name: "shake",
    about: "shakes the floor",
    arguments: &[
        FaultArgument::new("x_m", "where, m", FaultRange::X, None),
        FaultArgument::new("y_m", "where, m", FaultRange::Y, None),
        FaultArgument::new("times", "how often", FaultRange::Whole(1, 9), Some(1.0)),
    ],
}];

impl MissionData for Drill {
    fn section(&self, text: UntypedTable<'_>) -> Result<Box<dyn Section>, Problem> {
        read_section::<std::collections::BTreeMap<String, u32>>(text)
    }

    fn team(&self) -> Vec<Robot> {
        let robot = |(name, side_sensor): (&str, bool)| Robot {
            name: name.to_owned(),
            side_sensor,
            ..Robot::default()
        };
        [("blue", true), ("gold", false), ("green", false)]
            .map(robot)
            .to_vec()
    }

    fn vocabulary(&self) -> MissionVocabulary {
        MissionVocabulary {
            faults: FAULTS,
            devices: &["eye", "hand", "gripper"],
            optional_devices: &[Robot::SIDE_BORDER, "horn"],
            measuring_devices: &["eye"],
            notes: &["noticed"],
            events: &["done"],
            verbs: &[("does", "done")],
            bulletins: ["first", "second"],
            columns: const {
                &[
                    Column::left("left"),
                    Column::left("held"),
                    Column::left("lost"),
                    Column::done("done", "done"),
                    Column::time("last_ms", "done"),
                ]
            },
            ..MissionVocabulary::NONE
        }
    }

    fn catalog(&self, _scenario: &Scenario) -> (Vec<String>, Vec<BehaviorSpec>) {
        let tasks = ["find", "move(top)", "move(bottom)", "report"];
        let behaviors = [
            ("find-methodical", 0),
            ("find-wander", 0),
            ("move(top)", 1),
            ("move(bottom)", 2),
            ("report", 3),
        ];
        let behavior = |(kind, (name, task)): (usize, (&str, u32))| BehaviorSpec {
            name: name.to_owned(),
            task: TaskId(task),
            kind: kind as u32,
            skill: matches!(kind, 2 | 3).then(|| "lift".to_owned()),
        };
        (
            tasks.map(str::to_owned).to_vec(),
            behaviors.into_iter().enumerate().map(behavior).collect(),
        )
    }

    fn has_behavior(&self, robot: &Robot, behavior: &BehaviorSpec) -> bool {
        behavior.kind != 0 || robot.has_device(Robot::SIDE_BORDER)
    }

    fn skills(&self, _scenario: &Scenario) -> Vec<String> {
        vec!["lift".to_owned()]
    }

    fn default_alliance_params(
        &self,
        _scenario: &Scenario,
        _robot: &Robot,
        behavior: &BehaviorSpec,
    ) -> DefaultAllianceParams {
        let (fast, slow, phi, psi, lambda) = match behavior.kind {
            0 => (20.0, 1.0, 60.0, 120.0, 300.0),
            1 => (5.0, 0.5, 60.0, 120.0, 300.0),
            2 | 3 => (10.0, 0.5, 120.0, 240.0, 480.0),
            _ => (25.0, 1.0, 60.0, 60.0, 120.0),
        };
        DefaultAllianceParams {
            broadcast_rate_hz: 1.0,
            ceased_after_s: 5.0,
            fast_impatience: fast,
            slow_impatience: slow,
            willing_to_affect_s: phi,
            before_yielding_s: psi,
            before_giving_up_s: lambda,
        }
    }

    fn work_unit_s<'a>(&'a self, _: &'a Scenario) -> WorkUnit<'a> {
        Box::new(|_, _, _| 30.0)
    }
}
