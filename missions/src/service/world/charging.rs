//! Chargers: robots that stand within reach and do not work charge their batteries.

use std::sync::Arc;

use scenario::Scenario;
use scenario::ids::RobotId;
use serde::Serialize;
use world_server::mission::StepEvents;
use world_server::world::{Floor, Grid};

use crate::service::data::{Charger, ServiceSection};

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

    /// Charges the robots at the charger for one step: those of `resting`, in the order of their ranks. A robot keeps its
    /// slot until its battery is full or it leaves. Of the others the one with the least energy is next.
    fn charge(
        &mut self,
        number: usize,
        resting: &[(usize, RobotId)],
        step_s: f64,
        floor: &mut Floor,
        happened: &mut StepEvents,
    ) {
        let mut event = |kind, robot| {
            happened.push_mission_event(kind, Some(robot)).subject = format!("c{number}");
        };
        let resting = resting.iter().map(|(_, robot)| *robot);
        self.users.retain(|user| {
            let stays = resting.clone().any(|robot| robot == *user);
            if !stays {
                event("charged", *user);
            }
            stays
        });
        let energy_j = |robot: &RobotId| floor.energy_j(*robot).unwrap_or_default();
        let waiting = resting
            .filter(|robot| energy_j(robot) < self.accepts_below_j && !self.users.contains(robot));
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

/// The chargers of a run, by number.
#[derive(Clone, Debug, Serialize)]
#[serde(transparent)]
pub(super) struct Stations {
    stations: Vec<Station>,
    #[serde(skip)]
    places: Arc<Grid>,
    /// The distance from a charger within which robots charge, m.
    #[serde(skip)]
    reach_m: f32,
}

impl Stations {
    pub fn new(scenario: &Scenario) -> Self {
        let section = ServiceSection::of(scenario);
        let energy = scenario.energy.as_ref();
        let capacity_j = energy.map_or(0.0, |energy| energy.capacity_j);
        let chargers = &section.chargers;
        let mut places = Grid::new(&scenario.room, section.reach_m, chargers.len());
        for (number, charger) in chargers.iter().enumerate() {
            places.insert(number, charger.place());
        }
        let stations = chargers
            .iter()
            .map(|charger| Station::new(charger, capacity_j));
        Self {
            stations: stations.collect(),
            places: Arc::new(places),
            reach_m: section.reach_m,
        }
    }

    pub fn is_empty(&self) -> bool {
        self.stations.is_empty()
    }

    /// Charges the robots at the chargers for one step. `is_free` returns whether a robot does not work.
    pub fn charge(
        &mut self,
        step_s: f64,
        is_free: impl Fn(RobotId) -> bool,
        floor: &mut Floor,
        happened: &mut StepEvents,
    ) {
        if self.is_empty() {
            return;
        }
        let rests = |robot: RobotId, floor: &Floor| {
            floor.is_present(robot) && floor.speed_m_s(robot) == 0.0 && is_free(robot)
        };
        let robots = (0..floor.robot_count() as u32).map(RobotId);
        let resting = robots.filter(|robot| rests(*robot, floor));
        let at_chargers = resting.flat_map(|robot| {
            let (place, reach_m) = (floor.pose(robot).position, self.reach_m);
            let near = self.places.near(place, reach_m);
            let near = near.filter(move |(_, at)| place.distance(*at) <= reach_m);
            near.map(move |(charger, _)| (charger, robot))
        });
        let mut at_chargers: Vec<(usize, RobotId)> = at_chargers.collect();
        at_chargers.sort_unstable();
        let mut at_chargers = at_chargers.chunk_by(|a, b| a.0 == b.0).peekable();
        for (number, station) in self.stations.iter_mut().enumerate() {
            let here = at_chargers.next_if(|robots| robots[0].0 == number);
            if here.is_some() || !station.users.is_empty() {
                station.charge(number, here.unwrap_or_default(), step_s, floor, happened);
            }
        }
    }
}
