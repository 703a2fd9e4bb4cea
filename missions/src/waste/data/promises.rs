//! Invariants of the clean-up's runs: items are never lost or duplicated, and deposits keep their items.

use glam::Vec2;
use scenario::Scenario;
use scenario::mission::expected_properties::{Disc, ExpectedProperties};

use super::{Spill, WasteSection};

/// Half the side of the square that random obstacles keep free around the center of each spill and deposit, m.
const CENTER_FREE_M: f32 = 0.5;
/// The minimum of the same length in robot radii: a robot fits at the center, or beside it in a corner of the room.
const CENTER_FREE_RADII: f32 = 2.5;
/// The width of the free strip at the report site, m.
const SITE_FREE_M: f32 = 1.2;

pub(super) fn promises(scenario: &Scenario) -> ExpectedProperties {
    let waste = WasteSection::of(scenario);
    let deposits = waste.deposits().map(|spot| Disc {
        center: spot.in_room(&scenario.room),
        radius_m: waste.deposit.radius_m,
    });
    let deposits: Vec<Disc> = deposits.collect();
    ExpectedProperties {
        items: waste.spills.iter().map(|spill| spill.items as usize).sum(),
        goals: deposits.clone(),
        targets: deposits,
        ends: !waste.respawn,
    }
}

/// Checks whether robots see a place during their work: in a spill, or near the straight way from a spill to its
/// deposit.
pub(super) fn is_in_view_of_work(scenario: &Scenario, place: Vec2) -> bool {
    let waste = WasteSection::of(scenario);
    waste.spills.iter().any(|spill| {
        let spill = spill.spot().in_room(&scenario.room);
        let deposits = waste
            .deposits()
            .map(|deposit| deposit.in_room(&scenario.room));
        let ways = deposits.map(|deposit| deposit - spill);
        let way = ways
            .min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
            .unwrap_or_default();
        let share = (place - spill).dot(way) / way.length_squared().max(f32::MIN_POSITIVE);
        let nearest = spill + way * share.clamp(0.0, 1.0);
        place.distance(spill) <= waste.spill_radius_m
            || place.distance(nearest) <= scenario.sensors.item_range_m / 2.0
    })
}

/// Returns the rectangles that random obstacles keep free: the centers of the spills and deposits, and the report site,
/// where the robots start. They are large enough for [`check_places`](super::check::check_places).
pub(super) fn kept_free(scenario: &Scenario) -> Vec<[Vec2; 2]> {
    let (room, waste) = (scenario.room, WasteSection::of(scenario));
    let free_m = CENTER_FREE_M.max(CENTER_FREE_RADII * scenario.body.radius_m);
    let spills = waste.spills.iter().map(Spill::spot);
    let centers = waste.deposits().chain(spills);
    let squares = centers.map(|spot| {
        let center = spot.in_room(&room);
        [center - free_m, center + free_m]
    });
    let middle_m = room.middle().y;
    let half_m = free_m.max(waste.report_site.height_m / 2.0);
    let site = [
        Vec2::new(room.x_m, middle_m - half_m),
        Vec2::new(room.x_m + free_m.max(SITE_FREE_M), middle_m + half_m),
    ];
    squares.chain([site]).collect()
}
