//! What a robot of push knows and does: it goes behind an end of a bar, pushes that by a stroke, and stays where it is.
//!
//! - `memory`: what it knows of its bars. `way`: how it gets to where it pushes.
//!
//! A robot without a task stands still, and so holds the end at which it is.

mod memory;
#[cfg(test)]
mod tests;
mod way;

use std::sync::Arc;

use alliance_proto::ids::{BehaviorId, RobotId, TaskId};
use alliance_proto::readings::Pose;
use alliance_proto::scenario::Setup;
use alliance_proto::team::BulletinKind;
use alliance_proto::time::SimTime;
use glam::Vec2;
use robot_agent::allocator::OwnBehavior;
use robot_agent::mission::{Action, Heard, Perception, TypedMind, TypedMoment, bulletin};

use super::bar::{self, End};
use super::bus::{BarSeen, Deed, Lore, Sensed, Stroke, Told};
use super::data::{PushSection, about};
use memory::{Known, lore};
use way::Way;

/// A stroke that is shorter by so much is done: rounding must not keep it from its end, m.
const ENOUGH_M: f32 = 0.002;
/// A bar that is nearer than the end of sight by so much is seen for certain, m.
const CERTAIN_M: f32 = 0.3;
/// A bar that is not where it is believed to be is looked for so much farther on, m.
const FARTHER_M: f32 = 0.5;

/// One robot's mind for push.
#[derive(Clone, Debug)]
pub struct Pusher {
    section: Arc<PushSection>,
    room: Vec2,
    push_m_s: f32,
    /// The bars of its tasks, by their numbers.
    known: Vec<Known>,
    way: Way,
    /// The task that it is at, and where the end was when it began to push, along x, m.
    at: Option<(TaskId, Option<f32>)>,
    /// A bar of which there is news to be told at once.
    news: Option<usize>,
    now: SimTime,
}

impl Pusher {
    /// The place in memory of a bar.
    fn place_of(&self, bar: u16) -> Option<usize> {
        self.known
            .binary_search_by_key(&bar, |known| known.told.bar)
            .ok()
    }

    /// The bar of a task of its own, as it knows it, and the end.
    fn of_task(&self, task: TaskId) -> Option<(usize, End)> {
        let (bar, end) = about(task);
        Some((self.place_of(bar as u16)?, end))
    }

    /// Where the end of a bar is along x, m.
    fn end_x(&self, place: usize, end: End) -> f32 {
        bar::end(&self.known[place].told.pose, end, self.section.length_m).x
    }

    /// Whether something that is told can be: anybody may say anything.
    fn is_possible(&self, told: &Told) -> bool {
        let Pose {
            position,
            heading_rad,
        } = told.pose;
        let is_in_room = position.cmpge(Vec2::ZERO).all() && position.cmple(self.room).all();
        is_in_room && heading_rad.abs() <= std::f32::consts::FRAC_PI_2
    }

    /// Somebody tells of a bar.
    fn hear(&mut self, mut told: Told) {
        let Some(place) = self.place_of(told.bar).filter(|_| self.is_possible(&told)) else {
            return;
        };
        // Nobody has seen anything in times to come.
        told.seen = told.seen.min(self.now);
        if let Some(last) = &mut told.last {
            last.at = last.at.min(self.now);
        }
        self.known[place].learn(&told, &self.section);
    }

    /// It sees the nearest bar. With that, which of its own it sees.
    fn see(&mut self, seen: &BarSeen, pose: &Pose) -> Option<usize> {
        let place = self.place_of(seen.bar)?;
        let ahead = Vec2::new(libm::cosf(pose.heading_rad), libm::sinf(pose.heading_rad));
        let near_end = pose.position + ahead.rotate(seen.near_end);
        let there = bar::with_end(near_end, seen.end, seen.lead_m, self.section.length_m);
        self.known[place].see(there, self.now, &self.section);
        Some(place)
    }

    /// A bar that is not where it would be seen is looked for farther on.
    fn miss(&mut self, position: Vec2) {
        let section = Arc::clone(&self.section);
        for known in &mut self.known {
            let way_m = section.outline(&known.told.pose).way_to_point(position);
            if way_m >= section.sight_m - CERTAIN_M || known.has_arrived {
                continue;
            }
            let start = &section.bars[usize::from(known.told.bar)];
            let mut pose = known.told.pose;
            pose.position.x += FARTHER_M;
            if pose.position.x > start.goal_x_m {
                pose.position.x = start.x_m;
            }
            known.put(pose, &section);
        }
    }

