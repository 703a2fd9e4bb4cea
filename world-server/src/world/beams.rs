//! The nine beams of the collision-avoidance sensor, cast at solids or taken from the scan of a real one.

use std::f32::consts::TAU;

use glam::Vec2;
use proto::readings::{Hit, Proximity};

use super::motion::bearing;
use super::outline::RayContact;
use super::{Bar, Outline};

/// The part of a full circle that may be missing between the first and the last beam of a scan all around, rad.
const ROUNDING_RAD: f32 = 1e-3;

/// Half of the thickness of a scanned surface, m. The normal at a contact with a surface without thickness would be the
/// direction of a rounding error.
const SURFACE_M: f32 = 1e-3;

/// The body from which the beams start.
#[derive(Clone, Copy, Debug)]
pub struct BeamOrigin {
    pub center: Vec2,
    /// The unit vector of the heading.
    pub ahead: Vec2,
    pub radius_m: f32,
    /// The range of the sensor from the edge of the body, m.
    pub range_m: f32,
}

/// A planar scan around the center of a body. Angles are counter-clockwise from its heading.
#[derive(Clone, Debug, PartialEq)]
pub struct Scan {
    /// The angle of the first beam, rad.
    pub first_rad: f32,
    /// The angle between two beams, rad; below 0 for a scanner that turns to the right.
    pub step_rad: f32,
    /// The distance below which the scanner measures nothing, m.
    pub min_m: f32,
    /// The distance from which on a beam is free, m.
    pub max_m: f32,
    /// The distance of each beam from the center, m. NaN is no measurement, and negative infinity a distance below the least
    /// one.
    pub ranges_m: Vec<f32>,
}

/// Returns the reach of the beams from the center of a body, m.
pub fn beam_reach_m(radius_m: f32, range_m: f32) -> f32 {
    2.0 * radius_m + range_m
}

impl BeamOrigin {
    /// Returns the reach of the beams from the center, m. They begin at the hull.
    pub fn reach_m(&self) -> f32 {
        beam_reach_m(self.radius_m, self.range_m)
    }

    /// Writes the contacts with solids to `proximity`, whose beams are all free before.
    pub fn cast(&self, solids: impl Iterator<Item = Outline>, proximity: &mut Proximity) {
        let Self {
            center,
            ahead,
            radius_m,
            range_m,
        } = *self;
        let (left, reach_m) = (ahead.perp(), self.reach_m());
        let solids = solids.filter(|solid| !solid.is_out_of_reach(center, reach_m));

        let mut middle = None;
        // Other beams are rays from the hull: ahead from its sides, sideways from its front, center and rear.
        let ahead_from = [left * radius_m, left * -radius_m];
        let side_from = [ahead * radius_m, Vec2::ZERO, ahead * -radius_m];
        let mut ahead_stops = [None; 2];
        let mut left_stops = [None; 3];
        let mut right_stops = [None; 3];
        for solid in solids {
            middle = RayContact::nearer(middle, solid.sweep(center, radius_m, ahead, range_m));
            let cast = |stop: &mut Option<RayContact>, from: Vec2, direction: Vec2| {
                *stop = RayContact::nearer(
                    *stop,
                    solid.cast_ray(center + from, direction, radius_m + range_m, 0.0),
                );
            };
            for (stop, from) in ahead_stops.iter_mut().zip(ahead_from) {
                cast(stop, from, ahead);
            }
            for (index, from) in side_from.into_iter().enumerate() {
                cast(&mut left_stops[index], from, left);
                cast(&mut right_stops[index], from, -left);
            }
        }

        let hit = |stop: Option<RayContact>, before_edge_m: f32| {
            stop.map(|stop| Hit {
                distance_m: (stop.distance_m - before_edge_m).max(0.0),
                normal_rad: bearing(ahead, stop.normal),
            })
        };
        proximity.ahead = [
            hit(ahead_stops[0], radius_m),
            hit(middle, 0.0),
            hit(ahead_stops[1], radius_m),
        ];
        proximity.left = left_stops.map(|stop| hit(stop, radius_m));
        proximity.right = right_stops.map(|stop| hit(stop, radius_m));
    }
}

