//! How long a unit of work takes: from one sign of progress to the next (ALLIANCE.md §3 "Progress").
//!
//! Estimated from the room's geometry at the body's top speed and turn rate, for the longest way of each kind, as if there
//! were nothing in between: obstacles, slow ground and teammates make it longer, near items shorter.

use super::WasteSection;
use glam::{UVec2, Vec2};

use super::BehaviorKind;
use alliance_proto::scenario::{Body, Scenario};
use alliance_proto::time::SimTime;

/// After this a spill that was seen empty may have waste again: somebody may have added some, or erred.
pub(crate) const EMPTY_EXPIRES: SimTime = SimTime(180_000);

/// Width and height of a cell of a search, in ranges of the robot's sight: from its middle, and from some way round it, all of
/// it is seen.
const CELL_SIGHTS: f32 = 0.8;

/// Columns and rows into which a search divides a room of that size, for robots that see waste as far as this from their
/// centers, m.
#[must_use]
pub(crate) fn sweep_cells(size: Vec2, sight_m: f32) -> UVec2 {
    // Casts saturate.
    (size / (CELL_SIGHTS * sight_m))
        .ceil()
        .as_uvec2()
        .max(UVec2::ONE)
}

/// Estimated time in which a robot with that body, that knows of no more waste, looks all over the room, s: until it doubts that
/// the spills are empty, and once along each row.
pub(super) fn search_s(scenario: &Scenario, body: &Body) -> f64 {
    let room = Vec2::new(scenario.room.width_m, scenario.room.height_m);
    let sight_m = body.radius_m + scenario.sensors.item_range_m;
    let rows = sweep_cells(room, sight_m).y as f32;
    let (way_m, turn_deg) = (rows * room.x + room.y, rows * 180.0);
    EMPTY_EXPIRES.as_secs_f64() + f64::from(way_m / body.speed_m_s + turn_deg / body.turn_deg_s)
}

/// Estimated length of a unit of work for a robot with that body, s.
///
/// - Finding the locations: along the longest wall, and a quarter turn.
/// - Moving a spill: from the deposit's edge to the far side of the spill and back, and two half turns.
/// - Reporting: to the report site from the spill or deposit that is farthest from it, and a half turn.
pub(super) fn unit_s(scenario: &Scenario, body: &Body, kind: BehaviorKind) -> f64 {
    let room = Vec2::new(scenario.room.width_m, scenario.room.height_m);
    let waste = WasteSection::of(scenario);
    let deposits = || waste.deposits().map(|spot| spot.in_room(&scenario.room));
    let (way_m, turn_deg) = match kind {
        BehaviorKind::FindLocationsMethodical | BehaviorKind::FindLocationsWander => {
            (room.max_element(), 90.0)
        }
        BehaviorKind::MoveSpill(spill) => {
            let spill = waste.spills[usize::from(spill)]
                .spot()
                .in_room(&scenario.room);
            let between = deposits().map(|deposit| spill.distance(deposit));
            let between = between.fold(f32::INFINITY, f32::min);
            let one_way = between + waste.spill_radius_m - waste.deposit.radius_m;
            (2.0 * one_way.max(0.0), 360.0)
        }
        BehaviorKind::ReportProgress => {
            let half = Vec2::new(0.0, waste.report_site.height_m / 2.0);
            let low = Vec2::new(0.0, room.y / 2.0) - half;
            let high = low + Vec2::new(waste.report_site.width_m, waste.report_site.height_m);
            let to_site = |from: Vec2| from.clamp(low, high).distance(from);
            let spills = waste.spills.iter();
            let places = spills
                .map(|spill| spill.spot().in_room(&scenario.room))
                .chain(deposits());
            (places.map(to_site).fold(0.0, f32::max), 180.0)
        }
    };
    f64::from(way_m / body.speed_m_s + turn_deg / body.turn_deg_s)
}
