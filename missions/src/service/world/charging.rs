//! Chargers: robots that stand within reach and do not work charge their batteries.

use glam::Vec2;
use scenario::ids::RobotId;
use serde::Serialize;
use world_server::mission::StepEvents;
use world_server::world::Floor;

use crate::service::data::Charger;

/// The share of the capacity below which a charger accepts a robot.
const ACCEPTED: f32 = 0.95;

/// A charger with the robots that it charges, in the order of their arrival.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Station {
    #[serde(skip)]
    charger: Charger,
    /// The energy below which the charger accepts a robot, J. A robot that rests beside it does not charge all the time.
    #[serde(skip)]
    accepts_below_j: f32,
    users: Vec<RobotId>,
}

impl Station {
    /// Creates a charger for batteries of this capacity, J.
    pub fn new(charger: &Charger, capacity_j: f32) -> Self {
        Self {
            charger: *charger,
            accepts_below_j: ACCEPTED * capacity_j,
            users: Vec::new(),
        }
    }

    pub fn place(&self) -> Vec2 {
        self.charger.place()
    }

    /// Charges the robots at the charger for one step. A robot keeps its slot until its battery is full or it leaves. Of
    /// the others the one with the least energy is next. `is_free` returns whether a robot does not work.
    pub fn charge(
        &mut self,
        number: usize,
        reach_m: f32,
        step_s: f64,
        floor: &mut Floor,
        is_free: impl Fn(RobotId) -> bool,
        happened: &mut StepEvents,
    ) {
        let place = self.place();
        let can_charge = |robot: RobotId, floor: &Floor| {
            let is_near = floor.pose(robot).position.distance(place) <= reach_m;
            floor.is_present(robot) && is_near && floor.speed_m_s(robot) == 0.0 && is_free(robot)
        };
        let mut event = |kind, robot| {
            happened.push_mission_event(kind, Some(robot)).subject = format!("c{number}");
        };
        self.users.retain(|robot| {
            let stays = can_charge(*robot, floor);
            if !stays {
                event("charged", *robot);
            }
            stays
        });
        let energy_j = |robot: &RobotId| floor.energy_j(*robot).unwrap_or_default();
        let robots = (0..floor.robot_count() as u16).map(RobotId);
        let waiting = robots.filter(|robot| {
            energy_j(robot) < self.accepts_below_j
                && !self.users.contains(robot)
                && can_charge(*robot, floor)
        });
        let mut waiting: Vec<RobotId> = waiting.collect();
        waiting.sort_by(|a, b| energy_j(a).total_cmp(&energy_j(b)));
        let free = (self.charger.slots as usize).saturating_sub(self.users.len());
        for robot in waiting.into_iter().take(free) {
            event("charging", robot);
            self.users.push(robot);
        }
        self.users.retain(|robot| {
            floor.charge(*robot, self.charger.rate_w * step_s);
            let is_full = floor.is_fully_charged(*robot);
            if is_full {
                event("charged", *robot);
            }
            !is_full
        });
    }
}
