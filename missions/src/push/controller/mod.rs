//! The controller of a robot in push. The robot drives behind an end of a bar, pushes it by a stroke, and stays
//! there.
//!
//! - `memory`: the robot's knowledge of its bars. `way`: the motion to its place and the push. `attempts`: bars that
//!   cannot be moved.
//!
//! A robot without a task stands still, and so holds the end at which it is.

mod attempts;
mod memory;
#[cfg(test)]
mod tests;
mod way;

use std::sync::Arc;

use glam::Vec2;
use proto::mission::{Payload, SharedKnowledge as AnyKnowledge};
use proto::readings::Pose;
use proto::team::{Broadcast, Bulletin, BulletinKind};
use robot_agent::allocator::OwnBehavior;
use robot_agent::mission::{ControllerInput, MissionController, Perception, StepOutput};
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{Room, Setup};

use super::bar::{self, BarEnd};
use super::bus::{BarReport, BarSeen, SensorReading, SharedKnowledge, Stroke};
use super::data::{PushSection, bar_and_end};
use attempts::Attempts;
use memory::{BarKnowledge, shared_knowledge};
use way::Approach;

/// The tolerance of a stroke's length, m. Without it rounding could prevent its completion.
const ENOUGH_M: f32 = 0.002;
/// The margin within the sensing range in which a bar is certainly seen, m.
const CERTAIN_M: f32 = 0.3;
/// The distance by which the known pose of a missing bar is moved forward, m.
const FARTHER_M: f32 = 0.5;

#[derive(Clone, Debug)]
pub struct Pusher {
    section: Arc<PushSection>,
    room: Room,
    push_m_s: f32,
    known: Vec<BarKnowledge>,
    attempts: Attempts,
    way: Approach,
    /// The task in progress, and the x of its end at the start of the push, m.
    at: Option<(TaskId, Option<f32>)>,
    /// The index of a bar with news for an immediate broadcast.
    news: Option<usize>,
    now: SimTime,
}

impl Pusher {
    pub fn new(robot: RobotId, setup: &Setup) -> Self {
        let scenario = &setup.scenario;
        let section = Arc::new(PushSection::of(scenario).clone());
        let behaviors = OwnBehavior::of_robot(robot, setup);
        let mut bars: Vec<usize> = behaviors
            .iter()
            .map(|behavior| bar_and_end(behavior.task).0)
            .collect();
        bars.sort_unstable();
        bars.dedup();
        let known = bars
            .iter()
            .map(|&bar| BarKnowledge::new(bar as u32, section.bars[bar].pose()));
        Self {
            room: scenario.room,
            push_m_s: scenario.body_of(&scenario.robots[robot.index()]).push_m_s,
            known: known.collect(),
            attempts: Attempts::new(bars.len(), SimTime(scenario.step_ms)),
            way: Approach::new(robot, setup),
            at: None,
            news: None,
            now: SimTime::ZERO,
            section,
        }
    }

    fn place_of(&self, bar: u32) -> Option<usize> {
        self.known
            .binary_search_by_key(&bar, |known| known.report.bar)
            .ok()
    }

    fn of_task(&self, task: TaskId) -> Option<(usize, BarEnd)> {
        let (bar, end) = bar_and_end(task);
        Some((self.place_of(bar as u32)?, end))
    }

    fn end_x(&self, place: usize, end: BarEnd) -> f32 {
        bar::end(&self.known[place].report.pose, end, self.section.length_m).x
    }

    /// Returns whether the content of a message is possible. A message may contain anything.
    fn is_possible(&self, report: &BarReport) -> bool {
        let Pose {
            position,
            heading_rad,
        } = report.pose;
        self.room.contains(position) && heading_rad.abs() <= std::f32::consts::FRAC_PI_2
    }

    fn receive(&mut self, mut message: BarReport) {
        let Some(place) = self
            .place_of(message.bar)
            .filter(|_| self.is_possible(&message))
        else {
            return;
        };
        // A time in the future is invalid.
        message.seen = message.seen.min(self.now);
        if let Some(last) = &mut message.last {
            last.at = last.at.min(self.now);
        }
        self.known[place].merge(&message, &self.section);
    }

    /// Records a reading of the nearest bar. Returns its index in memory, if it belongs to the robot's tasks.
    fn see(&mut self, seen: &BarSeen, pose: &Pose) -> Option<usize> {
        let place = self.place_of(seen.bar)?;
        let near_end = pose.position + Vec2::from_angle(pose.heading_rad).rotate(seen.near_end);
        let there = bar::with_end(near_end, seen.end, seen.lead_m, self.section.length_m);
        self.known[place].add_reading(there, self.now, &self.section);
        Some(place)
    }

    /// Moves the known pose of each bar that should be in sight and is not, so that the robot searches farther ahead.
    fn miss(&mut self, position: Vec2) {
        let section = Arc::clone(&self.section);
        for known in &mut self.known {
            let way_m = section
                .outline(&known.report.pose)
                .distance_to_point(position);
            if way_m >= section.sight_m - CERTAIN_M || known.has_arrived {
                continue;
            }
            let start = &section.bars[known.report.bar as usize];
            let mut pose = known.report.pose;
            pose.position.x += FARTHER_M;
            if pose.position.x > start.goal_x_m {
                pose.position.x = start.x_m;
            }
            known.set_pose(pose, &section);
        }
    }

