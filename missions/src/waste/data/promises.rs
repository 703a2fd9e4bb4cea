//! Invariants of the clean-up's runs: items are never lost or duplicated, and deposits keep their items.

use glam::Vec2;
use scenario::Scenario;
use scenario::mission::expected_properties::{Disc, Discs, ExpectedProperties};

use world_server::world::Grid;

use super::work::Ways;
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
    let deposits: Discs = deposits.collect();
    ExpectedProperties {
        items: waste.spills.iter().map(|spill| spill.items as usize).sum(),
        goals: deposits.clone(),
        targets: deposits,
        ends: !waste.respawn,
    }
}

/// Returns a function that checks whether robots see a place during their work: in a spill, or near the straight way from a
/// spill to its deposit.
pub(super) fn in_view_of_work<'a>(scenario: &'a Scenario) -> Box<dyn Fn(Vec2) -> bool + 'a> {
    let (room, waste) = (&scenario.room, WasteSection::of(scenario));
    let aside_m = scenario.sensors.item_range_m / 2.0;
    let places = Ways::new(scenario);
    let spills = waste.spills.iter().map(|spill| spill.spot().in_room(room));
    let ways: Vec<(Vec2, Vec2)> = spills
        .map(|spill| (spill, places.to_deposit(spill)))
        .collect();
    let longest_m = ways.iter().map(|(_, way)| way.length()).fold(0.0, f32::max);
    let reach_m = longest_m + aside_m.max(waste.spill_radius_m);
    let mut starts = Grid::new(room, reach_m, ways.len());
    for (index, (spill, _)) in ways.iter().enumerate() {
        starts.insert(index, *spill);
    }
    Box::new(move |place| {
        starts.near(place, reach_m).any(|(index, spill)| {
            let (_, way) = ways[index];
            let share = (place - spill).dot(way) / way.length_squared().max(f32::MIN_POSITIVE);
            let nearest = spill + way * share.clamp(0.0, 1.0);
            place.distance(spill) <= waste.spill_radius_m || place.distance(nearest) <= aside_m
        })
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
