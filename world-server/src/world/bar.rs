//! A bar: a solid with round ends that bodies can push, and the limits of its motion.

use glam::Vec2;
use parry2d::query::Ray;
use proto::view::MarkOutline;
use scenario::Room;
use scenario::ids::RobotId;

use super::grid::Grid;
use super::outline::cast_at_disc;
use super::{Floor, Outline, SKIN_M};

/// The least distance between a moving bar and another solid, m. Bodies in contact stand this far away, or twice as far.
const CLEARANCE_M: f32 = SKIN_M / 2.0;

/// The largest rounding error of a coordinate, m.
const ROUNDING_M: f32 = 1e-4;

/// The number of halvings in the search for a bar's free motion. Ten halvings resolve a thousandth of a step's way.
const HALVINGS: usize = 10;

/// A straight bar with round ends, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bar {
    /// The first end of the axis.
    pub from: Vec2,
    /// The second end of the axis.
    pub to: Vec2,
    /// Half of the thickness.
    pub half_width_m: f32,
}

impl Bar {
    /// Returns the middle of the axis.
    #[must_use]
    pub fn center(&self) -> Vec2 {
        self.from.midpoint(self.to)
    }

    /// Returns the distance from the center to the farthest point of the bar, m.
    fn reach_m(&self) -> f32 {
        self.from.distance(self.to) / 2.0 + self.half_width_m
    }

    /// Returns the point of the axis that is nearest to `point`.
    fn nearest(&self, point: Vec2) -> Vec2 {
        let axis = self.to - self.from;
        let squared = axis.length_squared();
        let share = if squared > 0.0 {
            (point - self.from).dot(axis) / squared
        } else {
            0.0
        };
        self.from + axis * share.clamp(0.0, 1.0)
    }

    pub(super) fn surface(&self, point: Vec2) -> (f32, Vec2) {
        let offset = point - self.nearest(point);
        let length = offset.length();
        let normal = if length > 0.0 {
            offset / length
        } else {
            (self.to - self.from).perp().normalize_or(Vec2::X)
        };
        (length - self.half_width_m, normal)
    }

    /// Returns the distance from `point` to the surface, m; below 0 inside.
    #[must_use]
    pub fn distance_to_point(&self, point: Vec2) -> f32 {
        self.surface(point).0
    }

    pub(super) fn is_beyond(&self, point: Vec2, reach_m: f32) -> bool {
        let apart_m = reach_m + self.half_width_m;
        let (min, max) = (self.from.min(self.to), self.from.max(self.to));
        (point + apart_m).cmplt(min).any() || (point - apart_m).cmpgt(max).any()
    }

    /// Returns the distance at which a ray from outside meets the bar grown by `margin_m`, m. The ray meets a side or the disc
    /// round an end.
    pub(super) fn cast(&self, ray: &Ray, max_m: f32, margin_m: f32) -> Option<f32> {
        let radius_m = self.half_width_m + margin_m;
        let length_m = self.from.distance(self.to);
        let along = (self.to - self.from).normalize_or_zero();
        let offset = ray.origin - self.from;
        let (across_m, approach) = (along.perp_dot(offset), along.perp_dot(ray.dir));
        // Rounding can put the origin inside.
        let away_m = across_m.abs() - radius_m;
        let closing = -approach * across_m.signum();
        if away_m > -ROUNDING_M && closing > 0.0 {
            let way_m = (away_m / closing).max(0.0);
            let at_m = along.dot(offset + ray.dir * way_m);
            if way_m <= max_m && (0.0..=length_m).contains(&at_m) {
                return Some(way_m);
            }
        }
        let ends = [self.from, self.to].map(|end| cast_at_disc(ray, end, radius_m, max_m));
        ends.into_iter().flatten().reduce(f32::min)
    }

    /// Returns the distance to another bar, m. If the axes do not cross, it is their distance minus both half widths.
    fn distance_m(&self, other: &Self) -> f32 {
        let widths_m = self.half_width_m + other.half_width_m;
        if self.crosses(other) {
            return -widths_m;
        }
        let apart = |bar: &Self, point: Vec2| bar.nearest(point).distance(point);
        let ways = [
            apart(self, other.from),
            apart(self, other.to),
            apart(other, self.from),
            apart(other, self.to),
        ];
        ways.into_iter().fold(f32::INFINITY, f32::min) - widths_m
    }

    /// Checks whether the axes of the two bars cross.
    fn crosses(&self, other: &Self) -> bool {
        let parts = |one: &Self, other: &Self| {
            let axis = one.to - one.from;
            let sides = [other.from, other.to].map(|end| axis.perp_dot(end - one.from));
            sides[0] * sides[1] < 0.0
        };
        parts(self, other) && parts(other, self)
    }

