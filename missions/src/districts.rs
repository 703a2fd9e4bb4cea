//! Division of a large room into equal districts, without walls between them, to limit the robots and tasks of each, and
//! the search for the nearest places.

use glam::Vec2;
use scenario::{Radio, Robot, Room};
use world_server::world::Grid;

/// A grid of equal districts.
pub(crate) struct Districts {
    pub columns: usize,
    pub rows: usize,
}

/// The position of one item among all items of its district.
pub(crate) struct DistrictSlot {
    pub index: usize,
    pub count: usize,
}

impl DistrictSlot {
    /// Returns the height at which the item lies when all items are spread evenly, as a fraction of the district. The
    /// first item is on top. `margin` is the free space above and below, in distances between two items.
    pub fn height(&self, margin: f32) -> f32 {
        1.0 - (self.index as f32 + margin) / (self.count as f32 - 1.0 + 2.0 * margin)
    }
}

impl Districts {
    /// Creates a grid of at least `least` districts, as close to a square as possible.
    pub fn new(least: usize) -> Self {
        let mut columns = least.isqrt();
        if columns * columns < least {
            columns += 1;
        }
        Self {
            columns,
            rows: least.div_ceil(columns),
        }
    }

    pub fn count(&self) -> usize {
        self.columns * self.rows
    }

    pub fn column_and_row(&self, district: usize) -> (usize, usize) {
        (district % self.columns, district / self.columns)
    }

    /// Distributes `count` items evenly. Yields the district of each item, and its position among the items there.
    pub fn distribute(&self, count: usize) -> impl Iterator<Item = (usize, DistrictSlot)> + use<> {
        let districts = self.count();
        let first = move |district: usize| (district * count).div_ceil(districts);
        (0..count).map(move |each| {
            let district = each * districts / count;
            let share = DistrictSlot {
                index: each - first(district),
                count: first(district + 1) - first(district),
            };
            (district, share)
        })
    }
}

/// Returns the radio of a team. In teams of more than `neighbors` robots, the range is limited so that a robot receives
/// from this number of others on average.
pub(crate) fn radio(neighbors: usize, robots: usize, room: &Room) -> Radio {
    let area = f64::from(room.width_m) * f64::from(room.height_m);
    let range_m = (area * neighbors as f64 / (std::f64::consts::PI * robots as f64)).sqrt();
    Radio {
        range_m: (robots > neighbors).then_some(range_m.ceil() as f32),
        ..Radio::default()
    }
}

/// Places with a grid that finds the nearest ones, so that the assignment of a team takes time linear in its size.
pub(crate) struct Places {
    grid: Grid,
    count: usize,
    /// The first radius of a search, m: about one place lies within it.
    first_m: f32,
}

impl Places {
    pub fn new(places: &[Vec2]) -> Self {
        let all = || places.iter().copied();
        let low = all().reduce(Vec2::min).unwrap_or_default();
        let size = (all().fold(low, Vec2::max) - low).max(Vec2::ONE);
        let room = Room {
            x_m: low.x,
            y_m: low.y,
            ..Room::of_size(size.x, size.y)
        };
        let first_m = (size.x * size.y / places.len().max(1) as f32).sqrt();
        let mut grid = Grid::new(&room, first_m / 2.0, places.len());
        for (index, place) in places.iter().enumerate() {
            grid.insert(index, *place);
        }
        Self {
            grid,
            count: places.len(),
            first_m,
        }
    }

    /// Returns the indices of at most `most` places, nearest to `to` first. At equal distance the lower index comes first.
    pub fn nearest(&self, to: Vec2, most: usize) -> Vec<usize> {
        let mut reach_m = self.first_m;
        loop {
            let near = self.grid.near(to, reach_m);
            let mut near: Vec<(f32, usize)> = near
                .map(|(index, place)| (place.distance_squared(to), index))
                .collect();
            // Corners of the searched square are farther away than unsearched places.
            let is_sure = |&&(squared, _): &&(f32, usize)| squared < reach_m * reach_m;
            if near.len() == self.count || near.iter().filter(is_sure).count() >= most {
                near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                near.truncate(most);
                return near.into_iter().map(|(_, index)| index).collect();
            }
            reach_m *= 2.0;
        }
    }
}

/// Returns for each robot the places assigned to it, in ascending order. A robot gets the places nearest to its start,
/// and each place for which it is one of the nearest robots.
pub(crate) fn nearest_both_ways(
    team: &[Robot],
    places_per_robot: usize,
    places: &[Vec2],
    robots_per_place: usize,
) -> Vec<Vec<usize>> {
    let starts = starts(team);
    let all = Places::new(places);
    let assigned = starts.iter();
    let assigned = assigned.map(|&start| all.nearest(start, places_per_robot));
    let mut assigned: Vec<Vec<usize>> = assigned.collect();
    let starts = Places::new(&starts);
    for (index, &place) in places.iter().enumerate() {
        for robot in starts.nearest(place, robots_per_place) {
            assigned[robot].push(index);
        }
    }
    for places in &mut assigned {
        places.sort_unstable();
        places.dedup();
    }
    assigned
}

/// Returns the starts of robots, m.
pub(crate) fn starts(team: &[Robot]) -> Vec<Vec2> {
    let start = |robot: &Robot| robot.start.map_or(Vec2::ZERO, |start| start.position());
    team.iter().map(start).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Compares the search with a sorted list of all places. Whole coordinates have many equal distances.
        #[test]
        fn nearest_places_equal_those_of_a_full_search(
            places in prop::collection::vec((0..12_u8, 0..9_u8), 0..40),
            to in (-2..14_i8, -2..11_i8),
            most in 1..6_usize,
        ) {
            let at = |(x, y): (u8, u8)| Vec2::new(f32::from(x), f32::from(y));
            let places: Vec<Vec2> = places.into_iter().map(at).collect();
            let to = Vec2::new(f32::from(to.0), f32::from(to.1));
            let mut expected: Vec<usize> = (0..places.len()).collect();
            expected.sort_by(|a, b| {
                let squared = |index: &usize| places[*index].distance_squared(to);
                squared(a).total_cmp(&squared(b))
            });
            expected.truncate(most);
            prop_assert_eq!(Places::new(&places).nearest(to, most), expected);
        }
    }
}
