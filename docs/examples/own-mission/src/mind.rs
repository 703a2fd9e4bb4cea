//! What a robot of visit knows and does: it drives to the place of its task and touches it; heartbeats say what has been visited.

use std::sync::Arc;

use alliance_proto::ids::{BehaviorId, RobotId, TaskId};
use alliance_proto::scenario::Setup;
use glam::Vec2;
use robot_agent::body::{Chassis, Goal, Navigator, Surroundings};
use robot_agent::mission::{
    Action, AgentMission, Heard, MissionMind, Perception, SharedMission, Typed, TypedMind, TypedMoment,
};

use crate::data::{self, VisitSection};
use crate::world::{Felt, Touch};

pub const VISIT: MissionMind = MissionMind {
    data: data::VISIT,
    shared: |_| Arc::new(Team),
};

#[derive(Debug)]
struct Team;

impl SharedMission for Team {
    fn mind(&self, robot: RobotId, setup: &Setup) -> Box<dyn AgentMission> {
        let own = &setup.scenario.robots[robot.index()];
        let VisitSection { places, reach_m } = VisitSection::of(&setup.scenario);
        let visitor = Visitor {
            places: places.iter().map(|place| Vec2::new(place.x_m, place.y_m)).collect(),
            reach_m: *reach_m,
            chassis: Chassis::of(&setup.scenario, own),
            visited: Vec::new(),
            position: None,
            progressed: None,
            navigator: Navigator::default(),
        };
        Box::new(Typed::new(visitor, robot, setup))
    }
}

#[derive(Clone, Debug)]
struct Visitor {
    /// By task.
    places: Vec<Vec2>,
    reach_m: f32,
    chassis: Chassis,
    /// As far as it knows, in ascending order.
    visited: Vec<u16>,
    position: Option<Vec2>,
    /// What it has touched in the step before.
    progressed: Option<TaskId>,
    navigator: Navigator,
}

impl Visitor {
    fn learn(&mut self, place: u16) {
        if let Err(index) = self.visited.binary_search(&place) {
            self.visited.insert(index, place);
        }
    }
}

impl TypedMind for Visitor {
    type Sensed = Felt;
    type Deed = Touch;
    type Lore = Vec<u16>;
    type Bulletin = ();

    fn perceive(
        &mut self,
        moment: &TypedMoment<'_, Self>,
        heard: &[Heard<'_, Self>],
        perception: &mut Perception,
    ) {
        self.position = moment.readings.pose.map(|pose| pose.position);
        for place in heard.iter().flat_map(|heard| heard.lore.iter().flatten()) {
            if usize::from(*place) < self.places.len() {
                self.learn(*place);
            }
        }
        // Where nothing is left to be touched, somebody has been.
        if let (Some(position), Felt::Floor) = (self.position, moment.sensed) {
            for place in 0..self.places.len() {
                if position.distance(self.places[place]) < 0.9 * self.reach_m {
                    self.learn(place as u16);
                }
            }
        }
        perception.progressed.extend(self.progressed.take());
        let is_left = |task: TaskId| !self.visited.contains(&task.0);
        perception.applicable.extend(moment.own.iter().map(|own| is_left(own.task)));
    }

    fn act(
        &mut self,
        moment: &TypedMoment<'_, Self>,
        active: Option<BehaviorId>,
        action: &mut Action,
    ) -> Option<Touch> {
        let task = moment.task_of(active)?;
        if matches!(moment.sensed, Felt::Place(place) if *place == task.0) {
            self.learn(task.0);
            self.progressed = Some(task);
            return Some(Touch(task.0));
        }
        let around = Surroundings::of(moment.readings)?;
        let goal = Goal::Place { at: self.places[task.index()], within: 0.8 * self.reach_m };
        let drive = self.navigator.drive(&self.chassis, goal, &around, [], moment.now);
        action.actuation = drive.actuation;
        None
    }

    fn lore(&self) -> Vec<u16> {
        self.visited.clone()
    }

    fn position(&self) -> Option<Vec2> {
        self.position
    }

    fn seconds(&self, after: &[TaskId], task: TaskId) -> Option<f64> {
        let from = after.last().map(|last| self.places[last.index()]).or(self.position)?;
        Some(f64::from(from.distance(self.places[task.index()]) / self.chassis.speed_m_s))
    }
}
