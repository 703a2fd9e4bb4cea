//! The world side of the visit mission: a place within reach can be touched once.

use serde::{Deserialize, Serialize};
use world_server::mission::prelude::*;

use crate::data::{VisitSection, WITHIN_M};

/// The state of the mission: the visited places. The section does not change during a run.
#[derive(Clone, Serialize)]
pub struct Visit {
    #[serde(skip)]
    section: VisitSection,
    visited: Vec<bool>,
}

/// The reading of the touch sensor. The default is the reading of a dead sensor.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub enum TouchReading {
    #[default]
    Nothing,
    /// No unvisited place is within reach.
    Floor,
    Place(usize),
}

/// The mission action of a robot: it touches the place with this index.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Touch(pub usize);

impl Visit {
    fn left_within_reach(&self, robot: RobotId, floor: &Floor) -> Option<usize> {
        let position = floor.pose(robot).position;
        let is_near = |place| position.distance(self.section.at(place)) <= self.section.reach_m;
        (0..self.visited.len()).find(|&place| !self.visited[place] && is_near(place))
    }
}

impl MissionWorld for Visit {
    fn new(setup: &Setup, _: &Floor) -> Self {
        let section = setup.scenario.section::<VisitSection>().clone();
        Self {
            visited: vec![false; section.places.len()],
            section,
        }
    }

    fn act(
        &mut self,
        robot: RobotId,
        action: &Action,
        floor: &mut Floor,
        happened: &mut StepEvents,
    ) {
        // An action with any other content does nothing.
        let Some(Touch(place)) = action.value() else {
            return;
        };
        if self.left_within_reach(robot, floor) == Some(place) {
            self.visited[place] = true;
            happened.push_mission_event("visited", Some(robot)).subject =
                self.section.places[place].name.clone();
            // Robots near the place get a different sensor reading from now on.
            floor.invalidate_readings_near(self.section.at(place), self.section.reach_m);
        }
    }

    fn sense(&self, robot: RobotId, floor: &Floor, sensed: &mut SensorReading) -> Validity {
        *sensed.value_mut() = self
            .left_within_reach(robot, floor)
            .map_or(TouchReading::Floor, TouchReading::Place);
        Validity::UntilChange
    }

    /// Applies the fault `touch`, the only fault of this mission.
    fn change(
        &mut self,
        touch: &MissionFault,
        floor: &mut Floor,
    ) -> Option<Result<String, ChangeError>> {
        // The order has been checked: only an argument with a default can be missing.
        let number = |key| touch.get(key).unwrap_or(WITHIN_M) as f32;
        let (at, within_m) = (Vec2::new(number("x_m"), number("y_m")), number("within_m"));
        let is_near = |place: &usize| at.distance(self.section.at(*place)) <= within_m;
        let near: Vec<usize> = (0..self.visited.len()).filter(is_near).collect();
        for &place in &near {
            self.visited[place] = true;
            floor.invalidate_readings_near(self.section.at(place), self.section.reach_m);
        }
        Some(Ok(format!("{} places", near.len())))
    }

    fn end(&self, _: SimTime) -> Option<Outcome> {
        self.visited
            .iter()
            .all(|visited| *visited)
            .then_some(Outcome::Complete)
    }

    fn row(&self, row: &mut Vec<FigureValue>) {
        let visited = self.visited.iter().filter(|visited| **visited).count() as u64;
        row.extend([visited, self.visited.len() as u64 - visited].map(FigureValue::from));
    }

    fn state_hash(&self) -> u64 {
        hash_state(self)
    }

    fn add_to_view(&self, _: &Floor, view: &mut View) {
        for (place, visited) in self.visited.iter().enumerate() {
            let (id, at) = (format!("place-{place}"), self.section.at(place));
            view.mark(Mark {
                work: Work::left_or_done(!visited),
                label: self.section.places[place].name.clone(),
                ..Mark::disc(id, at, self.section.reach_m, MarkRole::Target)
            });
        }
    }
}
