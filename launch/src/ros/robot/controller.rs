//! The robot's side of a controller that is a node of ROS. It consists of two parts.
//!
//! A mission's controller marks the set that the node states as the only applicable one, and an allocator always selects
//! that set. Heartbeats and state changes then work as for all other robots.

use std::sync::Arc;

use proto::readings::Actuation;
use proto::team::Broadcast;
use proto::telemetry::{Note, NoteKind};
use robot_agent::allocator::{Allocator, Decision, Input, OwnBehavior, SelfState};
use robot_agent::mission::{ControllerInput, MissionController, Perception, StepOutput};
use scenario::Setup;
use scenario::ids::{BehaviorId, RobotId};

use super::node::RosNode;

/// The allocator that selects the set of the node.
#[derive(Clone, Debug)]
pub struct FollowingAllocator {
    behaviors: Vec<BehaviorId>,
}

impl Allocator for FollowingAllocator {
    type Config = Arc<RosNode>;

    fn new(me: &SelfState, _: &Arc<RosNode>) -> Self {
        let behaviors = me.behaviors.iter().map(|behavior| behavior.id);
        Self {
            behaviors: behaviors.collect(),
        }
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        let mut behaviors = self.behaviors.iter().zip(input.applicable);
        let doing = behaviors.find(|(_, is_applicable)| **is_applicable);
        decision.active = doing.map(|(behavior, _)| *behavior);
    }
}

/// The mission part. Its state is that of the step, because the node is another process.
#[derive(Clone, Debug)]
pub struct RosController {
    node: Arc<RosNode>,
    robot: RobotId,
    setup: Arc<Setup>,
    is_laden: bool,
    actuation: Actuation,
}

impl RosController {
    pub fn new(node: Arc<RosNode>, robot: RobotId, setup: &Setup) -> Self {
        Self {
            node,
            robot,
            setup: Arc::new(setup.clone()),
            is_laden: false,
            actuation: Actuation::default(),
        }
    }

    /// Returns the robot's set with this name.
    fn set(&self, name: &str) -> Option<OwnBehavior> {
        let mut own = OwnBehavior::of_robot(self.robot, &self.setup).into_iter();
        own.find(|own| self.setup.catalog.behavior_name(own.id) == name)
    }
}

impl MissionController for RosController {
    fn perceive(
        &mut self,
        input: &ControllerInput<'_>,
        received: &[Arc<Broadcast>],
        perception: &mut Perception,
    ) {
        self.is_laden = input.readings.mission.items().holding == Some(true);
        let command = self.node.exchange(input.now, input.readings, received);
        let activity = &command.activity;
        let catalog = &self.setup.catalog;
        self.actuation = Actuation {
            speed_m_s: command.motion.speed_m_s,
            turn_rad_s: command.motion.turn_rad_s,
            action: activity
                .action
                .for_mission(catalog.mission.name(), input.readings),
        };
        let doing = activity.doing.as_deref().and_then(|name| self.set(name));
        let current = doing.as_ref().map(|set| set.id);
        let is_current = |behavior: &OwnBehavior| current == Some(behavior.id);
        perception
            .applicable
            .extend(input.behaviors.iter().map(is_current));
        if let Some(set) = doing.filter(|_| activity.progress) {
            perception.progressed.push(set.task);
            perception.notes.push(Note {
                kind: NoteKind::Progress,
                detail: catalog.task_name(set.task).to_owned(),
            });
        }
    }

    fn act(&mut self, _: &ControllerInput<'_>, _: Option<BehaviorId>, output: &mut StepOutput) {
        output.actuation = self.actuation;
    }

    fn is_laden(&self) -> bool {
        self.is_laden
    }
}
