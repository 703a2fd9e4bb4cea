//! The room without robots: border, obstacles, patches and bars, and the free places between them.

use glam::Vec2;
use proto::readings::Pose;
use scenario::{Body, Obstacle, Room, Scenario};

use super::bar::Bars;
use super::{Bar, Component, ComponentId, ObstacleId, Outline, Penetrability, SKIN_M, Shape};

/// The overlap with a solid that is allowed because positions are rounded, m.
pub const ROUNDING_M: f32 = 1e-5;
/// The distance between the rings in a search round a point, m.
const RING_M: f32 = 0.1;
/// The distance that a robot keeps from solids while it drives, m. It includes the tolerance of the controllers.
const DRIVE_CLEARANCE_M: f32 = 0.09;
/// The number of directions in a search round a point.
const DIRECTIONS: i32 = 16;

#[derive(Clone, Debug)]
pub(super) struct Space {
    pub room: Room,
    rectangles: Vec<Component>,
    pub bars: Bars,
    /// The id of the next rectangle. No id is used twice.
    next_id: ObstacleId,
}

impl Space {
    pub fn new(scenario: &Scenario, bars: Vec<Bar>) -> Self {
        let room = scenario.room;
        let mut space = Self {
            room,
            bars: Bars::new(&room, bars),
            rectangles: Vec::with_capacity(scenario.obstacles.len()),
            next_id: ObstacleId(0),
        };
        for obstacle in &scenario.obstacles {
            space.add(obstacle);
        }
        space
    }

    pub fn add(&mut self, obstacle: &Obstacle) -> ObstacleId {
        let id = self.next_id;
        self.next_id.0 += 1;
        let half_size_m = Vec2::new(obstacle.width_m, obstacle.height_m) / 2.0;
        self.rectangles.push(Component {
            id: ComponentId::Obstacle(id),
            pose: Pose {
                position: Vec2::new(obstacle.x_m, obstacle.y_m) + half_size_m,
                heading_rad: 0.0,
            },
            shape: Shape::Rectangle { half_size_m },
            penetrability: Penetrability(obstacle.penetrability),
        });
        id
    }

    /// Removes a rectangle and returns whether it existed.
    pub fn remove(&mut self, id: ObstacleId) -> bool {
        let before = self.rectangles.len();
        self.rectangles
            .retain(|rectangle| rectangle.id != ComponentId::Obstacle(id));
        self.rectangles.len() < before
    }

    pub fn rectangles(&self) -> &[Component] {
        &self.rectangles
    }

    /// Returns the four sides of the border: left, right, lower, upper.
    pub fn walls(&self) -> [Outline; 4] {
        let wall = |normal, offset_m| Outline::Wall { normal, offset_m };
        let (low, high) = (self.room.low(), self.room.high());
        [
            wall(Vec2::X, low.x),
            wall(Vec2::NEG_X, -high.x),
            wall(Vec2::Y, low.y),
            wall(Vec2::NEG_Y, -high.y),
        ]
    }

    /// Checks whether any side of the border is within reach of a point.
    pub fn is_near_border(&self, point: Vec2, reach_m: f32) -> bool {
        self.room.to_border_m(point) <= reach_m
    }

    /// Checks whether certainly nothing is within reach of a point.
    pub fn is_open(&self, point: Vec2, reach_m: f32) -> bool {
        self.rectangles.is_empty()
            && !self.is_near_border(point, reach_m)
            && self.bars.near(point, reach_m).next().is_none()
    }

    pub fn walls_near(&self, point: Vec2, reach_m: f32) -> impl Iterator<Item = Outline> + use<> {
        let walls = self.walls().into_iter();
        walls.filter(move |wall| !wall.is_out_of_reach(point, reach_m))
    }

