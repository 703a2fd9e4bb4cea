//! Estimates of what a unit of each behavior's work costs and is worth, from the robot's own knowledge. Costs assume
//! straight lines at top speed.

use crate::waste::data::WasteSection;
use crate::waste::data::{BehaviorKind, Spill};
use std::f32::consts::{PI, TAU};

use glam::Vec2;
use proto::readings::Readings;
use scenario::ids::TaskId;
use scenario::time::SimTime;
use scenario::{Robot, Setup};

use super::briefing::OwnBehavior;
use super::map::KnownPlaces;
use super::{WasteController, places};
use robot_agent::allocator::Choice;
use robot_agent::body::goal::length;

/// The assumed time of a search, with and without the side sensor, s. The size of the room is still unknown then.
const METHODICAL_S: f64 = 100.0;
const WANDER_S: f64 = 150.0;

/// Returns the reward of a unit of work. Finding the locations enables all other tasks, and a report is more urgent
/// than an item.
fn reward(kind: BehaviorKind) -> f64 {
    match kind {
        BehaviorKind::FindLocationsMethodical | BehaviorKind::FindLocationsWander => 3.0,
        BehaviorKind::MoveSpill(_) => 1.0,
        BehaviorKind::ReportProgress => 2.0,
    }
}

impl WasteController {
    /// Writes a choice per own behavior. `applicable` comes from the perception of this step.
    pub(super) fn write_choices(
        &self,
        now: SimTime,
        readings: &Readings,
        applicable: &[bool],
        choices: &mut Vec<Choice>,
    ) {
        let places = places(&self.briefing, &self.memory, &self.realms);
        let position = readings.pose.map(|pose| pose.position);
        for (behavior, &applicable) in self.briefing.own_behaviors.iter().zip(applicable) {
            let spec = &self.briefing.catalog.tasks[behavior.task.index()];
            let is_laden = self.holding && self.load_of == Some(behavior.id);
            choices.push(Choice {
                behavior: behavior.id,
                task: behavior.task,
                round: self.round(behavior, now),
                applicable,
                cost_s: self.cost_s(behavior, position, is_laden, places.as_ref()),
                opens_in_s: 0.0,
                reward: reward(behavior.kind),
                priority: spec.priority,
                max_robots: spec.max_robots as usize,
            });
        }
    }

    /// Returns the time since which the task is due again, as far as the robot knows.
    fn round(&self, behavior: &OwnBehavior, now: SimTime) -> SimTime {
        let known = self.memory.knowledge();
        let round = match behavior.kind {
            BehaviorKind::FindLocationsMethodical | BehaviorKind::FindLocationsWander => known
                .withdrawn
                .iter()
                .map(|withdrawal| withdrawal.seen)
                .max(),
            BehaviorKind::MoveSpill(_) => None,
            BehaviorKind::ReportProgress => known.last_report.map(|report| report.seen),
        };
        round.unwrap_or(SimTime::ZERO).min(now)
    }

    fn cost_s(
        &self,
        behavior: &OwnBehavior,
        position: Option<Vec2>,
        is_laden: bool,
        places: Option<&KnownPlaces<'_>>,
    ) -> Option<f64> {
        match behavior.kind {
            BehaviorKind::FindLocationsMethodical => Some(METHODICAL_S),
            BehaviorKind::FindLocationsWander => Some(WANDER_S),
            BehaviorKind::MoveSpill(spill) => {
                let (position, places) = (position?, places?);
                let (spill, deposit) = (places.spill(spill), places.deposit_of(spill));
                Some(if is_laden {
                    self.drive_s(length(position - deposit), PI)
                } else {
                    let way_m = length(position - spill) + length(spill - deposit);
                    self.drive_s(way_m, TAU)
                })
            }
            BehaviorKind::ReportProgress => {
                let site = center(places?.site());
                Some(self.drive_s(length(position? - site), PI))
            }
        }
    }

    /// Returns the place of the next unit of a task: the spill, the deposit for a robot with a load, or the report site.
    pub(super) fn place_of(&self, task: TaskId) -> Option<Vec2> {
        let mut behaviors = self.briefing.own_behaviors.iter();
        let behavior = behaviors.find(|behavior| behavior.task == task)?;
        let places = places(&self.briefing, &self.memory, &self.realms)?;
        match behavior.kind {
            BehaviorKind::FindLocationsMethodical | BehaviorKind::FindLocationsWander => None,
            BehaviorKind::MoveSpill(spill) => {
                let is_laden = self.holding && self.load_of == Some(behavior.id);
                Some(if is_laden {
                    places.deposit_of(spill)
                } else {
                    places.spill(spill)
                })
            }
            BehaviorKind::ReportProgress => Some(center(places.site())),
        }
    }

