//! The knowledge of a robot about the points, from its own sensors and from messages.

use std::collections::{BTreeMap, BTreeSet};

use arrayvec::ArrayVec;
use glam::Vec2;
use robot_agent::body::FailedAttempts;
use scenario::ids::TaskId;
use scenario::time::SimTime;

use super::briefing::Briefing;
use super::place::Place;
use crate::service::bus::{MAX_SHARED, ObservedFact, PointFact, SharedKnowledge};
use crate::service::data::{KnowledgeSource, TaskGranularity};

/// The number of recently changed points in each heartbeat. A board, if any, announces the rest.
const MAX_RECENT: usize = 4;

/// A known point, with the time of the observation.
#[derive(Clone, Debug)]
pub(super) struct KnownPoint {
    pub fact: PointFact,
    sensed: SimTime,
    pub place: Place,
}

impl KnownPoint {
    fn observed(&self) -> ObservedFact {
        ObservedFact {
            fact: self.fact,
            sensed: self.sensed,
        }
    }
}

/// The known points. Facts may arrive late, repeatedly and in any order. The fact of the later round holds, then the
/// later observation. Kept work never increases within a round.
#[derive(Clone, Debug)]
pub(super) struct Memory {
    points: BTreeMap<u32, KnownPoint>,
    /// The most recently changed points, the newest last.
    news: ArrayVec<u32, MAX_RECENT>,
    /// The robot's tasks in ascending order, with the number of known open points that it can serve.
    open: Vec<(TaskId, u32)>,
    skills: Vec<f32>,
    /// The known open points that expire at a stated time.
    closing: BTreeSet<(SimTime, u32)>,
    /// The attempts of this robot that found no way to a point.
    pub failed: FailedAttempts<u32>,
    /// The points at which this robot has waited too long for others.
    pub waits: FailedAttempts<u32>,
}

pub(super) fn is_open(fact: &PointFact) -> bool {
    fact.left_s > 0.0
}

impl Memory {
    /// Creates an empty memory. `tasks` must be in ascending order.
    pub fn new(tasks: impl Iterator<Item = TaskId>, skills: Vec<f32>) -> Self {
        Self {
            points: BTreeMap::new(),
            news: ArrayVec::new(),
            open: tasks.map(|task| (task, 0)).collect(),
            skills,
            closing: BTreeSet::new(),
            failed: FailedAttempts::default(),
            waits: FailedAttempts::default(),
        }
    }

    /// Returns the skill for a point that the robot can serve alone. The pace of robots that work together is not known
    /// before, and counts as 1.
    pub fn skill(&self, briefing: &Briefing, fact: &PointFact) -> f32 {
        if briefing.has_slots(fact.point) {
            return 1.0;
        }
        self.skills[fact.kind as usize]
    }

    pub fn known(&self, point: u32) -> Option<&KnownPoint> {
        self.points.get(&point)
    }

    pub fn fact(&self, point: u32) -> Option<&PointFact> {
        Some(&self.known(point)?.fact)
    }

    pub fn facts_from(&self, point: u32) -> impl Iterator<Item = &PointFact> {
        self.points.range(point..).map(|(_, known)| &known.fact)
    }

    /// Returns for each own task, in order, whether it has a point that the robot can serve and that is not suspended.
    pub fn applicable(&self, briefing: &Briefing, now: SimTime) -> impl Iterator<Item = bool> {
        self.open.iter().map(move |(task, open)| {
            let is_of_task = |point: &u32| match briefing.tasks {
                TaskGranularity::Points => *point == briefing.point(*task),
                TaskGranularity::Kinds => self.fact(*point).is_some_and(|fact| {
                    fact.kind == task.0 && is_open(fact) && self.skill(briefing, fact) > 0.0
                }),
            };
            *open as usize > self.failed.suspended(now).filter(is_of_task).count()
        })
    }

    /// Returns the own tasks for which [`Memory::applicable`] returns `true`.
    pub fn applicable_tasks(
        &self,
        briefing: &Briefing,
        now: SimTime,
    ) -> impl Iterator<Item = TaskId> {
        let tasks = self.open.iter().map(|(task, _)| *task);
        let tasks = tasks.zip(self.applicable(briefing, now));
        tasks.filter_map(|(task, is_applicable)| is_applicable.then_some(task))
    }

