//! Division of a large room into equal districts, without walls between them, to limit the robots and tasks of each.

use glam::Vec2;
use scenario::{Radio, Robot, Room};

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

/// Returns the indices of at most `most` places, nearest to `to` first. At equal distance the lower index comes first.
pub(crate) fn nearest(places: &[Vec2], to: Vec2, most: usize) -> Vec<usize> {
    let mut nearest: Vec<(f32, usize)> = Vec::with_capacity(most + 1);
    for (index, place) in places.iter().enumerate() {
        let squared = place.distance_squared(to);
        if nearest.len() == most && nearest[most - 1].0 <= squared {
            continue;
        }
        let before = nearest.partition_point(|known| known.0 <= squared);
        nearest.insert(before, (squared, index));
        nearest.truncate(most);
    }
    nearest.into_iter().map(|(_, index)| index).collect()
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
    let assigned = starts.iter();
    let assigned = assigned.map(|&start| nearest(places, start, places_per_robot));
    let mut assigned: Vec<Vec<usize>> = assigned.collect();
    for (index, &place) in places.iter().enumerate() {
        for robot in nearest(&starts, place, robots_per_place) {
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
