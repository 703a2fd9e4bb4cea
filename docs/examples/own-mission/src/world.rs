//! What of visit happens in the world: a place within reach can be touched, once.

use alliance_proto::fault::Fault;
use alliance_proto::ids::RobotId;
use alliance_proto::tick::Outcome;
use alliance_proto::time::SimTime;
use alliance_proto::view::{Mark, MarkOutline, MarkRole, View};
use glam::Vec2;
use serde::{Deserialize, Serialize};
use world_server::mission::{Happened, MissionWorld, TeamFigures, Typed, TypedMission, Validity, Value};
use world_server::world::{ChangeError, Floor};

use crate::data::{self, TOUCH, VisitSection, WITHIN_M};

pub const VISIT: MissionWorld = MissionWorld {
    data: data::VISIT,
    start_area: |scenario| [Vec2::ZERO, Vec2::new(1.0, scenario.room.height_m)],
    new: |setup, floor| {
        let section = VisitSection::of(&setup.scenario).clone();
        let visited = vec![false; section.places.len()];
        Box::new(Typed(Visit { section, visited, visits: vec![0; floor.robot_count()] }))
    },
};

/// What it is at the start never changes; the state is which places have been visited.
#[derive(Clone, Serialize)]
struct Visit {
    #[serde(skip)]
    section: VisitSection,
    visited: Vec<bool>,
    #[serde(skip)]
    visits: Vec<u32>,
}

/// What a robot feels. By default, nothing: its sensor is dead.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub enum Felt {
    #[default]
    Nothing,
    /// No place that is left to be touched is within reach.
    Floor,
    Place(u16),
}

/// What a robot does beside driving: it touches a place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Touch(pub u16);

impl Visit {
    fn at(&self, place: usize) -> Vec2 {
        let place = &self.section.places[place];
        Vec2::new(place.x_m, place.y_m)
    }

    fn left_within_reach(&self, robot: RobotId, floor: &Floor) -> Option<usize> {
        let position = floor.pose(robot).position;
        let is_near = |place: usize| position.distance(self.at(place)) <= self.section.reach_m;
        (0..self.visited.len()).find(|&place| !self.visited[place] && is_near(place))
    }

    fn count(&self) -> u64 {
        self.visited.iter().filter(|visited| **visited).count() as u64
    }
}

impl TypedMission for Visit {
    type Sensed = Felt;
    type Deed = Touch;

    fn act(&mut self, robot: RobotId, Touch(place): Touch, floor: &mut Floor, happened: &mut Happened) {
        if self.left_within_reach(robot, floor) == Some(usize::from(place)) {
            let place = usize::from(place);
            self.visited[place] = true;
            self.visits[robot.index()] += 1;
            happened.tell("visited", Some(robot)).subject = self.section.places[place].name.clone();
            // Whoever is near it feels something else from now on.
            floor.changed_near(self.at(place), self.section.reach_m);
        }
    }

    fn sense(&self, robot: RobotId, floor: &Floor) -> (Felt, Validity) {
        let place = self.left_within_reach(robot, floor);
        (place.map_or(Felt::Floor, |place| Felt::Place(place as u16)), Validity::UntilChange)
    }

    fn change(&mut self, fault: &Fault, floor: &mut Floor) -> Option<Result<String, ChangeError>> {
        let Fault::Mission(fault) = fault else { return None };
        if fault.name != TOUCH {
            return None;
        }
        // Checked when it was ordered: only what has a default may be left out.
        let number = |key| fault.get(key).unwrap_or(WITHIN_M) as f32;
        let (at, within_m) = (Vec2::new(number("x_m"), number("y_m")), number("within_m"));
        let is_near = |place: &usize| at.distance(self.at(*place)) <= within_m;
        let near: Vec<usize> = (0..self.visited.len()).filter(is_near).collect();
        for &place in &near {
            self.visited[place] = true;
            floor.changed_near(self.at(place), self.section.reach_m);
        }
        Some(Ok(format!("{} places", near.len())))
    }

    fn end(&self, _: SimTime) -> Option<Outcome> {
        self.visited.iter().all(|visited| *visited).then_some(Outcome::Complete)
    }

    fn row(&self, row: &mut Vec<Value>) {
        row.extend([self.count(), self.visited.len() as u64 - self.count()].map(Value::from));
    }

    fn figures(&self, figures: &mut TeamFigures) {
        figures.mission.add("visited", self.count());
        for (figures, visits) in figures.robots.iter_mut().zip(&self.visits) {
            figures.add("visits", *visits);
        }
    }

    fn show(&self, _: &Floor, view: &mut View) {
        for (place, visited) in self.visited.iter().enumerate() {
            view.mark(Mark {
                id: format!("place-{place}"),
                outline: MarkOutline::Disc { center: self.at(place), radius_m: self.section.reach_m },
                role: MarkRole::Target,
                share: Some(f32::from(u8::from(*visited))),
                label: self.section.places[place].name.clone(),
            });
        }
    }
}