    pub fn merge(&mut self, briefing: &Briefing, mut new: ObservedFact) {
        let number = new.fact.point;
        let is_own = |task| self.open.binary_search_by_key(&task, |(task, _)| *task);
        let is_concerned = briefing
            .tasks_of(&new.fact)
            .any(|task| is_own(task).is_ok());
        if !is_concerned && briefing.known == KnowledgeSource::All {
            // With a board, the robots concerned receive the fact from the board.
            return;
        }
        let old = self.known(number).map(|known| (known.fact, known.sensed));
        if let Some((fact, sensed)) = old {
            let age = |round: u32, sensed: SimTime| (round, sensed);
            if age(new.fact.round, new.sensed) <= age(fact.round, sensed) {
                return;
            }
            let is_same_round = new.fact.round == fact.round;
            let is_kept = briefing.kinds[new.fact.kind as usize].kept;
            if is_same_round && is_kept && is_open(&fact) && is_open(&new.fact) {
                new.fact.left_s = new.fact.left_s.min(fact.left_s);
            }
        }
        if let (_, Some(closes)) = briefing.window(&new.fact)
            && is_open(&new.fact)
        {
            self.closing.insert((closes, number));
        }
        let known = self.points.entry(number).or_insert_with(|| KnownPoint {
            fact: new.fact,
            sensed: new.sensed,
            place: Place::new(new.fact.at),
        });
        if known.place.at != new.fact.at {
            known.place = Place::new(new.fact.at);
        }
        (known.fact, known.sensed) = (new.fact, new.sensed);
        let was_open = old.is_some_and(|(old, _)| is_open(&old));
        let is_open = is_open(&new.fact);
        if old.is_none_or(|(old, _)| old != new.fact) {
            self.mark_changed(number);
        }
        if was_open == is_open || self.skill(briefing, &new.fact) <= 0.0 {
            return;
        }
        for task in briefing.tasks_of(&new.fact) {
            let Ok(index) = self.open.binary_search_by_key(&task, |(task, _)| *task) else {
                continue;
            };
            let open = &mut self.open[index].1;
            *open = if is_open {
                *open + 1
            } else {
                open.saturating_sub(1)
            };
        }
    }

    /// Returns the next known point that has expired by `now`, and forgets its deadline.
    pub fn next_closed(&mut self, now: SimTime) -> Option<&PointFact> {
        let (closes, point) = *self.closing.first()?;
        if closes > now {
            return None;
        }
        self.closing.pop_first();
        self.fact(point)
    }

    pub fn work_left(&mut self, point: u32, left_s: f32) {
        if let Some(known) = self.points.get_mut(&point) {
            known.fact.left_s = known.fact.left_s.min(left_s);
        }
    }

    /// Marks a point as recently changed, for the next heartbeats.
    pub fn mark_changed(&mut self, point: u32) {
        if let Some(old) = self.news.iter().position(|news| *news == point) {
            self.news.remove(old);
        }
        if self.news.is_full() {
            self.news.remove(0);
        }
        self.news.push(point);
    }

    /// Returns the content of a heartbeat: recent changes and, without a board, a rotating part of the other points.
    pub fn shared_knowledge(&self, briefing: &Briefing, now: SimTime) -> SharedKnowledge {
        let news = self.news.iter().rev();
        let mut content: SharedKnowledge = news
            .filter_map(|point| self.points.get(point))
            .map(KnownPoint::observed)
            .collect();
        if briefing.known == KnowledgeSource::Sight && !self.points.is_empty() {
            let most = MAX_SHARED - MAX_RECENT;
            // The window advances by its own size each second.
            let from = (now.0 / 1000) as usize * most % self.points.len();
            let rest = self
                .points
                .values()
                .cycle()
                .skip(from)
                .take(most.min(self.points.len()));
            content.extend(rest.map(KnownPoint::observed));
        }
        content
    }

    /// Returns the open points of a kind that the robot can serve and that are not suspended.
    pub fn open_of_kind<'a>(
        &'a self,
        briefing: &'a Briefing,
        kind: usize,
        now: SimTime,
    ) -> impl Iterator<Item = &'a KnownPoint> {
        self.points.values().filter(move |KnownPoint { fact, .. }| {
            fact.kind as usize == kind
                && is_open(fact)
                && self.skill(briefing, fact) > 0.0
                && !self.failed.is_suspended(fact.point, now)
        })
    }

    /// Returns the nearest of the points of [`Memory::open_of_kind`].
    pub fn nearest<'a>(
        &'a self,
        briefing: &'a Briefing,
        kind: usize,
        to: Vec2,
        now: SimTime,
    ) -> Option<&'a KnownPoint> {
        self.open_of_kind(briefing, kind, now).min_by(|a, b| {
            let distance = |known: &KnownPoint| known.fact.at.distance_squared(to);
            distance(a).total_cmp(&distance(b))
        })
    }
}
