//! Geometry of one convex solid: distance, ray cast, and the sweep of a disc.

use glam::Vec2;
use parry2d::bounding_volume::Aabb;
use parry2d::query::{Ray, RayCast};

use super::Bar;

/// The gap between a stopped body and a solid, m: a thousand times the rounding error of a coordinate in a room of 12 m.
pub const SKIN_M: f32 = 1e-3;

/// The approach to a surface, in m per m of way, below which a body moves along it: rounded headings may point slightly into
/// a wall. Such a body keeps a gap of half of [`SKIN_M`].
const GRAZE: f32 = 1e-3;

/// A convex solid on the floor, in world coordinates, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outline {
    Disc {
        center: Vec2,
        radius_m: f32,
    },
    /// A rectangle parallel to the axes.
    Rectangle {
        min: Vec2,
        max: Vec2,
    },
    /// A half-plane beyond the border: the points with `normal · p < offset_m`.
    Wall {
        /// The unit vector into the room.
        normal: Vec2,
        /// The distance of the side from the origin along the normal.
        offset_m: f32,
    },
    Bar(Bar),
}

/// The contact of a ray or a moving body with a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RayContact {
    /// The free way up to the contact, m.
    pub distance_m: f32,
    /// The outward unit normal of the surface.
    pub normal: Vec2,
}

impl RayContact {
    pub fn nearer(a: Option<Self>, b: Option<Self>) -> Option<Self> {
        match (a, b) {
            (Some(a), Some(b)) => Some(if b.distance_m < a.distance_m { b } else { a }),
            (a, b) => a.or(b),
        }
    }
}

impl Outline {
    /// Checks bounding boxes: `true` only if no point of the outline is within `reach_m`.
    pub(super) fn is_out_of_reach(&self, point: Vec2, reach_m: f32) -> bool {
        match *self {
            Self::Disc { center, radius_m } => {
                (point - center).abs().max_element() > reach_m + radius_m
            }
            Self::Rectangle { min, max } => {
                (point + reach_m).cmplt(min).any() || (point - reach_m).cmpgt(max).any()
            }
            Self::Wall { normal, offset_m } => normal.dot(point) - offset_m > reach_m,
            Self::Bar(bar) => bar.is_beyond(point, reach_m),
        }
    }

    /// Checks whether the point is inside or on the edge.
    #[must_use]
    pub fn contains(&self, point: Vec2) -> bool {
        match *self {
            Self::Rectangle { min, max } => point.cmpge(min).all() && point.cmple(max).all(),
            Self::Disc { .. } | Self::Wall { .. } | Self::Bar(_) => self.surface(point).0 <= 0.0,
        }
    }

    /// Returns the distance of a point from the surface, m, negative inside, and the outward normal there.
    #[must_use]
    pub fn surface(&self, point: Vec2) -> (f32, Vec2) {
        match *self {
            Self::Disc { center, radius_m } => {
                let offset = point - center;
                let length = offset.length();
                let normal = if length > 0.0 {
                    offset / length
                } else {
                    Vec2::X
                };
                (length - radius_m, normal)
            }
            Self::Rectangle { min, max } => {
                let offset = point - point.clamp(min, max);
                let length = offset.length();
                if length > 0.0 {
                    return (length, offset / length);
                }
                let sides = [
                    (min.x - point.x, Vec2::NEG_X),
                    (point.x - max.x, Vec2::X),
                    (min.y - point.y, Vec2::NEG_Y),
                    (point.y - max.y, Vec2::Y),
                ];
                sides.into_iter().fold(
                    sides[0],
                    |nearest, side| if side.0 > nearest.0 { side } else { nearest },
                )
            }
            Self::Wall { normal, offset_m } => (normal.dot(point) - offset_m, normal),
            Self::Bar(bar) => bar.surface(point),
        }
    }

    /// Returns the first contact of a ray with the outline grown by `margin_m`; 0 m if it starts inside. `direction` is a unit
    /// vector.
    #[inline]
    pub(super) fn cast_ray(
        &self,
        origin: Vec2,
        direction: Vec2,
        max_m: f32,
        margin_m: f32,
    ) -> Option<RayContact> {
        // Most rays pass by a disc.
        if let Self::Disc { center, radius_m } = *self
            && is_clear_of(center - origin, direction, radius_m + margin_m, max_m)
        {
            return None;
        }
        self.hit(origin, direction, max_m, margin_m)
    }

