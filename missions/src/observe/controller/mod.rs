//! The controller of a robot in observe: it follows near targets, or searches for some.
//!
//! - `memory`: targets and teammates in memory. `forces`: attraction and repulsion. `walk`: motion.

mod forces;
mod memory;
#[cfg(test)]
mod tests;
mod walk;

use std::sync::Arc;

use glam::Vec2;
use prefetch::{Layer, prefetch};
use proto::mission::{Action, SharedKnowledge};
use proto::team::{Broadcast, BroadcastContent};
use robot_agent::mission::{ControllerInput, MissionController, Perception, StepOutput};
use scenario::Setup;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;

use super::bus::{MAX_SENSED_TARGETS, ObserveAction, SensorReading, SharedSightings, Sighting};
use super::data::{ObserveSection, Policy, TaskKind};
use crate::geometry::is_possible_place;
use memory::{Memory, Ranges};
use walk::Walk;

#[derive(Clone, Debug)]
pub struct Observer {
    section: ObserveSection,
    memory: Memory,
    walk: Walk,
}

impl Observer {
    pub fn new(robot: RobotId, setup: &Setup) -> Self {
        Self {
            section: ObserveSection::from_scenario(&setup.scenario).clone(),
            memory: Memory::default(),
            walk: Walk::new(robot, setup),
        }
    }

    /// Stores the sensed targets. Returns whether one is new.
    fn look(&mut self, sensed: &SensorReading, input: &ControllerInput<'_>) -> bool {
        self.memory.clear_in_sight();
        let (Some(targets), Some(pose)) = (&sensed.targets, input.readings.pose) else {
            return false;
        };
        let ahead = Vec2::from_angle(pose.heading_rad);
        let mut is_new = false;
        for seen in targets {
            let sighting = Sighting {
                target: seen.target,
                at: pose.position + ahead.rotate(seen.offset),
                when: input.now,
            };
            if self.is_possible(&sighting) {
                is_new |= self.memory.add_reading(sighting, self.section.fastest_m_s);
            }
        }
        is_new
    }

    fn receive(&mut self, received: &[Arc<Broadcast>], now: SimTime) {
        for broadcast in received {
            if let BroadcastContent::Heartbeat(heartbeat) = &broadcast.body
                && let Some(position) = heartbeat.position.filter(|at| is_possible_place(*at))
            {
                self.memory.add_teammate(broadcast.sender, position, now);
            }
            let shared: Option<SharedSightings> = broadcast.shared_knowledge();
            for sighting in shared.into_iter().flatten() {
                // A time in the future is invalid.
                let when = sighting.when.min(now);
                let sighting = Sighting { when, ..sighting };
                if self.is_possible(&sighting) {
                    self.memory.add_message(sighting, self.section.fastest_m_s);
                }
            }
        }
    }

    /// Returns whether such a target can exist. A message may contain anything.
    fn is_possible(&self, sighting: &Sighting) -> bool {
        sighting.target < self.section.n && is_possible_place(sighting.at)
    }

    /// Returns the distances within which memory is reliable.
    fn reach(&self, sensed: &SensorReading) -> Ranges {
        let sight_m = match &sensed.targets {
            None => -1.0,
            // Further targets may be out of the reading, at larger distances.
            Some(targets) if targets.len() == MAX_SENSED_TARGETS => {
                targets.last().map_or(0.0, |last| last.offset.length())
            }
            Some(_) => self.section.range_m,
        };
        Ranges {
            sight_m: sight_m.min(self.section.range_m),
            targets_m: self.section.predict_m,
            robots_m: self.section.robot_far_m,
        }
    }

    fn force(&self, position: Vec2, now: SimTime) -> Vec2 {
        let section = &self.section;
        let of_targets = self.memory.tracks().map(|track| {
            let is_less = section.policy == Policy::ACmommt && track.is_shared(now);
            let weight = if is_less { section.shared_weight } else { 1.0 };
            let offset = track.at(now) - position;
            weight
                * forces::along(offset, |distance_m| {
                    forces::target_force(section, distance_m)
                })
        });
        let of_robots = self.memory.teammates().map(|teammate| {
            forces::along(teammate - position, |distance_m| {
                forces::robot_force(section, distance_m)
            })
        });
        of_targets.sum::<Vec2>() + of_robots.sum::<Vec2>()
    }
}

impl MissionController for Observer {
    fn perceive(
        &mut self,
        input: &ControllerInput<'_>,
        received: &[Arc<Broadcast>],
        perception: &mut Perception,
    ) {
        let duties = self.section.policy.duties();
        self.receive(received, input.now);
        let sensed = input.reading::<SensorReading>();
        if self.look(&sensed, input) {
            let observe = duties.iter().position(|duty| *duty == TaskKind::Observe);
            let task = observe.map(|index| TaskId(index as u32));
            perception.progressed.extend(task);
        }
        if let Some(position) = input.position() {
            let reach = self.reach(&sensed);
            self.memory.remove_stale(position, reach, input.now);
        }
        let is_near = self.memory.has_tracks();
        let can_go = input.position().is_some();
        let policy = self.section.policy;
        let applicable =
            input
                .behaviors
                .iter()
                .map(|behavior| match (policy, duties[behavior.task.index()]) {
                    (Policy::Fixed, _) => true,
                    (Policy::Random, _) => can_go,
                    (_, TaskKind::Observe) => can_go && is_near,
                    (_, TaskKind::Search) => can_go && !is_near,
                });
        perception.applicable.extend(applicable);
    }

    fn prefetch(&self, layer: Layer) {
        if layer == Layer::Elements {
            prefetch(&self.section);
        }
        self.memory.prefetch(layer);
    }

    fn act(
        &mut self,
        input: &ControllerInput<'_>,
        active: Option<BehaviorId>,
        output: &mut StepOutput,
    ) {
        let task = input.task_of(active);
        let duty = task.and_then(|task| self.section.policy.duties().get(task.index()));
        let (readings, now) = (input.readings, input.now);
        match (duty, input.position()) {
            (Some(TaskKind::Search), Some(_)) => output.actuation = self.walk.wander(readings, now),
            (Some(TaskKind::Observe), Some(position)) if self.section.policy != Policy::Fixed => {
                let force = self.force(position, now);
                output.actuation = self.walk.follow(force, readings, now);
            }
            _ => {}
        }
        if input.reading::<SensorReading>().targets.is_some() {
            output.actuation.action = Action::new(&ObserveAction);
        }
    }

    fn shared_knowledge(&self, _: &ControllerInput<'_>, knowledge: &mut SharedKnowledge) {
        // Memory may contain more targets than a heartbeat.
        let sightings = self.memory.in_sight().take(MAX_SENSED_TARGETS);
        knowledge.set(&sightings.collect::<SharedSightings>());
    }

    /// Returns 0, because no task requires travel first.
    fn seconds(&self, _: Option<Vec2>, _: &[TaskId], _: TaskId) -> Option<f64> {
        Some(0.0)
    }
}
