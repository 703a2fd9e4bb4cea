//! The shortest ways around the solid obstacles of a scenario, by a visibility graph.
//!
//! A robot is a disc. Around each corner of an obstacle the graph has points on an octagon that encloses the disc, and
//! two points are connected if the disc can drive straight from one to the other. A way is therefore longer than the
//! shortest one by at most 8 % of its parts around corners.

use std::collections::HashMap;
use std::ops::RangeInclusive;
use std::sync::{Arc, OnceLock, PoisonError, RwLock};

use glam::Vec2;
use pathfinding::directed::dijkstra::dijkstra_all;
use scenario::{Obstacle, Scenario};
use smallvec::SmallVec;
use world_server::world::Regions;

use super::ServiceSection;

/// The most solid obstacles of a scenario with `costs = "path"`. The graph grows with the cube of their number.
pub(super) const MOST_OBSTACLES: usize = 100;
/// The range of the number of places whose distances are stored. Within it, there is room for each point and its
/// delivery. Robots that see points with errors ask for further places. One place too many removes all others.
const MOST_PLACES: RangeInclusive<usize> = 4096..=16_384;
/// The least distance by which a robot may be nearer to an obstacle than its radius, m. It covers rounding.
const ROUNDING_M: f32 = 1e-3;
/// The same distance in rooms far from (0, 0), as a multiple of the resolution of coordinates.
const ROUNDING: f32 = 4.0;
/// The tangent of 22.5°, half the angle of a side of an octagon.
const OCTAGON: f32 = 0.414_213_57;
/// The units of a meter in sums of distances. Whole numbers have a total order.
const PER_M: f32 = 1e6;

/// A rectangle that robots cannot enter.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Wall {
    low: Vec2,
    high: Vec2,
}

impl Wall {
    fn new(obstacle: &Obstacle) -> Self {
        let low = Vec2::new(obstacle.x_m, obstacle.y_m);
        let high = low + Vec2::new(obstacle.width_m, obstacle.height_m);
        Self { low, high }
    }

    /// Returns the corners, each with its direction outward.
    fn corners(&self) -> [(Vec2, Vec2); 4] {
        let Self { low, high } = *self;
        [
            (low, Vec2::NEG_ONE),
            (Vec2::new(high.x, low.y), Vec2::new(1.0, -1.0)),
            (high, Vec2::ONE),
            (Vec2::new(low.x, high.y), Vec2::new(-1.0, 1.0)),
        ]
    }

    fn distance(&self, place: Vec2) -> f32 {
        place.distance(place.clamp(self.low, self.high))
    }

    /// Returns whether a segment meets the rectangle, by its part within the range of each coordinate.
    fn is_met(&self, from: Vec2, to: Vec2) -> bool {
        let (mut begin, mut end) = (0.0_f32, 1.0_f32);
        for axis in 0..2 {
            let (start, step) = (from[axis], to[axis] - from[axis]);
            let (low, high) = (self.low[axis] - start, self.high[axis] - start);
            if step == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return false;
                }
                continue;
            }
            let (first, last) = (low / step, high / step);
            begin = begin.max(first.min(last));
            end = end.min(first.max(last));
        }
        begin <= end
    }

    /// Returns the distance between the rectangle and a segment; 0 if they meet.
    fn distance_to_segment(&self, from: Vec2, to: Vec2) -> f32 {
        if self.is_met(from, to) {
            return 0.0;
        }
        let way = to - from;
        let length = way.length_squared();
        let to_corner = |(corner, _): (Vec2, Vec2)| {
            let share = if length > 0.0 {
                ((corner - from).dot(way) / length).clamp(0.0, 1.0)
            } else {
                0.0
            };
            corner.distance(from + share * way)
        };
        let to_corners = self.corners().map(to_corner);
        let ends = [self.distance(from), self.distance(to)];
        to_corners
            .into_iter()
            .chain(ends)
            .fold(f32::INFINITY, f32::min)
    }
}

/// A place to which robots drive, with the ways from all nodes. The robots of a process share it.
#[derive(Debug)]
pub struct Destination {
    at: Vec2,
    /// The regions within reach of the place, in ascending order.
    regions: Vec<u32>,
    /// The nodes with a way to the place, and the lengths of the ways, m, in ascending order. Computed on first use,
    /// because robots drive straight to most places.
    ways: OnceLock<Vec<(f32, u32)>>,
}

/// A place from which robots drive, with its regions. One search of the regions serves all destinations.
#[derive(Clone, Debug)]
pub struct Origin {
    pub at: Vec2,
    /// The regions around the place: those of at most four grid points.
    regions: SmallVec<[u32; 4]>,
}