    /// Estimates the way to a place in a straight line, with half a turn, s.
    pub(super) fn travel_time_s(&self, from: Vec2, to: Vec2) -> f64 {
        self.drive_s(length(from - to), PI)
    }

    fn drive_s(&self, way_m: f32, turn_rad: f32) -> f64 {
        let chassis = &self.briefing.chassis;
        f64::from(way_m / chassis.speed_m_s + turn_rad / chassis.turn_rad_s)
    }

    /// Returns the place of a robot after a unit of the task.
    fn after(&self, task: TaskId, places: &KnownPlaces<'_>) -> Option<Vec2> {
        let mut behaviors = self.briefing.own_behaviors.iter();
        match behaviors.find(|behavior| behavior.task == task)?.kind {
            BehaviorKind::MoveSpill(spill) => Some(places.deposit_of(spill)),
            BehaviorKind::ReportProgress => Some(center(places.site())),
            BehaviorKind::FindLocationsMethodical | BehaviorKind::FindLocationsWander => None,
        }
    }

    /// Returns the cost of a unit of `task` after one unit of each task of `after`, s.
    pub(super) fn cost_after(&self, after: &[TaskId], task: TaskId) -> Option<f64> {
        let mut behaviors = self.briefing.own_behaviors.iter();
        let behavior = behaviors.find(|behavior| behavior.task == task)?;
        let places = places(&self.briefing, &self.memory, &self.realms);
        let last = after.last().zip(places.as_ref());
        let from = last.and_then(|(&last, places)| self.after(last, places));
        let is_laden = after.is_empty() && self.holding && self.load_of == Some(behavior.id);
        self.cost_s(behavior, from.or(self.position), is_laden, places.as_ref())
    }
}

fn center((min, max): (Vec2, Vec2)) -> Vec2 {
    (min + max) / 2.0
}

/// Returns the cost of a unit of each task before the start, ms, for allocators that assign beforehand. A row per
/// robot, a column per task. `None` if the robot has no behavior for the task.
pub fn planned_cost_ms(setup: &Setup) -> Vec<Vec<Option<i64>>> {
    let (scenario, catalog) = (&setup.scenario, &setup.catalog);
    let waste = WasteSection::of(scenario);
    let room = scenario.room;
    let site = Vec2::new(
        room.x_m + waste.report_site.width_m.min(room.width_m) / 2.0,
        room.middle().y,
    );
    let deposits: Vec<Vec2> = waste
        .deposits()
        .map(|spot| spot.in_room(&scenario.room))
        .collect();
    let spills: Vec<Vec2> = waste
        .spills
        .iter()
        .map(|spill: &Spill| spill.spot().in_room(&scenario.room))
        .collect();
    let cost_s = |robot: &Robot, kind: BehaviorKind| {
        let start = robot.start.map_or(site, |start| start.position());
        let body = scenario.body_of(robot);
        let drive_s = |way_m: f32, turn_rad: f32| {
            let turn_rad_s = body.turn_deg_s.to_radians();
            f64::from(way_m / body.speed_m_s + turn_rad / turn_rad_s)
        };
        match kind {
            BehaviorKind::FindLocationsMethodical => METHODICAL_S,
            BehaviorKind::FindLocationsWander => WANDER_S,
            BehaviorKind::MoveSpill(spill) => {
                let spill = spills[spill as usize];
                let ways = deposits.iter().map(|deposit| length(spill - *deposit));
                drive_s(
                    length(start - spill) + ways.fold(f32::INFINITY, f32::min),
                    TAU,
                )
            }
            BehaviorKind::ReportProgress => drive_s(length(start - site), PI),
        }
    };
    let row = |robot: &Robot| {
        let mut row = vec![None; catalog.tasks.len()];
        for id in catalog.behaviors_of(robot) {
            let spec = &catalog.sets[id.index()];
            let cost_ms = (1000.0 * cost_s(robot, BehaviorKind::from_spec(spec))) as i64;
            let cell: &mut Option<i64> = &mut row[spec.task.index()];
            *cell = Some(cell.map_or(cost_ms, |other| other.min(cost_ms)));
        }
        row
    };
    scenario.robots.iter().map(row).collect()
}
