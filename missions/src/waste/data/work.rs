//! Estimates of the duration of a unit of work: the time between two signs of progress.
//!
//! The estimates use the geometry of the room, top speed and turn rate, and the longest way of each kind. Obstacles,
//! slow ground and teammates increase the real time, and near items reduce it.

use glam::{UVec2, Vec2};
use scenario::time::SimTime;
use scenario::{Body, Scenario};
use world_server::world::Grid;

use super::{BehaviorKind, Spill, WasteSection};

/// The time after which a spill that was seen empty counts as unknown. Waste may have been added, or a robot may have
/// erred.
pub(crate) const EMPTY_EXPIRES: SimTime = SimTime(180_000);

/// The side of a search cell, in ranges of the waste sensor. At this size the whole cell is visible from and around its
/// center.
const CELL_SIGHTS: f32 = 0.8;

/// The first radius of a search for the nearest deposit, m. It doubles until one is found.
const SEARCH_M: f32 = 10.0;

/// Returns the columns and rows of a search of a room, for robots with sensor range `sight_m` from their centers, m.
#[must_use]
pub(crate) fn sweep_cells(size: Vec2, sight_m: f32) -> UVec2 {
    (size / (CELL_SIGHTS * sight_m))
        .ceil()
        .as_uvec2()
        .max(UVec2::ONE)
}

/// Returns the estimated time, s, in which a robot that knows of no waste searches the whole room. It includes the time
/// until the spills count as unknown, and a pass along each row.
pub(super) fn search_s(scenario: &Scenario, body: &Body) -> f64 {
    let room = scenario.room.size();
    let sight_m = body.radius_m + scenario.sensors.item_range_m;
    let rows = sweep_cells(room, sight_m).y as f32;
    let (way_m, turn_deg) = (rows * room.x + room.y, rows * 180.0);
    EMPTY_EXPIRES.as_secs_f64() + f64::from(way_m / body.speed_m_s + turn_deg / body.turn_deg_s)
}

/// The places of a scenario between which robots work.
pub(super) struct Ways<'a> {
    scenario: &'a Scenario,
    waste: &'a WasteSection,
    /// The deposits, in a grid that finds the nearest one of many.
    deposits: Grid,
}

impl<'a> Ways<'a> {
    pub fn new(scenario: &'a Scenario) -> Self {
        let waste = WasteSection::of(scenario);
        let room = &scenario.room;
        let mut deposits = Grid::new(room, waste.deposit.radius_m, waste.deposits().count());
        for (index, spot) in waste.deposits().enumerate() {
            deposits.insert(index, spot.in_room(room));
        }
        Self {
            scenario,
            waste,
            deposits,
        }
    }

    /// Returns the estimated duration of a unit of work for a robot with this body, s.
    ///
    /// - Finding the locations: along the longest wall, and a quarter turn.
    /// - Moving a spill: from the deposit's edge to the far side of the spill and back, and two half turns.
    /// - Reporting: to the report site from the spill or deposit that is farthest from it, and a half turn.
    pub fn unit_s(&self, body: &Body, kind: BehaviorKind) -> f64 {
        let (room, waste) = (&self.scenario.room, self.waste);
        let (way_m, turn_deg) = match kind {
            BehaviorKind::FindLocationsMethodical | BehaviorKind::FindLocationsWander => {
                (room.size().max_element(), 90.0)
            }
            BehaviorKind::MoveSpill(spill) => {
                let spill = waste.spills[spill as usize].spot().in_room(room);
                let one_way =
                    self.to_deposit(spill).length() + waste.spill_radius_m - waste.deposit.radius_m;
                (2.0 * one_way.max(0.0), 360.0)
            }
            BehaviorKind::ReportProgress => {
                let half = Vec2::new(0.0, waste.report_site.height_m / 2.0);
                let low = room.at(Vec2::new(0.0, 0.5)) - half;
                let high = low + Vec2::new(waste.report_site.width_m, waste.report_site.height_m);
                let to_site = |from: Vec2| from.clamp(low, high).distance(from);
                let spills = waste.spills.iter().map(Spill::spot);
                let places = spills
                    .chain(waste.deposits())
                    .map(|spot| spot.in_room(room));
                (places.map(to_site).fold(0.0, f32::max), 180.0)
            }
        };
        f64::from(way_m / body.speed_m_s + turn_deg / body.turn_deg_s)
    }

    /// Returns the way to the nearest deposit, m: the first one if several are equally near.
    pub fn to_deposit(&self, from: Vec2) -> Vec2 {
        let whole_m = self.scenario.room.size().element_sum();
        let mut reach_m = SEARCH_M;
        loop {
            let near = self.deposits.near(from, reach_m);
            let near = near.map(|(index, deposit)| (deposit - from, index));
            let nearest = near.min_by(|(a, first), (b, second)| {
                let squared = a.length_squared().total_cmp(&b.length_squared());
                squared.then(first.cmp(second))
            });
            // A deposit beyond the reach may be nearer than one in a corner of the searched square.
            let way = nearest.map(|(way, _)| way);
            if way.is_some_and(|way| way.length() <= reach_m) || reach_m > whole_m {
                return way.unwrap_or_default();
            }
            reach_m *= 2.0;
        }
    }
}