    /// Returns everything solid: the border, the solid rectangles and the bars.
    pub fn solids(&self) -> impl Iterator<Item = Outline> + '_ {
        let walls = self.walls().into_iter();
        let bars = self.bars.all().iter().copied().map(Outline::Bar);
        walls.chain(self.solid_rectangles()).chain(bars)
    }

    /// Returns the solids within reach of a point, and some out of reach.
    pub fn solids_near(&self, point: Vec2, reach_m: f32) -> impl Iterator<Item = Outline> + '_ {
        let bars = self.bars.near(point, reach_m);
        let bars = bars.map(|(_, bar)| Outline::Bar(bar));
        self.fixed_solids_near(point, reach_m).chain(bars)
    }

    /// Returns the same as [`Space::solids_near`], without the bars, which bodies can push.
    pub fn fixed_solids_near(
        &self,
        point: Vec2,
        reach_m: f32,
    ) -> impl Iterator<Item = Outline> + '_ {
        let walls = self.walls_near(point, reach_m);
        walls.chain(self.solid_rectangles())
    }

    /// Checks whether a solid rectangle lies on the straight line between two places.
    pub fn is_blocked(&self, from: Vec2, to: Vec2) -> bool {
        let way = to - from;
        let Some(direction) = way.try_normalize() else {
            return false;
        };
        self.solid_rectangles()
            .any(|solid| solid.cast_ray(from, direction, way.length(), 0.0).is_some())
    }

    fn solid_rectangles(&self) -> impl Iterator<Item = Outline> + '_ {
        let rectangles = self.rectangles.iter();
        let solid = rectangles.filter(|rectangle| rectangle.penetrability.is_solid());
        solid.map(Component::outline)
    }

    /// Checks whether a disc fits at a place with `clearance_m` to everything solid.
    pub fn fits(&self, center: Vec2, radius_m: f32, clearance_m: f32) -> bool {
        self.solids()
            .all(|solid| solid.surface(center).0 >= radius_m + clearance_m)
    }

    /// Checks the same as [`Floor::can_be_worked_on`](super::Floor::can_be_worked_on).
    pub fn can_be_worked_on(&self, place: Vec2, reach_m: f32, body: &Body) -> bool {
        if self.fits(place, body.radius_m, -ROUNDING_M) {
            return true;
        }
        let step_m = RING_M.min(reach_m / 10.0);
        let farthest_m = reach_m.min(self.room.size().element_sum());
        // The factor keeps rounding from losing the last ring.
        let rings = (1.001 * farthest_m / step_m) as u32;
        self.fits(place, 0.0, -ROUNDING_M)
            && (1..=rings).any(|ring| {
                directions_around(0.0).any(|direction| {
                    let stand = place + direction * (ring as f32 * step_m);
                    self.fits(stand, body.radius_m, DRIVE_CLEARANCE_M)
                })
            })
    }

    /// Checks the same as [`Floor::can_be_gripped`](super::Floor::can_be_gripped).
    pub fn can_be_gripped(
        &self,
        item: Vec2,
        item_radius_m: f32,
        body: &Body,
        is_free: impl Fn(Vec2) -> bool,
    ) -> bool {
        let stands = |center: Vec2| self.fits(center, body.radius_m, SKIN_M) && is_free(center);
        let distances = [
            0.5 * body.radius_m,
            body.radius_m,
            body.radius_m + 0.5 * body.reach_m,
        ];
        self.fits(item, item_radius_m, 0.0)
            && (stands(item)
                || distances.into_iter().any(|distance| {
                    directions_around(0.0).any(|direction| stands(item + direction * distance))
                }))
    }
}

/// Returns unit vectors in all directions: first the heading, then alternately left and right of it.
pub fn directions_around(heading_rad: f32) -> impl Iterator<Item = Vec2> {
    (0..DIRECTIONS).map(move |index| {
        let turns = if index % 2 == 0 {
            -index / 2
        } else {
            index.midpoint(1)
        };
        let angle_rad = heading_rad + turns as f32 * (std::f32::consts::TAU / DIRECTIONS as f32);
        Vec2::from_angle(angle_rad)
    })
}

/// Returns the same as [`Floor::nearest_place`](super::Floor::nearest_place).
pub(super) fn nearest_place(
    center: Vec2,
    room: &Room,
    will_do: impl Fn(Vec2) -> bool,
) -> Option<Vec2> {
    let rings = (room.size().element_sum() / RING_M) as u32;
    let mut places = (0..=rings).flat_map(|ring| {
        directions_around(0.0).map(move |direction| center + direction * (ring as f32 * RING_M))
    });
    places.find(|place| will_do(*place))
}