    /// Detects a completed stroke, which is progress and news. The end has moved forward by a stroke, or leads by
    /// half of one. The bar then leans to both sides equally, without drift.
    fn note_stroke(&mut self, seen: Option<usize>, perception: &mut Perception) {
        let Some((task, Some(begun_m))) = self.at else {
            return;
        };
        let Some((place, end)) = self.of_task(task).filter(|(place, _)| Some(*place) == seen)
        else {
            return;
        };
        let (section, known) = (&self.section, &self.known[place]);
        let moved_m = self.end_x(place, end) - begun_m;
        let leads = known.lead_of(end) >= section.stroke_m / 2.0 - ENOUGH_M;
        if leads || moved_m >= section.stroke_m - ENOUGH_M || known.has_arrived {
            let stroke = Stroke { end, at: self.now };
            self.known[place].add_stroke(stroke);
            perception.progressed.push(task);
            self.news = Some(place);
            self.at = None;
        }
    }

    /// Returns whether a task needs work. A stroke in progress is completed, unless the bar cannot be moved.
    fn is_due(&self, task: TaskId, place: usize, end: BarEnd) -> bool {
        if self.attempts.leaves_out(place, &self.known, self.now) {
            return false;
        }
        let known = &self.known[place];
        match self.at {
            Some((at, Some(_))) if at == task => !known.has_arrived,
            _ => known.is_due(end, self.now, &self.section),
        }
    }

    fn stands_at(&self, task: TaskId) -> Option<Vec2> {
        let (place, end) = self.of_task(task)?;
        let pose = &self.known[place].report.pose;
        Some(self.way.place_in_room(pose, end, &self.section))
    }
}

impl MissionController for Pusher {
    fn perceive(
        &mut self,
        input: &ControllerInput<'_>,
        received: &[Arc<Broadcast>],
        perception: &mut Perception,
    ) {
        self.now = input.now;
        for broadcast in received {
            let shared: Option<SharedKnowledge> = broadcast.shared_knowledge();
            let reports = shared.into_iter().flatten().chain(broadcast.bulletin());
            reports.for_each(|report| self.receive(report));
        }
        let sensed = input.reading::<SensorReading>();
        let seen = match (&sensed.bar, &input.readings.pose) {
            (Some(Some(seen)), Some(pose)) => self.see(seen, pose),
            (Some(None), Some(pose)) => {
                self.miss(pose.position);
                None
            }
            _ => None,
        };
        self.note_stroke(seen, perception);
        let is_able = input.position().is_some() && sensed.bar.is_some();
        let applicable = input.behaviors.iter().map(|behavior| {
            let due = self.of_task(behavior.task);
            is_able && due.is_some_and(|(place, end)| self.is_due(behavior.task, place, end))
        });
        perception.applicable.extend(applicable);
    }

    /// Returns the time of the last stroke at the other end, which starts the round of this end.
    fn round(&self, input: &ControllerInput<'_>, task: TaskId) -> SimTime {
        let last = self.of_task(task).and_then(|(place, end)| {
            let last = self.known[place].report.last;
            last.filter(|last| last.end != end)
        });
        last.map_or(SimTime::ZERO, |last| last.at).min(input.now)
    }

    fn act(
        &mut self,
        input: &ControllerInput<'_>,
        active: Option<BehaviorId>,
        output: &mut StepOutput,
    ) {
        if let Some(place) = self.news.take() {
            let news = &self.known[place].report;
            output.bulletins.push(Bulletin {
                kind: BulletinKind::First,
                about: None,
                payload: Payload::new(news),
            });
        }
        let task = input.task_of(active);
        if self.at.map(|(at, _)| at) != task {
            self.at = task.map(|task| (task, None));
            self.way.end();
        }
        let Some((task, begun)) = self.at else {
            return;
        };
        let Some(((place, end), pose)) = self.of_task(task).zip(input.readings.pose) else {
            return;
        };
        let bar = self.known[place].report.pose;
        let (position, touch) = (pose.position, input.reading::<SensorReading>().touch);
        let way_m = self
            .way
            .place_in_room(&bar, end, &self.section)
            .distance(position);
        self.attempts
            .work(place, &self.known[place], way_m, input.now);
        output.actuation = if self
            .way
            .is_in_place(&bar, end, &self.section, position, touch)
        {
            if begun.is_none() {
                self.at = Some((task, Some(self.end_x(place, end))));
            }
            self.way.push(&pose)
        } else {
            let (section, now) = (&self.section, input.now);
            self.way.go(&bar, end, section, &pose, input.readings, now)
        };
    }

    fn shared_knowledge(&self, _: &ControllerInput<'_>, knowledge: &mut AnyKnowledge) {
        knowledge.set(&shared_knowledge(&self.known, self.now));
    }

    /// Returns the travel time in a straight line at top speed, and the time of a stroke.
    fn seconds(&self, from: Option<Vec2>, after: &[TaskId], task: TaskId) -> Option<f64> {
        let from = match after.last() {
            Some(last) => self.stands_at(*last)?,
            None => from?,
        };
        let stroke_s = f64::from(self.section.stroke_m / self.push_m_s);
        Some(self.way.seconds(from, self.stands_at(task)?) + stroke_s)
    }

    fn place(&self, _: Option<Vec2>, task: TaskId) -> Option<Vec2> {
        self.stands_at(task)
    }

    fn travel_s(&self, from: Option<Vec2>, task: TaskId) -> Option<f64> {
        Some(self.way.seconds(from?, self.stands_at(task)?))
    }
}
