//! Views for observers. They have no effect on the run.

use std::collections::{BTreeMap, VecDeque};

use glam::Vec2;
use prefetch::prefetch;
use proto::control::{AgentState, FaultStatus, Phase};
use proto::readings::Readings;
use proto::tick::Report;
use proto::view::{BehaviorView, Corner, MESSAGES_MAX, MessageView, RobotView, View};
use scenario::ids::{BehaviorId, Incarnation, RobotId};
use scenario::mission::FigureValue;
use scenario::time::SimTime;
use scenario::{Obstacle, Setup};

use super::Simulation;
use super::corners::CurveCorners;
use super::levels::levels;
use crate::barrier::Presence;
use crate::world::{Component, Shape};

/// The largest number of faults in a view. Faults in force come first.
const FAULTS_MAX: usize = 200;

/// The largest number of corners in a view, which has to fit into a message. The latest are kept.
const CORNERS_MAX: usize = 10_000;

/// The largest team whose views contain sensor readings. A view has to fit into a message.
pub const SENSING_TEAM_MAX: usize = 200;

/// The history that views need beyond the state of the run.
#[derive(Clone)]
pub(super) struct ViewHistory {
    /// The latest state change of each behavior set, by rank.
    since: Vec<BTreeMap<BehaviorId, SimTime>>,
    /// The start time of each robot's incarnation.
    began: Vec<SimTime>,
    /// The incarnation of the latest report, by rank. A new one starts with all sets hibernating.
    incarnations: Vec<Incarnation>,
    /// The messages since the last view; `None` before the first view.
    messages: Option<VecDeque<MessageView>>,
    left_out: u64,
    corners: Option<CurveCorners>,
}

impl ViewHistory {
    pub fn new(robots: usize) -> Self {
        Self {
            since: vec![BTreeMap::new(); robots],
            began: vec![SimTime::ZERO; robots],
            incarnations: vec![0; robots],
            messages: None,
            left_out: 0,
            corners: None,
        }
    }

    /// Requests the memory of the lists that each tick reads, see [`prefetch`](mod@prefetch).
    pub fn prefetch(&self) {
        prefetch(&*self.incarnations);
    }

    pub fn remember(&mut self, now: SimTime, report: &Report, setup: &Setup) {
        let rank = report.robot.index();
        if self.incarnations[rank] != report.incarnation {
            self.incarnations[rank] = report.incarnation;
            self.since[rank].clear();
            self.began[rank] = now;
        }
        for change in &report.changes {
            self.since[rank].insert(change.set, now);
        }
        if let Some(corners) = &mut self.corners {
            let (_, levels) = levels(report, setup, &setup.scenario.robots[rank]);
            corners.add_report(now, report, &levels);
        }
        let Some(messages) = &mut self.messages else {
            return;
        };
        for &reception in &report.receptions {
            if messages.len() == MESSAGES_MAX {
                messages.pop_front();
                self.left_out += 1;
            }
            messages.push_back(MessageView {
                receiver: report.robot,
                reception,
            });
        }
    }

    fn since(&self, robot: RobotId, set: BehaviorId) -> SimTime {
        let changed = self.since[robot.index()].get(&set).copied();
        changed.unwrap_or(self.began[robot.index()])
    }
}

impl Simulation {
    /// Returns a snapshot with the messages and curves since the previous view; the first view has none. The owner of the clock
    /// and the processes adds its own data.
    pub fn view(&mut self) -> View {
        let messages = self.take_messages();
        let mut corners = self.take_corners();
        let surplus = corners.len().saturating_sub(CORNERS_MAX);
        corners.drain(..surplus);
        View {
            messages,
            messages_left_out: std::mem::take(&mut self.memories.left_out),
            corners,
            ..self.view_without_history()
        }
    }

    /// Returns the messages since the previous call or view, at most the newest [`MESSAGES_MAX`]; the first call returns
    /// none.
    pub fn take_messages(&mut self) -> Vec<MessageView> {
        let messages = self.memories.messages.get_or_insert_default();
        messages.drain(..).collect()
    }

