//! The initial knowledge of robots.

use glam::Vec2;
use scenario::Setup;
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;

use crate::service::bus::PointFact;
use crate::service::data::{KnowledgeSource, ServiceSection, TaskGranularity};

#[derive(Debug)]
pub(super) struct Briefing {
    pub tasks: TaskGranularity,
    pub known: KnowledgeSource,
    pub reach_m: f32,
    pub sight_m: f32,
    pub step_s: f32,
    pub kinds: Vec<KindParameters>,
    /// The upper right corner of the room, m. The lower left is (0, 0).
    pub room: Vec2,
    most_points: usize,
}

#[derive(Debug)]
pub(super) struct KindParameters {
    pub name: String,
    pub kept: bool,
    pub period: Option<SimTime>,
}

impl Briefing {
    pub fn from_setup(setup: &Setup) -> Self {
        let scenario = &setup.scenario;
        let section = ServiceSection::of(scenario);
        let kinds = section.kinds.iter().map(|kind| KindParameters {
            name: kind.name.clone(),
            kept: kind.kept,
            period: kind.period_s.map(SimTime::from_secs_f64),
        });
        Self {
            tasks: section.tasks,
            known: section.known,
            reach_m: section.reach_m,
            sight_m: section.sight_m,
            step_s: scenario.step_ms as f32 / 1000.0,
            kinds: kinds.collect(),
            room: scenario.room.size(),
            most_points: section.max_points(),
        }
    }

    pub fn skills(&self, robot: RobotId, setup: &Setup) -> Vec<f32> {
        let robot = &setup.scenario.robots[robot.index()];
        let kinds = self.kinds.iter();
        kinds
            .map(|kind| robot.skill(&kind.name).unwrap_or(1.0) as f32)
            .collect()
    }

    /// Checks whether a received fact is plausible. A faulty teammate may send any values.
    pub fn is_plausible(&self, fact: &PointFact) -> bool {
        usize::from(fact.point) < self.most_points
            && usize::from(fact.kind) < self.kinds.len()
            && fact.at.is_finite()
            && (0.0..1e7).contains(&fact.left_s)
    }

    pub fn task(&self, fact: &PointFact) -> TaskId {
        match self.tasks {
            TaskGranularity::Points => TaskId(fact.point),
            TaskGranularity::Kinds => TaskId(fact.kind.into()),
        }
    }
}
