//! Regions of the room between which no robot can drive, for checks of a scenario.

use std::collections::BTreeSet;

use glam::Vec2;
use scenario::{Obstacle, Scenario};

use super::places::Places;

/// The largest number of grid points. A huge room has fewer points per robot.
const MOST_POINTS: f32 = 200_000.0;
/// The distance from a place to the nearest grid point, in steps of the grid: at most half a diagonal.
const HALF_DIAGONAL: f32 = 0.7072;
/// The number of a grid point at which no robot has room.
const SOLID: u32 = 0;

/// The regions of the room in which a robot can drive around. Border and solid obstacles separate them.
///
/// The search uses a grid. It never separates two places with a way between them. It can miss that a gap is too narrow by
/// up to 0.7 steps on each side; a step is half a radius, or more in huge rooms.
#[derive(Clone, Debug)]
pub struct Regions {
    /// The place of the first grid point, m.
    low: Vec2,
    step_m: f32,
    columns: usize,
    rows: usize,
    /// The number of each grid point's region, by row.
    regions: Vec<u32>,
    /// The regions with a grid point at which a robot surely has room.
    roomy: BTreeSet<u32>,
}

impl Regions {
    /// Computes the regions of a scenario; `None` if no obstacle is solid.
    #[must_use]
    pub fn of(scenario: &Scenario) -> Option<Self> {
        if !scenario.obstacles.iter().any(Obstacle::is_solid) {
            return None;
        }
        let (room, radius_m) = (scenario.room, scenario.body.radius_m);
        let step_m = (radius_m / 2.0).max((room.width_m * room.height_m / MOST_POINTS).sqrt());
        let count = |size_m: f32| (size_m / step_m) as usize + 1;
        let mut found = Self {
            low: room.low(),
            step_m,
            columns: count(room.width_m),
            rows: count(room.height_m),
            regions: Vec::new(),
            roomy: BTreeSet::new(),
        };
        let places = Places::of(scenario);
        let points = 0..found.columns * found.rows;
        let is_free: Vec<bool> = points
            .map(|point| places.has_room(found.place(point), radius_m - HALF_DIAGONAL * step_m))
            .collect();
        found.regions = vec![SOLID; is_free.len()];
        let mut count = SOLID;
        for first in 0..is_free.len() {
            if is_free[first] && found.regions[first] == SOLID {
                count += 1;
                found.fill(first, count, &is_free);
            }
        }
        let regions = found.regions.iter().enumerate();
        for (point, region) in regions.filter(|(_, region)| **region != SOLID) {
            if !found.roomy.contains(region) && places.can_stand(found.place(point)) {
                found.roomy.insert(*region);
            }
        }
        Some(found)
    }

    /// Returns the regions in which a robot can stand within a distance of a place.
    #[must_use]
    pub fn near(&self, place: Vec2, within_m: f32) -> BTreeSet<u32> {
        self.each_near(place, within_m).collect()
    }

    /// Returns the same regions as [`Regions::near`], some repeatedly, without a heap allocation.
    pub fn each_near(&self, place: Vec2, within_m: f32) -> impl Iterator<Item = u32> {
        let within_m = within_m + HALF_DIAGONAL * self.step_m;
        let index = |at_m: f32, count: usize| {
            (at_m.max(0.0) / self.step_m).min(count as f32 - 1.0) as usize
        };
        let from_low = place - self.low;
        let (low, high) = (from_low - within_m, from_low + within_m);
        let columns = index(low.x, self.columns)..=index(high.x, self.columns);
        let rows = index(low.y, self.rows)..=index(high.y, self.rows);
        let cells = rows.flat_map(move |row| columns.clone().map(move |column| (column, row)));
        cells
            .filter(move |(column, row)| self.place_at(*column, *row).distance(place) <= within_m)
            .map(|(column, row)| self.regions[row * self.columns + column])
            .filter(|region| *region != SOLID)
    }

    /// Returns whether a robot has room in a region that is not one of these.
    #[must_use]
    pub fn any_outside(&self, regions: &BTreeSet<u32>) -> bool {
        !self.roomy.is_subset(regions)
    }

    fn place(&self, point: usize) -> Vec2 {
        self.place_at(point % self.columns, point / self.columns)
    }

    fn place_at(&self, column: usize, row: usize) -> Vec2 {
        self.low + self.step_m * Vec2::new(column as f32, row as f32)
    }

    /// Gives a number to all points that are connected to `first`.
    fn fill(&mut self, first: usize, region: u32, is_free: &[bool]) {
        let mut open = vec![first];
        while let Some(point) = open.pop() {
            if !is_free[point] || std::mem::replace(&mut self.regions[point], region) == region {
                continue;
            }
            let (column, row) = (point % self.columns, point / self.columns);
            let neighbors = [
                (column > 0).then(|| point - 1),
                (column + 1 < self.columns).then(|| point + 1),
                (row > 0).then(|| point - self.columns),
                (row + 1 < self.rows).then(|| point + self.columns),
            ];
            open.extend(neighbors.into_iter().flatten());
        }
    }
}

#[cfg(test)]
mod tests {
    use scenario::Room;
    use scenario::testkit::default_scenario;

    use super::*;

    /// A room of 8 × 4 m with a wall at x = 4 m that leaves a gap at its upper end. The radius of a robot is 0.2 m.
    fn regions(gap_m: f32) -> Regions {
        let wall = Obstacle {
            x_m: 4.0,
            y_m: 0.0,
            width_m: 0.01,
            height_m: 4.0 - gap_m,
            penetrability: 0.0,
        };
        let room = Room::of_size(8.0, 4.0);
        let scenario = Scenario {
            obstacles: vec![wall],
            room,
            ..default_scenario()
        };
        Regions::of(&scenario).unwrap()
    }

    #[test]
    fn a_wall_separates_two_regions() {
        let [left, right] = [Vec2::new(1.0, 1.0), Vec2::new(7.0, 3.0)];
        for gap_m in [0.0, 0.2, 0.4, 0.5, 1.0] {
            let regions = regions(gap_m);
            let (left, right) = (regions.near(left, 0.0), regions.near(right, 0.0));
            assert_eq!((left.len(), right.len()), (1, 1), "{gap_m} m");
            // A robot needs 0.4 m.
            assert_eq!(left == right, gap_m >= 0.4, "{gap_m} m");
        }
    }

    #[test]
    fn a_place_has_the_regions_within_its_reach() {
        let regions = regions(0.0);
        assert_eq!(regions.near(Vec2::new(3.5, 2.0), 0.3).len(), 1);
        assert_eq!(
            regions.near(Vec2::new(3.5, 2.0), 0.8).len(),
            2,
            "across the wall"
        );
        assert_eq!(
            regions.near(Vec2::new(4.0, 2.0), 0.0).len(),
            0,
            "in the wall"
        );
        let left = regions.near(Vec2::new(1.0, 1.0), 0.0);
        assert!(regions.any_outside(&left));
        assert!(!regions.any_outside(&regions.near(Vec2::new(4.0, 2.0), 8.0)));
    }

    #[test]
    fn an_open_room_needs_no_search() {
        assert!(Regions::of(&default_scenario()).is_none());
    }
}