    /// Returns all corners of the curves since the previous call or view; the first call returns none.
    pub fn take_corners(&mut self) -> Vec<Corner> {
        let (team, step) = (self.messages.len(), self.setup.scenario.step_ms);
        let now = self.world.now();
        let corners = &mut self.memories.corners;
        let corners = corners.get_or_insert_with(|| CurveCorners::new(team, SimTime(step)));
        corners.take(now)
    }

    /// Returns a snapshot without messages and curves, which need no history then.
    #[must_use]
    pub fn view_without_history(&self) -> View {
        let robots = self
            .barrier
            .robots()
            .map(|robot| self.robot_view(robot))
            .collect();
        let mut view = View {
            tick: self.barrier.tick(),
            now: self.world.now(),
            obstacles: self.world.obstacles().iter().map(rectangle).collect(),
            mission: self
                .mission_row()
                .into_iter()
                .map(FigureValue::number)
                .collect(),
            robots,
            faults: self.visible_faults(),
            outcome: self.outcome,
            ..View::default()
        };
        self.world.mission().add_to_view(&self.world, &mut view);
        view
    }

    #[must_use]
    pub fn agent_state(&self, robot: RobotId) -> AgentState {
        match self.barrier.presence(robot) {
            _ if self.barrier.is_absent(robot) => AgentState::Absent,
            // A robot before its first incarnation has not died.
            Presence::Empty if !self.barrier.was_ever_invited(robot) => AgentState::Coming,
            Presence::Empty => AgentState::Dead,
            Presence::Invited | Presence::Entering { .. } => AgentState::Coming,
            Presence::Present => AgentState::Present,
            Presence::Silent => AgentState::Silent,
        }
    }

    fn robot_view(&self, robot: RobotId) -> RobotView {
        let state = self.agent_state(robot);
        let alive = self.barrier.incarnation(robot).is_some();
        let sensing = alive && self.messages.len() <= SENSING_TEAM_MAX;
        let report = self.answers.report(robot);
        let spec = &self.setup.scenario.robots[robot.index()];
        let (measure, sets) = levels(report, &self.setup, spec);
        // A robot before its first report has nothing to show.
        let reports = self.barrier.incarnation(robot) == Some(report.incarnation);
        let sets = sets.iter().filter(|_| alive && reports);
        RobotView {
            state,
            incarnation: self.barrier.incarnation(robot),
            pid: None,
            pose: self.world.pose(robot),
            speed_m_s: self.world.speed_m_s(robot),
            carrying: self.world.mission().load(robot),
            energy_j: self.world.energy_j(robot),
            readings: if sensing {
                self.messages[robot.index()].readings.clone()
            } else {
                Readings::default()
            },
            sensed: Vec::new(),
            active: self.active[robot.index()].filter(|_| alive),
            measure,
            sets: sets
                .map(|&motivation| BehaviorView {
                    motivation,
                    since: self.memories.since(robot, motivation.set),
                })
                .collect(),
        }
    }

    /// Returns the faults in force, then the armed faults, each in the order of arming.
    fn visible_faults(&self) -> Vec<FaultStatus> {
        let of = |phase| {
            self.schedule
                .statuses()
                .filter(move |fault| fault.phase == phase)
        };
        of(Phase::InForce)
            .chain(of(Phase::Armed))
            .take(FAULTS_MAX)
            .cloned()
            .collect()
    }
}

fn rectangle(component: &Component) -> Obstacle {
    let half = match component.shape {
        Shape::Rectangle { half_size_m } => half_size_m,
        Shape::Disc { radius_m } => Vec2::splat(radius_m),
    };
    let corner = component.pose.position - half;
    Obstacle {
        x_m: corner.x,
        y_m: corner.y,
        width_m: 2.0 * half.x,
        height_m: 2.0 * half.y,
        penetrability: component.penetrability.0,
    }
}