impl Origin {
    /// Creates an origin for ways that nothing blocks.
    #[must_use]
    pub fn new(at: Vec2) -> Self {
        let regions = SmallVec::new();
        Self { at, regions }
    }
}

/// The shortest ways of a robot in a room with solid obstacles.
#[derive(Debug)]
pub struct Paths {
    radius_m: f32,
    /// The distance by which a robot may be nearer to an obstacle than its radius, m.
    rounding_m: f32,
    /// The distance from a place within which robots work, m.
    reach_m: f32,
    walls: Vec<Wall>,
    nodes: Vec<Vec2>,
    /// The nodes that each node is connected with, and the distances, in units of [`PER_M`].
    edges: Vec<Vec<(usize, u64)>>,
    regions: Regions,
    /// The number of places that are stored.
    most_places: usize,
    /// The known places, by the bits of their coordinates. Obstacles never change, so a place stays valid. The contents
    /// change no result.
    places: RwLock<HashMap<[u32; 2], Arc<Destination>>>,
}

impl Paths {
    /// Computes the ways of a scenario; `None` if no obstacle is solid, so that each way is straight.
    #[must_use]
    pub fn new(scenario: &Scenario) -> Option<Self> {
        let regions = Regions::of(scenario)?;
        let radius_m = scenario.body.radius_m;
        let solid = scenario.obstacles.iter().filter(|each| each.is_solid());
        let section = ServiceSection::of(scenario);
        let places = 2 * section.kinds_of_points().count();
        let mut paths = Self {
            radius_m,
            rounding_m: ROUNDING_M.max(ROUNDING * scenario.room.resolution_m()),
            reach_m: section.reach_m,
            walls: solid.map(Wall::new).collect(),
            nodes: Vec::new(),
            edges: Vec::new(),
            regions,
            most_places: places.clamp(*MOST_PLACES.start(), *MOST_PLACES.end()),
            places: RwLock::new(HashMap::new()),
        };
        let room = scenario.room;
        let side_m = radius_m * OCTAGON;
        let around = [(radius_m, side_m), (side_m, radius_m)];
        let is_free = |place: &Vec2| {
            room.to_border_m(*place) >= radius_m - paths.rounding_m && paths.has_room(*place)
        };
        let corners = paths.walls.iter().flat_map(Wall::corners);
        let places = corners.flat_map(|(corner, outward)| {
            around.map(|(x_m, y_m)| corner + outward * Vec2::new(x_m, y_m))
        });
        paths.nodes = places.filter(is_free).collect();
        paths.edges = (paths.nodes.iter())
            .map(|node| paths.visible_from(*node).collect())
            .collect();
        Some(paths)
    }

    fn has_room(&self, place: Vec2) -> bool {
        let least_m = self.radius_m - self.rounding_m;
        self.walls
            .iter()
            .all(|wall| wall.distance(place) >= least_m)
    }

    /// Returns whether a robot can drive straight between two places. An end that is nearer to a wall than the radius
    /// permits the distance there, because a robot only has to come within reach of a point.
    fn is_straight(&self, from: Vec2, to: Vec2) -> bool {
        // Rounding has the same effect in both directions.
        let is_reversed = (from.x, from.y) > (to.x, to.y);
        let (from, to) = if is_reversed { (to, from) } else { (from, to) };
        // Most walls are far from the segment.
        let (low, high) = (from.min(to) - self.radius_m, from.max(to) + self.radius_m);
        let is_near = |wall: &&Wall| wall.low.cmple(high).all() && wall.high.cmpge(low).all();
        self.walls.iter().filter(is_near).all(|wall| {
            let ends_m = wall.distance(from).min(wall.distance(to));
            let least_m = self.radius_m.min(ends_m) - self.rounding_m;
            let distance_m = wall.distance_to_segment(from, to);
            distance_m >= least_m && (distance_m > 0.0 || ends_m == 0.0)
        })
    }

    /// Returns the nodes to which a robot can drive straight, with their distances.
    fn visible_from(&self, place: Vec2) -> impl Iterator<Item = (usize, u64)> {
        let nodes = self.nodes.iter().enumerate();
        let visible =
            nodes.filter(move |(_, node)| **node != place && self.is_straight(place, **node));
        visible.map(move |(index, node)| (index, (node.distance(place) * PER_M) as u64))
    }

    /// Returns the ways to a place.
    #[must_use]
    pub fn to(&self, at: Vec2) -> Arc<Destination> {
        let key = at.to_array().map(f32::to_bits);
        let places = self.places.read().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = places.get(&key) {
            return Arc::clone(known);
        }
        drop(places);
        let new = Arc::new(Destination {
            at,
            regions: self.regions.near(at, self.reach_m).into_iter().collect(),
            ways: OnceLock::new(),
        });
        let mut places = self.places.write().unwrap_or_else(PoisonError::into_inner);
        if places.len() >= self.most_places {
            places.clear();
        }
        places.insert(key, Arc::clone(&new));
        new
    }