    /// Returns the distance to a solid that does not move, m; below 0 where they overlap.
    #[must_use]
    pub fn distance_to(&self, solid: &Outline) -> f32 {
        match *solid {
            Outline::Disc { center, radius_m } => self.surface(center).0 - radius_m,
            Outline::Rectangle { min, max } => {
                if solid.contains(self.from) {
                    return -self.half_width_m;
                }
                let corners = [min, Vec2::new(max.x, min.y), max, Vec2::new(min.x, max.y)];
                let ways = (0..4).map(|corner| {
                    self.distance_m(&Self {
                        from: corners[corner],
                        to: corners[(corner + 1) % 4],
                        half_width_m: 0.0,
                    })
                });
                ways.fold(f32::INFINITY, f32::min)
            }
            Outline::Wall { .. } => {
                let ends = [self.from, self.to].map(|end| solid.surface(end).0);
                ends[0].min(ends[1]) - self.half_width_m
            }
            Outline::Bar(other) => self.distance_m(&other),
        }
    }
}

impl From<Bar> for MarkOutline {
    fn from(bar: Bar) -> Self {
        Self::Bar {
            from: bar.from,
            to: bar.to,
            half_width_m: bar.half_width_m,
        }
    }
}

#[derive(Clone, Debug)]
pub(super) struct Bars {
    bars: Vec<Bar>,
    centers: Grid,
    /// The largest distance from a bar's center to its farthest point, m.
    reach_m: f32,
}

impl Bars {
    pub fn new(room: &Room, bars: Vec<Bar>) -> Self {
        let reach_m = bars.iter().map(Bar::reach_m).fold(0.0, f32::max);
        let mut centers = Grid::new(room, reach_m, bars.len());
        for (index, bar) in bars.iter().enumerate() {
            centers.insert(index, bar.center());
        }
        Self {
            bars,
            centers,
            reach_m,
        }
    }

    /// Returns the bars within `reach_m` of a point, with their numbers.
    pub fn near(&self, point: Vec2, reach_m: f32) -> impl Iterator<Item = (usize, Bar)> + '_ {
        let near =
            (!self.bars.is_empty()).then(|| self.centers.near(point, reach_m + self.reach_m));
        let near = near.into_iter().flatten();
        let near = near.map(|(index, _)| (index, self.bars[index]));
        near.filter(move |(_, bar)| !bar.is_beyond(point, reach_m))
    }

    pub fn all(&self) -> &[Bar] {
        &self.bars
    }
}

/// A body that drives against a bar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// The robot that pushes.
    pub robot: RobotId,
    /// The number of the bar.
    pub bar: usize,
    /// The distance that the body could still move in this step without the bar, at its pushing speed, m.
    pub remaining_m: f32,
}

impl Floor {
    /// Returns the bars in the numbering of the mission.
    #[must_use]
    pub fn bars(&self) -> &[Bar] {
        self.space.bars.all()
    }

