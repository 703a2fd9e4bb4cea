//! Rooms in any size: so many districts side by side, without walls between them, that none has more than its share of robots and of
//! what there is to do.

/// Districts side by side.
pub(crate) struct Districts {
    pub columns: usize,
    pub rows: usize,
}

/// One of those that share a district.
pub(crate) struct Share {
    pub index: usize,
    pub of: usize,
}

impl Share {
    /// How high it is when all are evenly spread, the first on top, as a fraction; `margin` is the room above and below, in
    /// distances between two.
    pub fn height(&self, margin: f32) -> f32 {
        1.0 - (self.index as f32 + margin) / (self.of as f32 - 1.0 + 2.0 * margin)
    }
}

impl Districts {
    /// At least so many, as nearly a square as there is.
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

    /// Column and row of a district.
    pub fn place(&self, district: usize) -> (usize, usize) {
        (district % self.columns, district / self.columns)
    }

    /// So many things, dealt to the districts: of each its district, and which of those there it is.
    pub fn deal(&self, count: usize) -> impl Iterator<Item = (usize, Share)> + use<> {
        let districts = self.count();
        let first = move |district: usize| (district * count).div_ceil(districts);
        (0..count).map(move |each| {
            let district = each * districts / count;
            let share = Share {
                index: each - first(district),
                of: first(district + 1) - first(district),
            };
            (district, share)
        })
    }
}

/// Range of a radio with which a robot hears so many others on average, in a room of that area with so many robots, m.
pub(crate) fn range_to_hear(heard: usize, robots: usize, width_m: f32, height_m: f32) -> f32 {
    let area = f64::from(width_m) * f64::from(height_m);
    let range_m = (area * heard as f64 / (std::f64::consts::PI * robots as f64)).sqrt();
    range_m.ceil() as f32
}

/// The places that are nearest to one, at most so many, nearest first; of two that are equally near, the first.
pub(crate) fn nearest(places: &[(f32, f32)], to: (f32, f32), most: usize) -> Vec<usize> {
    let mut nearest: Vec<(f32, usize)> = Vec::with_capacity(most + 1);
    for (index, place) in places.iter().enumerate() {
        let (x, y) = (place.0 - to.0, place.1 - to.1);
        let squared = x * x + y * y;
        if nearest.len() == most && nearest[most - 1].0 <= squared {
            continue;
        }
        let before = nearest.partition_point(|known| known.0 <= squared);
        nearest.insert(before, (squared, index));
        nearest.truncate(most);
    }
    nearest.into_iter().map(|(_, index)| index).collect()
}

/// For each robot, in order, the places that are its own: so many that are nearest to it, and those to which it is one of so many nearest
/// robots.
pub fn nearest_both_ways(
    robots: &[(f32, f32)],
    places_per_robot: usize,
    places: &[(f32, f32)],
    robots_per_place: usize,
) -> Vec<Vec<usize>> {
    let own = robots.iter();
    let own = own.map(|&robot| nearest(places, robot, places_per_robot));
    let mut own: Vec<Vec<usize>> = own.collect();
    for (index, &place) in places.iter().enumerate() {
        for robot in nearest(robots, place, robots_per_place) {
            own[robot].push(index);
        }
    }
    for places in &mut own {
        places.sort_unstable();
        places.dedup();
    }
    own
}