impl Scan {
    /// Returns the reading of collision avoidance of a body with this radius, for which the scan stands. The sensor's range
    /// `range_m` counts from the edge of the body. Directions without a measurement are free.
    #[must_use]
    pub fn proximity(&self, radius_m: f32, range_m: f32) -> Proximity {
        let origin = BeamOrigin {
            center: Vec2::ZERO,
            ahead: Vec2::X,
            radius_m,
            range_m,
        };
        let mut proximity = Proximity::default();
        origin.cast(self.surfaces(radius_m).into_iter(), &mut proximity);
        proximity
    }

    /// Returns the measured surfaces. Two neighboring ends of beams belong to one surface if a body with this radius does not
    /// fit between them. Any other end is a disc as wide as its beam.
    fn surfaces(&self, radius_m: f32) -> Vec<Outline> {
        let count = self.ranges_m.len();
        let ends: Vec<Option<Vec2>> = (0..count).map(|beam| self.end(beam)).collect();
        let is_closed = count > 2 && self.step_rad.abs() * count as f32 >= TAU - ROUNDING_RAD;
        // The bar from the end of each beam to that of the next one.
        let bars = (0..count).map(|beam| {
            let next = (beam + 1) % count;
            let (from, to) = (ends[beam]?, ends[next]?);
            let is_one = (next > 0 || is_closed) && from.distance(to) < 2.0 * radius_m;
            let half_width_m = SURFACE_M;
            is_one.then_some(Bar {
                from,
                to,
                half_width_m,
            })
        });
        let bars: Vec<Option<Bar>> = bars.collect();
        let discs = (0..count).filter_map(|beam| {
            let is_single = bars[beam].is_none() && bars[(beam + count - 1) % count].is_none();
            let center = ends[beam].filter(|_| is_single)?;
            let radius_m = center.length() * self.step_rad.abs() / 2.0;
            Some(Outline::Disc { center, radius_m })
        });
        let bars = bars.iter().flatten().copied().map(Outline::Bar);
        discs.chain(bars).collect()
    }