    fn hit(&self, origin: Vec2, direction: Vec2, max_m: f32, margin_m: f32) -> Option<RayContact> {
        let (distance, normal) = self.surface(origin);
        if distance <= margin_m {
            return Some(RayContact {
                distance_m: 0.0,
                normal,
            });
        }
        let ray = Ray::new(origin, direction);
        let way_m = match *self {
            Self::Disc { center, radius_m } => {
                cast_at_disc(&ray, center, radius_m + margin_m, max_m)?
            }
            Self::Rectangle { min, max } => {
                let grown = Aabb::new(min - margin_m, max + margin_m);
                let way_m = grown.cast_local_ray(&ray, max_m, true)?;
                // The corners of the grown rectangle are round. It is convex, so a ray that enters a corner square and passes the
                // corner's disc meets nothing else.
                let at = ray.point_at(way_m);
                let corner = at.clamp(min, max);
                if (at - corner).cmpne(Vec2::ZERO).all() {
                    cast_at_disc(&ray, corner, margin_m, max_m)?
                } else {
                    way_m
                }
            }
            Self::Wall { .. } => {
                let approach = -direction.dot(normal);
                let way_m = (distance - margin_m) / approach;
                (approach > 0.0 && way_m <= max_m).then_some(way_m)?
            }
            Self::Bar(bar) => bar.cast(&ray, max_m, margin_m)?,
        };
        let (_, normal) = self.surface(ray.point_at(way_m));
        Some(RayContact {
            distance_m: way_m,
            normal,
        })
    }

    /// Returns the contact at which a moving disc must stop, [`SKIN_M`] short of the outline; `None` if it can move by `max_m`.
    ///
    /// A way that does not approach a convex solid at the start never does. So a body can always leave, even from inside an
    /// obstacle that was placed on it.
    ///
    /// A ray cast at the outline grown by the disc's radius is exact. The shape cast of parry2d iterates and can miss contacts.
    pub(super) fn sweep(
        &self,
        center: Vec2,
        radius_m: f32,
        direction: Vec2,
        max_m: f32,
    ) -> Option<RayContact> {
        if self.is_out_of_reach(center, max_m + radius_m + SKIN_M) {
            return None;
        }
        let approach = -direction.dot(self.surface(center).1);
        if approach <= 0.0 {
            return None;
        }
        let skin = if approach < GRAZE {
            SKIN_M / 2.0
        } else {
            SKIN_M
        };
        self.cast_ray(center, direction, max_m, radius_m + skin)
    }

    /// Returns the part of the line `origin + t · direction` that is inside, as an interval of `t`, except for walls and bars.
    pub(super) fn chord(&self, origin: Vec2, direction: Vec2) -> Option<(f32, f32)> {
        match *self {
            Self::Disc { center, radius_m } => disc_chord(center, radius_m, origin, direction),
            Self::Rectangle { min, max } => {
                Aabb::new(min, max).clip_line_parameters(origin, direction)
            }
            Self::Wall { .. } | Self::Bar(_) => None,
        }
    }
}

/// Returns the part of the line `origin + t · direction` in a disc, as an interval of `t`. The quadratic formula would cancel
/// for distant discs, so the offset across the line is used.
fn disc_chord(center: Vec2, radius_m: f32, origin: Vec2, direction: Vec2) -> Option<(f32, f32)> {
    let offset = center - origin;
    let middle = offset.dot(direction);
    let half_squared = radius_m * radius_m - (offset - direction * middle).length_squared();
    (half_squared > 0.0).then(|| (middle - half_squared.sqrt(), middle + half_squared.sqrt()))
}

/// Checks without a square root whether a ray clearly misses a disc.
fn is_clear_of(offset: Vec2, direction: Vec2, radius_m: f32, max_m: f32) -> bool {
    const ROUNDING_M: f32 = 1e-2;
    let apart_m = radius_m + ROUNDING_M;
    let middle_m = offset.dot(direction);
    offset.perp_dot(direction).abs() > apart_m || middle_m < -apart_m || middle_m > max_m + apart_m
}

/// Returns the distance at which a ray from outside enters a disc; 0 if rounding puts its origin inside.
pub(super) fn cast_at_disc(ray: &Ray, center: Vec2, radius_m: f32, max_m: f32) -> Option<f32> {
    let (enter_m, leave_m) = disc_chord(center, radius_m, ray.origin, ray.dir)?;
    (enter_m <= max_m && leave_m > 0.0).then_some(enter_m.max(0.0))
}