    /// Returns the bars within `reach_m` of a point, with their numbers.
    pub fn bars_near(&self, point: Vec2, reach_m: f32) -> impl Iterator<Item = (usize, Bar)> + '_ {
        self.space.bars.near(point, reach_m)
    }

    /// Moves a bar. `sensed_m` is the range of the sensors that detect bars, m; readings within this range become invalid.
    pub fn move_bar(&mut self, bar: usize, to: Bar, sensed_m: f32) {
        let bars = &mut self.space.bars;
        bars.bars[bar] = to;
        bars.centers.relocate(bar, to.center());
        let sensed_m = sensed_m.max(self.near_m() + self.body.radius_m);
        self.invalidate_readings_near(to.center(), to.reach_m() + sensed_m);
    }

    /// Returns the greatest share of a bar's motion, 0 to 1, without a collision. `at` returns the bar after a given share, or
    /// `None` where the bar must not be.
    pub fn free_share(&self, bar: usize, at: impl Fn(f32) -> Option<Bar>) -> f32 {
        let is_free = |share: f32| at(share).is_some_and(|to| self.has_room_for(bar, &to));
        if is_free(1.0) {
            return 1.0;
        }
        let (mut free, mut stopped) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = (free + stopped) / 2.0;
            if is_free(middle) {
                free = middle;
            } else {
                stopped = middle;
            }
        }
        free
    }

    /// Checks whether a bar can move to `to` in a step. The bar must not come nearer to a body that it already touches.
    fn has_room_for(&self, bar: usize, to: &Bar) -> bool {
        let now = &self.bars()[bar];
        let (center, reach_m) = (to.center(), to.reach_m() + CLEARANCE_M);
        let radius_m = self.body.radius_m;
        let mut bodies = self.bodies.near(center, reach_m + radius_m);
        let mut others = self.bars_near(center, reach_m);
        bodies.all(|(_, body)| {
            let least_m = CLEARANCE_M.min(now.surface(body).0 - radius_m);
            to.surface(body).0 - radius_m >= least_m
        }) && others.all(|(other, outline)| other == bar || to.distance_m(&outline) >= CLEARANCE_M)
            && self
                .space
                .fixed_solids_near(center, reach_m)
                .all(|solid| to.distance_to(&solid) >= CLEARANCE_M)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn point() -> impl Strategy<Value = Vec2> {
        (-3.0..3.0_f32, -3.0..3.0_f32).prop_map(|(x, y)| Vec2::new(x, y))
    }

    fn bar() -> impl Strategy<Value = Bar> {
        (point(), point(), 0.0..0.5_f32).prop_map(|(from, to, half_width_m)| Bar {
            from,
            to,
            half_width_m,
        })
    }

    /// Returns the distance to the surface, with the bar approximated by discs along its axis.
    fn by_discs(bar: &Bar, point: Vec2) -> f32 {
        let along = (0..=1000).map(|part| bar.from.lerp(bar.to, part as f32 / 1000.0));
        let ways = along.map(|center| center.distance(point));
        ways.fold(f32::INFINITY, f32::min) - bar.half_width_m
    }

    proptest! {
        #[test]
        fn a_bar_covers_the_discs_along_its_axis(bar in bar(), at in point()) {
            let (way_m, normal) = bar.surface(at);
            prop_assert!((way_m - by_discs(&bar, at)).abs() < 0.005);
            prop_assert!((normal.length() - 1.0).abs() < 1e-5);
            prop_assert!(!bar.is_beyond(at, way_m + 1e-4));
        }

        /// Checks that a sweeping disc stops at contact, not earlier, and passes other bars without contact.
        #[test]
        fn a_sweeping_disc_stops_at_the_bar(bar in bar(), from in point(), heading in -3.2..3.2_f32, radius_m in 0.05..0.5_f32) {
            let outline = Outline::Bar(bar);
            let direction = Vec2::from_angle(heading);
            prop_assume!(bar.surface(from).0 > radius_m + 2.0 * SKIN_M);
            let max_m = 8.0;
            let stop = outline.sweep(from, radius_m, direction, max_m);
            let way_m = stop.map_or(max_m, |stop| stop.distance_m);
            for part in 0..=200 {
                let at = from + direction * (way_m * part as f32 / 200.0);
                let gap_m = bar.surface(at).0 - radius_m;
                prop_assert!(gap_m > SKIN_M / 2.0 - 1e-4, "{part}: {gap_m}");
            }
            if let Some(stop) = stop {
                let gap_m = bar.surface(from + direction * stop.distance_m).0 - radius_m;
                prop_assert!((gap_m - SKIN_M).abs() < SKIN_M, "{gap_m}");
                let (_, normal) = bar.surface(from + direction * stop.distance_m);
                prop_assert!((stop.normal - normal).length() < 1e-3);
            }
        }

        /// Starts close to contact, at any distance from the origin.
        #[test]
        fn no_disc_drives_into_a_bar(y in 0.2..2.2_f32, x in 0.0..500.0_f32, gap_m in 0.9..1.1_f32, heading_rad in -0.4..0.4_f32) {
            let from = Vec2::new(x, x);
            let bar = Bar { from, to: from + Vec2::new(0.1, 2.4), half_width_m: 0.1 };
            let (normal, along) = (Vec2::new(2.4, -0.1).normalize_or_zero(), Vec2::new(0.1, 2.4).normalize_or_zero());
            let center = from + along * y - normal * (0.3 + gap_m * SKIN_M);
            let direction = normal.rotate(Vec2::from_angle(heading_rad));
            let stop = Outline::Bar(bar).sweep(center, 0.2, direction, 0.025);
            prop_assert!(stop.is_some_and(|stop| stop.distance_m < 0.001), "{stop:?}");
        }

        #[test]
        fn the_distance_of_two_bars_is_the_least_of_their_points(one in bar(), other in bar()) {
            let along = (0..=1000).map(|part| other.from.lerp(other.to, part as f32 / 1000.0));
            let least = along.map(|at| one.surface(at).0).fold(f32::INFINITY, f32::min) - other.half_width_m;
            let way_m = one.distance_m(&other);
            // No sample has to lie at a crossing of the axes.
            prop_assert!((way_m - least).abs() < 0.01, "{way_m} {least}");
            prop_assert_eq!(way_m, one.distance_to(&Outline::Bar(other)));
        }

        #[test]
        fn the_distance_to_a_rectangle_is_the_least_of_its_points(bar in bar(), low in point(), width in 0.1..2.0_f32, height in 0.1..2.0_f32) {
            let rectangle = Outline::Rectangle { min: low, max: low + Vec2::new(width, height) };
            let along = (0..=1000).map(|part| bar.from.lerp(bar.to, part as f32 / 1000.0));
            let least = along.map(|at| rectangle.surface(at).0).fold(f32::INFINITY, f32::min);
            let way_m = bar.distance_to(&rectangle);
            if least > 0.01 {
                prop_assert!((way_m - (least - bar.half_width_m)).abs() < 0.01);
            } else {
                prop_assert!(way_m <= 0.01);
            }
        }
    }
}