    /// Notes a stroke that is done, which is progress and news: the end has come forward by a stroke, or leads by half of one. So the bar
    /// leans to both sides alike, and does not drift.
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
            self.known[place].stroke(stroke);
            perception.progressed.push(task);
            self.news = Some(place);
            self.at = None;
        }
    }

    /// Whether there is something to do on a task: a stroke that it has begun it ends.
    fn is_due(&self, task: TaskId, place: usize, end: End) -> bool {
        let known = &self.known[place];
        match self.at {
            Some((at, Some(_))) if at == task => !known.has_arrived,
            _ => known.is_due(end, self.now, &self.section),
        }
    }

    /// Where it stands at the end of a task, m.
    fn stands_at(&self, task: TaskId) -> Option<Vec2> {
        let (place, end) = self.of_task(task)?;
        let pose = &self.known[place].told.pose;
        Some(self.way.place_in_room(pose, end, &self.section))
    }
}

impl TypedMind for Pusher {
    type Sensed = Sensed;
    type Deed = Deed;
    type Lore = Lore;
    type Bulletin = Told;

    fn new(robot: RobotId, setup: &Setup) -> Self {
        let scenario = &setup.scenario;
        let section = Arc::new(PushSection::of(scenario).clone());
        let own = OwnBehavior::all_of(robot, setup);
        let mut bars: Vec<usize> = own.iter().map(|own| about(own.task).0).collect();
        bars.sort_unstable();
        bars.dedup();
        let known = bars
            .iter()
            .map(|&bar| Known::new(bar as u16, section.bars[bar].pose()));
        Self {
            room: Vec2::new(scenario.room.width_m, scenario.room.height_m),
            push_m_s: scenario.body_of(&scenario.robots[robot.index()]).push_m_s,
            known: known.collect(),
            way: Way::new(robot, setup),
            at: None,
            news: None,
            now: SimTime::ZERO,
            section,
        }
    }

    fn perceive(
        &mut self,
        moment: &TypedMoment<'_, Self>,
        heard: &[Heard<'_, Self>],
        perception: &mut Perception,
    ) {
        self.now = moment.now;
        for heard in heard {
            let told = heard.lore.iter().flatten().chain(&heard.bulletin);
            told.for_each(|told| self.hear(*told));
        }
        let seen = match (&moment.sensed.bar, &moment.readings.pose) {
            (Some(Some(seen)), Some(pose)) => self.see(seen, pose),
            (Some(None), Some(pose)) => {
                self.miss(pose.position);
                None
            }
            _ => None,
        };
        self.note_stroke(seen, perception);
        let is_able = moment.position.is_some() && moment.sensed.bar.is_some();
        let applicable = moment.own.iter().map(|own| {
            let due = self.of_task(own.task);
            is_able && due.is_some_and(|(place, end)| self.is_due(own.task, place, end))
        });
        perception.applicable.extend(applicable);
    }

    /// An end is to be pushed again since the last stroke at the other one.
    fn round(&self, moment: &TypedMoment<'_, Self>, task: TaskId) -> SimTime {
        let last = self.of_task(task).and_then(|(place, end)| {
            let last = self.known[place].told.last;
            last.filter(|last| last.end != end)
        });
        last.map_or(SimTime::ZERO, |last| last.at).min(moment.now)
    }

    fn act(
        &mut self,
        moment: &TypedMoment<'_, Self>,
        active: Option<BehaviorId>,
        action: &mut Action,
    ) -> Option<Deed> {
        if let Some(place) = self.news.take() {
            let told = &self.known[place].told;
            action
                .bulletins
                .push(bulletin(BulletinKind::First, None, told));
        }
        let task = moment.task_of(active);
        if self.at.map(|(at, _)| at) != task {
            self.at = task.map(|task| (task, None));
            self.way.end();
        }
        let (task, begun) = self.at?;
        let ((place, end), pose) = self.of_task(task).zip(moment.readings.pose)?;
        let bar = self.known[place].told.pose;
        let (position, touch) = (pose.position, moment.sensed.touch);
        action.actuation = if self
            .way
            .is_in_place(&bar, end, &self.section, position, touch)
        {
            if begun.is_none() {
                self.at = Some((task, Some(self.end_x(place, end))));
            }
            self.way.push(&pose)
        } else {
            let (section, now) = (&self.section, moment.now);
            self.way.go(&bar, end, section, &pose, moment.readings, now)
        };
        None
    }

    fn lore(&self) -> Lore {
        lore(&self.known, self.now)
    }

    /// Straight to the place behind the end at top speed, and a stroke.
    fn seconds(&self, from: Option<Vec2>, after: &[TaskId], task: TaskId) -> Option<f64> {
        let from = match after.last() {
            Some(last) => self.stands_at(*last)?,
            None => from?,
        };
        let stroke_s = f64::from(self.section.stroke_m / self.push_m_s);
        Some(self.way.seconds(from, self.stands_at(task)?) + stroke_s)
    }
}
