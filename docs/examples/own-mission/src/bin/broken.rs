//! The visit program with parts that fail after three seconds.
//!
//! The environment variable `BREAKS` selects the part: `world`, `controller`, `nan` or `allocator`. The tests in
//! `tests/broken.rs` check the effect.

use std::sync::Arc;

use scenario::fault::Fault;
use scenario::ids::{BehaviorId, ItemId, RobotId, TaskId};
use proto::mission::{Action, SensorReading, SharedKnowledge};
use scenario::Setup;
use proto::team::Broadcast;
use proto::telemetry::{AllocationRow, BehaviorState};
use proto::tick::Outcome;
use scenario::time::SimTime;
use proto::view::View;
use glam::Vec2;
use missions::MissionParts;
use own_mission::VISIT;
use robot_agent::allocator::{Allocator, Choice, Decision, Input, SelfState, NoParameters, RouteCost};
use robot_agent::mission::{AgentMission, ControllerInput, MissionController, Perception, SharedMission, StepOutput};
use world_server::mission::{FigureValue, MissionWorld, StepEvents, TeamFigures, Validity, WorldMission};
use world_server::world::{ChangeError, Floor};

const WHEN: SimTime = SimTime(3000);

fn breaks(part: &str) -> bool {
    std::env::var("BREAKS").is_ok_and(|selected| selected == part)
}

fn main() -> std::process::ExitCode {
    let parts = MissionParts {
        world: MissionWorld { new: |setup, floor| Box::new(World((VISIT.world.new)(setup, floor))), ..VISIT.world },
        controller: MissionController {
            shared: |setup| Arc::new(Team((VISIT.controller.shared)(setup))),
            ..VISIT.controller
        },
    };
    let registry = launch::Registry::built_in().with_mission(parts);
    launch::main(if breaks("allocator") {
        registry.with_allocator::<NotANumber>("alliance", "a utility that is not a number")
    } else {
        registry
    })
}

#[derive(Clone, Debug)]
struct NotANumber;

impl Allocator for NotANumber {
    type Config = NoParameters;

    fn new(_: &SelfState, _: &NoParameters) -> Self {
        Self
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        let utility = if input.now < WHEN { 1.0 } else { f64::NAN };
        let state = BehaviorState::Hibernating;
        let (task, behavior) = (TaskId(0), BehaviorId(0));
        decision.rows.push(AllocationRow { task, behavior, utility, holder: None, state });
    }
}

struct World(Box<dyn WorldMission>);

impl WorldMission for World {
    fn act(&mut self, robot: RobotId, action: &Action, floor: &mut Floor, happened: &mut StepEvents) {
        self.0.act(robot, action, floor, happened);
    }

    fn settle(&mut self, floor: &mut Floor, _: &mut StepEvents) {
        assert!(!breaks("world") || floor.now() < WHEN, "the world fails on purpose");
    }

    fn sense(&self, robot: RobotId, floor: &Floor, sensed: &mut SensorReading) -> Validity {
        self.0.sense(robot, floor, sensed)
    }

    fn release_load(&mut self, robot: RobotId, floor: &mut Floor, happened: &mut StepEvents) {
        self.0.release_load(robot, floor, happened);
    }

    fn change(&mut self, fault: &Fault, floor: &mut Floor) -> Option<Result<String, ChangeError>> {
        self.0.change(fault, floor)
    }

    fn end(&self, now: SimTime) -> Option<Outcome> {
        self.0.end(now)
    }

    fn load(&self, robot: RobotId) -> Option<ItemId> {
        self.0.load(robot)
    }

    fn row(&self, row: &mut Vec<FigureValue>) {
        self.0.row(row);
    }

    fn state_hash(&self) -> u64 {
        self.0.state_hash()
    }

    fn figures(&self, figures: &mut TeamFigures) {
        self.0.figures(figures);
    }

    fn add_to_view(&self, floor: &Floor, view: &mut View) {
        self.0.add_to_view(floor, view);
    }

    fn clone_boxed(&self) -> Box<dyn WorldMission> {
        Box::new(Self(self.0.clone_boxed()))
    }
}

#[derive(Debug)]
struct Team(Arc<dyn SharedMission>);

impl SharedMission for Team {
    fn create_controller(&self, robot: RobotId, setup: &Setup) -> Box<dyn AgentMission> {
        Box::new(Controller { robot, controller: self.0.create_controller(robot, setup) })
    }
}

#[derive(Debug)]
struct Controller {
    robot: RobotId,
    controller: Box<dyn AgentMission>,
}

impl RouteCost for Controller {
    fn seconds(&self, after: &[TaskId], task: TaskId) -> Option<f64> {
        self.controller.seconds(after, task)
    }
}

impl AgentMission for Controller {
    fn perceive(&mut self, input: &ControllerInput<'_>, received: &[Arc<Broadcast>], perception: &mut Perception) {
        let breaks = breaks("controller") && self.robot == RobotId(0);
        assert!(!breaks || input.now < WHEN, "the controller fails on purpose");
        self.controller.perceive(input, received, perception);
    }

    fn choices(&self, input: &ControllerInput<'_>, applicable: &[bool], choices: &mut Vec<Choice>) {
        self.controller.choices(input, applicable, choices);
    }

    fn act(&mut self, input: &ControllerInput<'_>, active: Option<BehaviorId>, output: &mut StepOutput) {
        self.controller.act(input, active, output);
        if breaks("nan") && input.now >= WHEN {
            output.actuation.speed_m_s = f32::NAN;
        }
    }

    fn shared_knowledge(&self, knowledge: &mut SharedKnowledge) {
        self.controller.shared_knowledge(knowledge);
    }

    fn position(&self) -> Option<Vec2> {
        self.controller.position()
    }

    fn is_laden(&self) -> bool {
        self.controller.is_laden()
    }

    fn checkpoint(&self) -> Box<dyn AgentMission> {
        Box::new(Self { robot: self.robot, controller: self.controller.checkpoint() })
    }
}
