//! The world part of the drill: a test mission without tasks in the world.

use glam::Vec2;
use proto::mission::{Action, SensorReading};
use proto::tick::Outcome;
use scenario::ids::RobotId;
use scenario::testkit;
use scenario::time::SimTime;

use crate::mission::{FigureValue, MissionWorld, StepEvents, Validity, WorldMission};
use crate::world::Floor;
/// The drill. Robots start at the middle of the left wall.
/// The drill: robots begin in the middle of the left wall.
pub(crate) const DRILL: MissionWorld = MissionWorld {
    data: testkit::DRILL,
    start_area: |scenario| {
        let middle = scenario.room.height_m / 2.0;
        [Vec2::new(0.0, middle - 1.5), Vec2::new(0.6, middle + 1.5)]
    },
    starts: |_| Vec::new(),
    bars: |_| Vec::new(),
    new: |_, _| Box::new(Drill),
};

#[derive(Clone, Debug)]
struct Drill;

impl WorldMission for Drill {
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

    fn clone_boxed(&self) -> Box<dyn WorldMission> {
        Box::new(self.clone())
    }
}