    /// Computes the ways to a place from all nodes, by Dijkstra's method from the place.
    fn ways_to(&self, place: Vec2) -> Vec<(f32, u32)> {
        let start = self.nodes.len();
        let reached = dijkstra_all(&start, |node| match self.edges.get(*node) {
            Some(edges) => edges.clone(),
            None => self.visible_from(place).collect(),
        });
        let ways = reached.into_iter();
        let mut ways: Vec<(f32, u32)> = ways
            .filter(|(node, _)| *node != start)
            .map(|(node, (_, sum))| (sum as f32 / PER_M, node as u32))
            .collect();
        ways.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        ways
    }

    /// Returns the length of the shortest way to a place, m. `None` if no way leads within reach of the place. The
    /// length is that of the straight line if only gaps hardly wider than a robot lead there.
    #[must_use]
    pub fn length_m(&self, from: Vec2, to: &Destination) -> Option<f32> {
        let in_graph_m = self.length_in_graph_m(from, to);
        in_graph_m.or_else(|| is_connected(&self.origin(from), to).then(|| from.distance(to.at)))
    }

    /// Returns a place from which robots drive, with its regions.
    #[must_use]
    pub fn origin(&self, at: Vec2) -> Origin {
        let regions = self.regions.each_near(at, 0.0).collect();
        Origin { at, regions }
    }

    /// Returns whether a way leads within reach of a place. It has a length.
    #[must_use]
    pub fn has_way(&self, from: &Origin, to: &Destination) -> bool {
        is_connected(from, to) || self.length_in_graph_m(from.at, to).is_some()
    }

    fn length_in_graph_m(&self, from: Vec2, to: &Destination) -> Option<f32> {
        if self.is_straight(from, to.at) {
            return Some(from.distance(to.at));
        }
        let mut best_m = f32::INFINITY;
        for (rest_m, node) in to.ways.get_or_init(|| self.ways_to(to.at)) {
            // The nodes that follow are still farther from the place.
            if *rest_m >= best_m {
                break;
            }
            let node = self.nodes[*node as usize];
            let length_m = from.distance(node) + rest_m;
            if length_m < best_m && self.is_straight(from, node) {
                best_m = length_m;
            }
        }
        best_m.is_finite().then_some(best_m)
    }
}

/// Returns whether the regions at both ends are the same. The graph misses gaps that are hardly wider than a robot.
fn is_connected(from: &Origin, to: &Destination) -> bool {
    let mut regions = from.regions.iter();
    regions.any(|region| to.regions.contains(region))
}

#[cfg(test)]
mod tests {
    use pathfinding::directed::dijkstra::dijkstra;
    use proptest::prelude::*;
    use scenario::Room;

    use super::*;
    use crate::fixtures::parse;

    /// Returns the ways in a room of 12 × 9 m with obstacles: x, y, width and height, m. The radius of a robot is 0.2 m,
    /// and the reach 0.3 m.
    fn paths(obstacles: &[[f32; 4]]) -> Paths {
        let mut scenario = parse(
            "[service]\n[[service.kinds]]\nname = 'a'\nwork_s = { min = 1, max = 1 }\n[[service.random]]\nn = 1\n",
        );
        scenario.room = Room::of_size(12.0, 9.0);
        let obstacle = |[x_m, y_m, width_m, height_m]: &[f32; 4]| Obstacle {
            x_m: *x_m,
            y_m: *y_m,
            width_m: *width_m,
            height_m: *height_m,
            penetrability: 0.0,
        };
        scenario.obstacles = obstacles.iter().map(obstacle).collect();
        Paths::new(&scenario).unwrap()
    }

    fn length_m(paths: &Paths, from: (f32, f32), to: (f32, f32)) -> Option<f32> {
        paths.length_m(Vec2::from(from), &paths.to(Vec2::from(to)))
    }

    #[test]
    fn a_free_way_is_straight() {
        let paths = paths(&[[5.0, 3.0, 2.0, 3.0]]);
        assert_eq!(length_m(&paths, (1.0, 1.0), (4.0, 5.0)), Some(5.0));
        // Along the wall, at the distance of the radius.
        assert_eq!(length_m(&paths, (4.8, 2.0), (4.8, 7.0)), Some(5.0));
    }

