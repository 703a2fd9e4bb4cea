//! The initial knowledge of robots.

use std::sync::Arc;

use glam::Vec2;
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{Room, Setup};

use super::appointments::Appointments;
use super::place::Place;
use crate::geometry::is_possible_place;
use crate::service::bus::PointFact;
use crate::service::data::{
    Charger, CostMeasure, Destination, KnowledgeSource, Origin, Paths, ServiceSection, Slots,
    TaskGranularity, Terms, crew_reach_m, terms,
};

/// The share of the capacity at which a robot leaves a charger.
const CHARGED: f32 = 0.98;

#[derive(Debug)]
pub(super) struct Briefing {
    pub tasks: TaskGranularity,
    pub known: KnowledgeSource,
    pub reach_m: f32,
    /// The reach of a point at which several robots work together, m.
    crew_reach_m: f32,
    pub sight_m: f32,
    pub step_s: f32,
    pub kinds: Vec<KindParameters>,
    pub room: Room,
    pub step: SimTime,
    pub slots: Slots,
    /// The meetings of robots that have waited in vain.
    pub appointments: Appointments,
    pub chargers: Vec<Charger>,
    capacity_j: f32,
    /// The power of a robot at top speed, W.
    pub drive_w: f64,
    /// The energy at which a robot drives to a charger, and at which it goes back to work, J.
    pub energy_limits_j: [f32; 2],
    /// The longest time that a robot waits at a point for the robots of the other slots.
    pub coalition_wait: SimTime,
    /// The ways around obstacles, if costs are such ways.
    paths: Option<Paths>,
    /// The ways to the chargers, by number. Empty without paths.
    ways_to_chargers: Vec<Arc<Destination>>,
    /// The windows and values of the points at stated places, by number. Empty if no point states any.
    terms: Vec<Terms>,
    /// The priorities of the points at stated places, by number.
    priorities: Vec<i32>,
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
        let energy = scenario.energy.as_ref();
        let capacity_j = energy.map_or(0.0, |energy| energy.capacity_j);
        let kinds = section.kinds.iter().map(|kind| KindParameters {
            name: kind.name.clone(),
            kept: kind.kept,
            period: kind.period_s.map(SimTime::from_secs_f64),
        });
        let coalition_wait = SimTime::from_secs_f64(
            section
                .coalition_wait_s
                .unwrap_or(ServiceSection::COALITION_WAIT_S),
        );
        let slots = Slots::new(section);
        let paths = (section.costs == CostMeasure::Path)
            .then(|| Paths::new(scenario))
            .flatten();
        let ways_to_chargers = paths.iter().flat_map(|paths| {
            let chargers = section.chargers.iter();
            chargers.map(|charger| paths.to(charger.place()))
        });
        // A round has time for the way and for a wait.
        let round = coalition_wait + coalition_wait;
        Self {
            tasks: section.tasks,
            known: section.known,
            reach_m: section.reach_m,
            crew_reach_m: crew_reach_m(scenario),
            sight_m: section.sight_m,
            step_s: scenario.step_ms as f32 / 1000.0,
            kinds: kinds.collect(),
            room: scenario.room,
            step: SimTime(scenario.step_ms),
            appointments: Appointments::new(scenario, &slots, &setup.catalog, round),
            slots,
            chargers: section.chargers.clone(),
            capacity_j,
            drive_w: energy.map_or(0.0, |energy| f64::from(energy.idle_w + energy.drive_w)),
            energy_limits_j: [section.reserve.unwrap_or(0.2) as f32, CHARGED]
                .map(|share| share * capacity_j),
            ways_to_chargers: ways_to_chargers.collect(),
            paths,
            coalition_wait,
            priorities: (0..section.points.len())
                .map(|point| section.priority(point))
                .collect(),
            terms: terms(section),
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
    pub fn is_plausible(&self, fact: &PointFact, now: SimTime) -> bool {
        (fact.point as usize) < self.most_points
            && (fact.kind as usize) < self.kinds.len()
            && (is_possible_place(fact.at) || self.room.contains(fact.at))
            && (0.0..1e7).contains(&fact.left_s)
            && self.is_round_plausible(fact, now)
    }

    /// Checks whether the round of a point can have begun. A fact of a later round would replace all true ones.
    fn is_round_plausible(&self, fact: &PointFact, now: SimTime) -> bool {
        let terms = self.terms(fact.point);
        let period = if terms.deliver_to.is_some() {
            // A lost load begins a new round. No more than one can be lost in a step.
            Some(self.step)
        } else {
            self.kinds[fact.kind as usize].period
        };
        let arrives = period.map(|period| {
            let since = period.0.saturating_mul(fact.round.into());
            terms.arrives.0.saturating_add(since)
        });
        fact.round == 0 || arrives.is_some_and(|arrives| arrives <= now.0)
    }

    /// Returns whether any point states a window, a value or a priority.
    pub fn has_terms(&self) -> bool {
        !self.terms.is_empty()
    }

    /// Returns whether obstacles may be between a robot and a point.
    pub fn has_paths(&self) -> bool {
        self.paths.is_some()
    }

    /// Estimates the length of the way to a place, m: a straight line, or the shortest way around the obstacles. `None`
    /// if no way leads within reach of the place.
    pub fn way_m(&self, from: Vec2, to: Vec2) -> Option<f32> {
        match &self.paths {
            None => Some(from.distance(to)),
            Some(paths) => paths.length_m(from, &paths.to(to)),
        }
    }

    /// Estimates the length of the way to the place of a known point, m, like [`Briefing::way_m`].
    pub fn way_to_m(&self, from: Vec2, place: &Place) -> Option<f32> {
        match &self.paths {
            None => Some(from.distance(place.at)),
            Some(paths) => paths.length_m(from, place.ways(paths)),
        }
    }

    /// Estimates the length of the way to a charger, m, like [`Briefing::way_m`].
    pub fn way_to_charger_m(&self, from: Vec2, charger: usize) -> Option<f32> {
        match &self.paths {
            None => Some(from.distance(self.chargers[charger].place())),
            Some(paths) => paths.length_m(from, &self.ways_to_chargers[charger]),
        }
    }

    /// Returns a place from which robots drive.
    pub fn origin(&self, at: Vec2) -> Origin {
        let paths = self.paths.as_ref();
        paths.map_or_else(|| Origin::new(at), |paths| paths.origin(at))
    }

    /// Returns whether a way leads within reach of the place of a known point.
    pub fn has_way_to(&self, from: &Origin, place: &Place) -> bool {
        let paths = self.paths.as_ref();
        paths.is_none_or(|paths| paths.has_way(from, place.ways(paths)))
    }

    /// Estimates the length of the way from a known point to its delivery, m. `None` without a way.
    pub fn delivery_m(&self, from: &Place, to: Vec2) -> Option<f32> {
        from.delivery_m(|| self.way_m(from.at, to))
    }

    pub fn terms(&self, point: u32) -> &Terms {
        self.terms.get(point as usize).unwrap_or(&Terms::NONE)
    }

    /// Returns the time from which robots can work on a point, and the time at which it expires, if it is stated.
    pub fn window(&self, fact: &PointFact) -> (SimTime, Option<SimTime>) {
        self.terms(fact.point).window(fact.round)
    }

    pub fn priority(&self, point: u32) -> i32 {
        let priority = self.priorities.get(point as usize);
        priority.copied().unwrap_or_default()
    }

    /// Returns the point of a task, if each point is a task.
    pub fn point(&self, task: TaskId) -> u32 {
        self.slots.point(task)
    }

    /// Returns the time in which a charger fills an empty battery.
    pub fn full_charge(&self, charger: usize) -> SimTime {
        SimTime::from_secs_f64(f64::from(self.capacity_j) / self.chargers[charger].rate_w)
    }

    /// Returns the distance from a point within which robots work, m.
    pub fn reach_m_of(&self, point: u32) -> f32 {
        match self.slots.of_point(point).len() {
            0 | 1 => self.reach_m,
            _ => self.crew_reach_m,
        }
    }

    /// Returns whether robots must work together at a point.
    pub fn has_slots(&self, point: u32) -> bool {
        !self.slots.of_point(point).is_empty()
    }

    /// Returns the tasks of a point: one per slot, or one.
    pub fn tasks_of(&self, fact: &PointFact) -> impl Iterator<Item = TaskId> {
        let slots = self.slots.of_point(fact.point);
        let alone = slots.is_empty().then(|| self.task(fact));
        alone.into_iter().chain(slots.iter().map(|slot| slot.task))
    }

    pub fn task(&self, fact: &PointFact) -> TaskId {
        match self.tasks {
            TaskGranularity::Points => TaskId(fact.point),
            TaskGranularity::Kinds => TaskId(fact.kind),
        }
    }
}
