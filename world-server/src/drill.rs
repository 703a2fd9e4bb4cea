//! The world part of the drill: a test mission without tasks in the world.

use glam::Vec2;
use proto::mission::{Action, SensorReading};
use proto::tick::Outcome;
use scenario::ids::RobotId;
use scenario::time::SimTime;
use scenario::{Scenario, Setup, testkit};

use crate::mission::{FigureValue, MissionWorld, StepEvents, Validity, WorldKind};
use crate::world::Floor;

pub(crate) const DRILL: WorldKind = WorldKind::new::<Drill>(testkit::DRILL);

#[derive(Clone, Debug)]
struct Drill;

impl MissionWorld for Drill {
    fn new(_: &Setup, _: &Floor) -> Self {
        Self
    }

    /// Robots start at the middle of the left wall.
    fn start_area(scenario: &Scenario) -> [Vec2; 2] {
        let (left, middle) = (scenario.room.x_m, scenario.room.middle().y);
        [
            Vec2::new(left, middle - 1.5),
            Vec2::new(left + 0.6, middle + 1.5),
        ]
    }

    fn act(&mut self, _: RobotId, _: &Action, _: &mut Floor, _: &mut StepEvents) {}

    fn sense(&self, _: RobotId, _: &Floor, sensed: &mut SensorReading) -> Validity {
        *sensed = SensorReading::Nothing;
        Validity::UntilChange
    }

    fn end(&self, _: SimTime) -> Option<Outcome> {
        None
    }

    fn row(&self, row: &mut Vec<FigureValue>) {
        row.extend([1, 0, 0, 0].map(FigureValue::Count));
        row.push(FigureValue::None);
    }

    fn state_hash(&self) -> u64 {
        0
    }
}