    /// Returns the place at which a beam ends at a surface.
    fn end(&self, beam: usize) -> Option<Vec2> {
        let range_m = match self.ranges_m[beam] {
            f32::NEG_INFINITY => self.min_m,
            range_m => range_m,
        };
        // A comparison with NaN is false.
        let is_measured = range_m >= self.min_m && range_m < self.max_m;
        let angle = self.first_rad + self.step_rad * beam as f32;
        is_measured.then(|| range_m * Vec2::from_angle(angle))
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{FRAC_PI_2, PI};

    use glam::Vec2;

    use super::*;
    use crate::world::wrap_angle;

    const RADIUS_M: f32 = 0.2;
    const RANGE_M: f32 = 0.4;
    const BEAMS: usize = 360;

    /// Returns the scan that an ideal scanner measures among solids in the frame of the body.
    fn scan_of(solids: &[Outline], beams: usize, field_rad: f32) -> Scan {
        let (first_rad, step_rad) = (-field_rad / 2.0, field_rad / beams as f32);
        let range = |beam: usize| {
            let angle = first_rad + step_rad * beam as f32;
            let direction = Vec2::new(angle.cos(), angle.sin());
            let stops = solids
                .iter()
                .map(|solid| solid.cast_ray(Vec2::ZERO, direction, 10.0, 0.0));
            let stop = stops.fold(None, RayContact::nearer);
            stop.map_or(f32::INFINITY, |stop| stop.distance_m)
        };
        Scan {
            first_rad,
            step_rad,
            min_m: 0.05,
            max_m: 10.0,
            ranges_m: (0..beams).map(range).collect(),
        }
    }

    fn cast(solids: &[Outline]) -> Proximity {
        let origin = BeamOrigin {
            center: Vec2::ZERO,
            ahead: Vec2::X,
            radius_m: RADIUS_M,
            range_m: RANGE_M,
        };
        let mut proximity = Proximity::default();
        origin.cast(solids.iter().copied(), &mut proximity);
        proximity
    }

    fn beams(proximity: &Proximity) -> Vec<Option<Hit>> {
        [proximity.ahead, proximity.left, proximity.right].concat()
    }

    fn wall(angle: f32, distance_m: f32) -> Outline {
        Outline::Wall {
            normal: -Vec2::new(angle.cos(), angle.sin()),
            offset_m: -distance_m,
        }
    }

    #[test]
    fn a_scan_gives_the_reading_of_the_scanned_solids() {
        let disc = |x, y, radius_m| Outline::Disc {
            center: Vec2::new(x, y),
            radius_m,
        };
        let rectangle = |x, y, width, height| Outline::Rectangle {
            min: Vec2::new(x, y),
            max: Vec2::new(x + width, y + height),
        };
        for solids in [
            vec![],
            vec![wall(0.0, 0.5)],
            vec![wall(0.3, 0.4), wall(FRAC_PI_2, 0.3), wall(-1.7, 0.35)],
            vec![wall(PI, 0.3)],
            vec![disc(0.5, 0.1, 0.15)],
            vec![rectangle(0.35, -0.05, 0.3, 0.8)],
            vec![disc(-0.1, 0.45, 0.2), rectangle(-0.3, -0.6, 0.6, 0.3)],
        ] {
            let expected = cast(&solids);
            let found = scan_of(&solids, BEAMS, TAU).proximity(RADIUS_M, RANGE_M);
            for (found, expected) in beams(&found).into_iter().zip(beams(&expected)) {
                match (found, expected) {
                    (Some(found), Some(expected)) => {
                        assert!(
                            (found.distance_m - expected.distance_m).abs() < 0.01,
                            "{solids:?}: {found:?} instead of {expected:?}"
                        );
                        let turn_rad = wrap_angle(found.normal_rad - expected.normal_rad);
                        assert!(
                            turn_rad.abs() < 0.1,
                            "{solids:?}: {found:?} instead of {expected:?}"
                        );
                    }
                    (found, expected) => assert_eq!(found, expected, "{solids:?}"),
                }
            }
        }
    }

    #[test]
    fn outer_beams_count_from_the_line_that_touches_the_body_and_a_stop_is_1_mm_before_a_solid() {
        let assert_ahead = |solid: Outline, index: usize, expected_m: f32| {
            let hit = cast(&[solid]).ahead[index].unwrap();
            let error_m = (hit.distance_m - expected_m).abs();
            assert!(error_m < 1e-4, "{hit:?} instead of {expected_m}");
        };
        for (index, expected_m) in [(0, 0.3), (1, 0.299), (2, 0.3)] {
            assert_ahead(wall(0.0, 0.5), index, expected_m);
        }
        // The edge of the body at the left beam is 0.49 m away.
        let post = Outline::Disc {
            center: Vec2::new(0.5, RADIUS_M),
            radius_m: 0.01,
        };
        assert_ahead(post, 0, 0.29);
    }

    #[test]
    fn a_gap_for_the_body_stays_free_and_a_smaller_one_does_not() {
        let ahead = |half_gap_m: f32| {
            let posts = [-half_gap_m, half_gap_m].map(|y| Outline::Disc {
                center: Vec2::new(0.4, y),
                radius_m: 0.01,
            });
            let scan = scan_of(&posts, BEAMS, TAU);
            scan.proximity(RADIUS_M, RANGE_M).ahead[1]
        };
        let hit = ahead(0.18).unwrap();
        assert!((hit.distance_m - 0.31).abs() < 0.03, "{hit:?}");
        assert_eq!(ahead(0.25), None);
    }

    #[test]
    fn values_that_are_no_distances_are_free_and_a_contact_is_not() {
        let scan = |range_m: f32| Scan {
            first_rad: 0.0,
            step_rad: 0.01,
            min_m: 0.25,
            max_m: 0.55,
            ranges_m: vec![range_m; 3],
        };
        let ahead = |range_m| scan(range_m).proximity(RADIUS_M, RANGE_M).ahead[1];
        for free in [f32::NAN, f32::INFINITY, 0.1, 0.55, -1.0] {
            assert_eq!(ahead(free), None, "{free}");
        }
        let near = |range_m| ahead(range_m).unwrap().distance_m;
        assert!((near(0.5) - 0.3).abs() < 0.01);
        // The surface is too near to be measured.
        assert!((near(f32::NEG_INFINITY) - 0.05).abs() < 0.01);
    }

    #[test]
    fn a_full_circle_is_closed_at_its_first_beam() {
        // A post behind the body, at the seam of the scan. Only the two beams at the seam hit it.
        let mut scan = scan_of(&[], 90, TAU);
        scan.ranges_m[0] = 0.3;
        scan.ranges_m[89] = 0.3;
        assert_eq!(scan.surfaces(RADIUS_M).len(), 1);
        scan.step_rad /= 2.0;
        assert_eq!(scan.surfaces(RADIUS_M).len(), 2);
        let empty = Scan {
            ranges_m: Vec::new(),
            ..scan
        };
        assert_eq!(empty.proximity(RADIUS_M, RANGE_M), Proximity::default());
    }
}
