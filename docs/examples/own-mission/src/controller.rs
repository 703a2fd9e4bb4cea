//! The controller of the visit mission.
//!
//! A robot drives to the place of its task and touches it. Its heartbeats contain the visited places.

use std::collections::BTreeSet;

use robot_agent::mission::prelude::*;

use crate::data::VisitSection;
use crate::world::{Touch, TouchReading};

#[derive(Clone, Debug)]
pub struct Visitor {
    section: VisitSection,
    driver: Driver,
    /// The places that this robot has touched, found without a target or received as visited.
    visited: BTreeSet<usize>,
    /// The task whose place the robot touched in the previous step.
    progressed: Option<TaskId>,
}

impl Visitor {
    pub fn new(robot: RobotId, setup: &Setup) -> Self {
        Self {
            section: setup.scenario.section::<VisitSection>().clone(),
            driver: Driver::new(robot, setup),
            visited: BTreeSet::new(),
            progressed: None,
        }
    }
}

impl MissionController for Visitor {
    fn perceive(
        &mut self,
        input: &ControllerInput,
        received: &[Arc<Broadcast>],
        perception: &mut Perception,
    ) {
        let places = || 0..self.section.places.len();
        let shared_places = received
            .iter()
            .filter_map(|broadcast| broadcast.shared_knowledge::<BTreeSet<usize>>());
        self.visited.extend(
            shared_places
                .flatten()
                .filter(|place| places().contains(place)),
        );
        // If the robot is at a place and senses no target, another robot has visited it.
        if let (Some(position), TouchReading::Floor) =
            (input.position(), &*input.reading::<TouchReading>())
        {
            let is_here = |&place: &usize| {
                position.distance(self.section.at(place)) < 0.9 * self.section.reach_m
            };
            self.visited.extend(places().filter(is_here));
        }
        perception.progressed.extend(self.progressed.take());
        let is_left = |task: TaskId| !self.visited.contains(&task.index());
        perception.applicable.extend(
            input
                .behaviors
                .iter()
                .map(|behavior| is_left(behavior.task)),
        );
    }

    fn act(
        &mut self,
        input: &ControllerInput,
        active: Option<BehaviorId>,
        output: &mut StepOutput,
    ) {
        let Some(task) = input.task_of(active) else {
            return;
        };
        if matches!(*input.reading::<TouchReading>(), TouchReading::Place(place) if place == task.index())
        {
            self.visited.insert(task.index());
            self.progressed = Some(task);
            output.actuation.action = Action::new(&Touch(task.index()));
            return;
        }
        let (at, within) = (self.section.at(task.index()), 0.8 * self.section.reach_m);
        output.actuation = self.driver.drive_to(at, within, input.readings, input.now);
    }

    fn shared_knowledge(&self, _: &ControllerInput, knowledge: &mut SharedKnowledge) {
        knowledge.set(&self.visited);
    }

    fn seconds(&self, from: Option<Vec2>, after: &[TaskId], task: TaskId) -> Option<f64> {
        let from = after
            .last()
            .map(|last| self.section.at(last.index()))
            .or(from)?;
        Some(self.driver.seconds(from, self.section.at(task.index())))
    }
}
