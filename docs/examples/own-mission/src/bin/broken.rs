//! The visit program with parts that fail after three seconds.
//!
//! The environment variable `BREAKS` selects the part: `world`, `controller`, `nan` or `allocator`. The tests in
//! `tests/broken.rs` check the effect.

use missions::MissionParts;
use own_mission::controller::Visitor;
use own_mission::data::VISIT;
use own_mission::world::Visit;
use proto::telemetry::{AllocationRow, BehaviorState};
use robot_agent::allocator::{Allocator, Decision, Input, NoParameters, SelfState};
use robot_agent::mission::prelude::*;
use serde::Serialize;
use world_server::mission::prelude::*;

const WHEN: SimTime = SimTime(3000);

fn breaks(part: &str) -> bool {
    std::env::var("BREAKS").is_ok_and(|selected| selected == part)
}

fn main() -> std::process::ExitCode {
    let parts = MissionParts::new::<World>(VISIT, |_| {
        ControllerConstructor::new(|robot, setup| Controller {
            robot,
            controller: Visitor::new(robot, setup),
        })
    });
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
        decision.rows.push(AllocationRow {
            task,
            behavior,
            utility,
            holder: None,
            state,
        });
    }
}

#[derive(Clone, Serialize)]
struct World(Visit);

impl MissionWorld for World {
    fn new(setup: &Setup, floor: &Floor) -> Self {
        Self(Visit::new(setup, floor))
    }

    fn act(
        &mut self,
        robot: RobotId,
        action: &Action,
        floor: &mut Floor,
        happened: &mut StepEvents,
    ) {
        self.0.act(robot, action, floor, happened);
    }

    fn settle(&mut self, floor: &mut Floor, _: &mut StepEvents) {
        assert!(
            !breaks("world") || floor.now() < WHEN,
            "the world fails on purpose"
        );
    }

    fn sense(&self, robot: RobotId, floor: &Floor, sensed: &mut SensorReading) -> Validity {
        self.0.sense(robot, floor, sensed)
    }

    fn change(
        &mut self,
        fault: &MissionFault,
        floor: &mut Floor,
    ) -> Option<Result<String, ChangeError>> {
        self.0.change(fault, floor)
    }

    fn end(&self, now: SimTime) -> Option<Outcome> {
        self.0.end(now)
    }

    fn row(&self, row: &mut Vec<FigureValue>) {
        self.0.row(row);
    }

    fn state_hash(&self) -> u64 {
        hash_state(self)
    }

    fn add_to_view(&self, floor: &Floor, view: &mut View) {
        self.0.add_to_view(floor, view);
    }
}

#[derive(Clone, Debug)]
struct Controller {
    robot: RobotId,
    controller: Visitor,
}

impl MissionController for Controller {
    fn perceive(
        &mut self,
        input: &ControllerInput,
        received: &[Arc<Broadcast>],
        perception: &mut Perception,
    ) {
        let breaks = breaks("controller") && self.robot == RobotId(0);
        assert!(
            !breaks || input.now < WHEN,
            "the controller fails on purpose"
        );
        self.controller.perceive(input, received, perception);
    }

    fn act(
        &mut self,
        input: &ControllerInput,
        active: Option<BehaviorId>,
        output: &mut StepOutput,
    ) {
        self.controller.act(input, active, output);
        if breaks("nan") && input.now >= WHEN {
            output.actuation.speed_m_s = f32::NAN;
        }
    }

    fn shared_knowledge(&self, input: &ControllerInput, knowledge: &mut SharedKnowledge) {
        self.controller.shared_knowledge(input, knowledge);
    }

    fn seconds(&self, from: Option<Vec2>, after: &[TaskId], task: TaskId) -> Option<f64> {
        self.controller.seconds(from, after, task)
    }
}
