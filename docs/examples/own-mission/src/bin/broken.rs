//! The visit program with parts that fail after three seconds.
//!
//! The environment variable `BREAKS` selects the part: `world`, `mind`, `nan` or `allocator`. The tests in
//! `tests/broken.rs` check the effect.

use std::sync::Arc;

use scenario::fault::Fault;
use scenario::ids::{BehaviorId, ItemId, RobotId, TaskId};
use proto::mission::{Deed, Lore, Sensed};
use scenario::Setup;
use proto::team::Broadcast;
use proto::telemetry::{AllocationRow, BehaviorState};
use proto::tick::Outcome;
use scenario::time::SimTime;
use proto::view::View;
use glam::Vec2;
use missions::MissionParts;
use own_mission::VISIT;
use robot_agent::allocator::{Allocator, Choice, Decision, Input, Me, NoParameters, RouteCost};
use robot_agent::mission::{StepOutput, AgentMission, MissionMind, Moment, Perception, SharedMission};
use world_server::mission::{Happened, MissionWorld, TeamFigures, Validity, Value, WorldMission};
use world_server::world::{ChangeError, Floor};

const WHEN: SimTime = SimTime(3000);

fn breaks(part: &str) -> bool {
    std::env::var("BREAKS").is_ok_and(|selected| selected == part)
}

fn main() -> std::process::ExitCode {
    let parts = MissionParts {
        world: MissionWorld { new: |setup, floor| Box::new(World((VISIT.world.new)(setup, floor))), ..VISIT.world },
        mind: MissionMind { shared: |setup| Arc::new(Team((VISIT.mind.shared)(setup))), ..VISIT.mind },
    };
    let registry = launch::Registry::built_in().mission(parts);
    launch::main(if breaks("allocator") {
        registry.allocator::<NotANumber>("alliance", "a utility that is not a number")
    } else {
        registry
    })
}

#[derive(Clone, Debug)]
struct NotANumber;

impl Allocator for NotANumber {
    type Config = NoParameters;

    fn new(_: &Me, _: &NoParameters) -> Self {
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
    fn act(&mut self, robot: RobotId, deed: &Deed, floor: &mut Floor, happened: &mut Happened) {
        self.0.act(robot, deed, floor, happened);
    }

    fn settle(&mut self, floor: &mut Floor, _: &mut Happened) {
        assert!(!breaks("world") || floor.now() < WHEN, "the world fails on purpose");
    }

    fn sense(&self, robot: RobotId, floor: &Floor, sensed: &mut Sensed) -> Validity {
        self.0.sense(robot, floor, sensed)
    }

    fn lose(&mut self, robot: RobotId, floor: &mut Floor, happened: &mut Happened) {
        self.0.lose(robot, floor, happened);
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

    fn row(&self, row: &mut Vec<Value>) {
        self.0.row(row);
    }

    fn state(&self) -> u64 {
        self.0.state()
    }

    fn figures(&self, figures: &mut TeamFigures) {
        self.0.figures(figures);
    }

    fn show(&self, floor: &Floor, view: &mut View) {
        self.0.show(floor, view);
    }

    fn boxed(&self) -> Box<dyn WorldMission> {
        Box::new(Self(self.0.boxed()))
    }
}

#[derive(Debug)]
struct Team(Arc<dyn SharedMission>);

impl SharedMission for Team {
    fn mind(&self, robot: RobotId, setup: &Setup) -> Box<dyn AgentMission> {
        Box::new(Mind { robot, mind: self.0.mind(robot, setup) })
    }
}

#[derive(Debug)]
struct Mind {
    robot: RobotId,
    mind: Box<dyn AgentMission>,
}

impl RouteCost for Mind {
    fn seconds(&self, after: &[TaskId], task: TaskId) -> Option<f64> {
        self.mind.seconds(after, task)
    }
}

impl AgentMission for Mind {
    fn perceive(&mut self, moment: &Moment<'_>, heard: &[Arc<Broadcast>], perception: &mut Perception) {
        let breaks = breaks("mind") && self.robot == RobotId(0);
        assert!(!breaks || moment.now < WHEN, "the controller fails on purpose");
        self.mind.perceive(moment, heard, perception);
    }

    fn choices(&self, moment: &Moment<'_>, applicable: &[bool], choices: &mut Vec<Choice>) {
        self.mind.choices(moment, applicable, choices);
    }

    fn act(&mut self, moment: &Moment<'_>, active: Option<BehaviorId>, action: &mut StepOutput) {
        self.mind.act(moment, active, action);
        if breaks("nan") && moment.now >= WHEN {
            action.actuation.speed_m_s = f32::NAN;
        }
    }

    fn lore(&self, lore: &mut Lore) {
        self.mind.lore(lore);
    }

    fn position(&self) -> Option<Vec2> {
        self.mind.position()
    }

    fn is_laden(&self) -> bool {
        self.mind.is_laden()
    }

    fn checkpoint(&self) -> Box<dyn AgentMission> {
        Box::new(Self { robot: self.robot, mind: self.mind.checkpoint() })
    }
}
