//! The world part of the drill: a test mission without tasks in the world.

use glam::Vec2;
use proto::mission::{Deed, Sensed};
use proto::tick::Outcome;
use scenario::ids::RobotId;
use scenario::testkit;
use scenario::time::SimTime;

use crate::mission::{Happened, MissionWorld, Validity, Value, WorldMission};
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
    fn act(&mut self, _: RobotId, _: &Deed, _: &mut Floor, _: &mut Happened) {}

    fn sense(&self, _: RobotId, _: &Floor, sensed: &mut Sensed) -> Validity {
        *sensed = Sensed::Nothing;
        Validity::UntilChange
    }

    fn end(&self, _: SimTime) -> Option<Outcome> {
        None
    }

    fn row(&self, row: &mut Vec<Value>) {
        row.extend([1, 0, 0, 0].map(Value::Count));
        row.push(Value::None);
    }

    fn state(&self) -> u64 {
        0
    }

    fn boxed(&self) -> Box<dyn WorldMission> {
        Box::new(self.clone())
    }
}