    /// By hand: a wall from y = 0 to 6 m at x = 5 to 7 m. The corners of the octagon are at (5 ∓ 0.2, 6 + 0.0828) and
    /// (5 ∓ 0.0828, 6 + 0.2), and mirrored at 7 m.
    #[test]
    fn the_way_around_a_wall_has_the_length_by_hand() {
        let paths = paths(&[[5.0, 0.0, 2.0, 6.0]]);
        let side = 0.2 * OCTAGON;
        let first = Vec2::new(4.8, 6.0 + side).distance(Vec2::new(1.0, 2.0));
        let corner = 2.0_f32.sqrt() * (0.2 - side);
        let expected = 2.0 * (first + corner) + 2.0 + 2.0 * side;
        let found = length_m(&paths, (1.0, 2.0), (11.0, 2.0)).unwrap();
        assert!((found - expected).abs() < 1e-3, "{found}, not {expected}");
        // The ways to the place are cached.
        let again = length_m(&paths, (1.0, 2.0), (11.0, 2.0));
        assert_eq!(again, Some(found));
    }

    #[test]
    fn a_walled_place_has_no_way() {
        let paths = paths(&[[6.0, 0.0, 0.2, 9.0]]);
        assert_eq!(length_m(&paths, (1.0, 2.0), (11.0, 2.0)), None);
        // The wall is 0.1 m away: a robot comes within reach from its own side only.
        let right_m = length_m(&paths, (11.0, 2.0), (6.3, 2.0)).unwrap();
        assert!((right_m - 4.7).abs() < 1e-5, "{right_m}");
        assert_eq!(length_m(&paths, (1.0, 2.0), (6.3, 2.0)), None);
    }

    /// Returns the length of the shortest way on a grid of 0.1 m with diagonals, for a robot of another radius, m.
    fn grid_length_m(paths: &Paths, radius_m: f32, from: [i32; 2], to: [i32; 2]) -> Option<f32> {
        let place = |[x, y]: [i32; 2]| Vec2::new(x as f32, y as f32) / 10.0;
        let is_free = |at: [i32; 2]| {
            let to_border_m = place(at)
                .min(Vec2::new(12.0, 9.0) - place(at))
                .min_element();
            let mut walls = paths.walls.iter();
            to_border_m >= radius_m && walls.all(|wall| wall.distance(place(at)) >= radius_m)
        };
        let steps = (-1..=1).flat_map(|x| (-1..=1).map(move |y| [x, y]));
        let steps: Vec<[i32; 2]> = steps.filter(|step| *step != [0, 0]).collect();
        let next = |at: &[i32; 2]| {
            let next = steps.iter().map(|step| [at[0] + step[0], at[1] + step[1]]);
            let at = *at;
            let free = next.filter(|next| is_free(*next));
            free.map(move |next| (next, (place(at).distance(place(next)) * PER_M) as u64))
                .collect::<Vec<_>>()
        };
        let (_, sum) = dijkstra(&from, next, |at| *at == to).filter(|_| is_free(from))?;
        Some(sum as f32 / PER_M)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// A way is at least as long as the line, and as long in both directions. It is at most as long as that of a
        /// robot that is a tenth larger, which has room around the corners of all octagons.
        #[test]
        fn ways_are_shortest(
            walls in proptest::collection::vec((0.5..9.0_f32, 0.5..7.0_f32, 0.3..3.0_f32, 0.3..3.0_f32), 1..5),
            from in (3..118_i32, 3..88_i32),
            to in (3..118_i32, 3..88_i32),
        ) {
            let walls: Vec<[f32; 4]> = walls.into_iter().map(|(x, y, w, h)| [x, y, w, h]).collect();
            let paths = Paths { reach_m: 0.0, ..paths(&walls) };
            let [from, to] = [from, to].map(|(x, y)| [x, y]);
            let [a, b] = [from, to].map(|[x, y]| Vec2::new(x as f32, y as f32) / 10.0);
            let length_m = paths.length_m(a, &paths.to(b));
            if let Some(length_m) = length_m.filter(|_| paths.has_room(a) && paths.has_room(b)) {
                prop_assert!(length_m >= a.distance(b) - 1e-3);
                prop_assert!(paths.has_way(&paths.origin(a), &paths.to(b)));
                let back_m = paths.length_m(b, &paths.to(a)).unwrap_or(f32::INFINITY);
                prop_assert!((length_m - back_m).abs() < 1e-3, "{length_m} and {back_m}");
            }
            if let Some(most_m) = grid_length_m(&paths, 1.1 * paths.radius_m, from, to) {
                let length_m = length_m.unwrap_or(f32::INFINITY);
                prop_assert!(length_m <= most_m + 0.01, "{length_m} and {most_m}");
            }
        }
    }
}
