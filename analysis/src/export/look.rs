//! The look of a run in viewers of other tools: sizes and colors of visible objects.
//!
//! The world is flat. z points up from the floor and serves only for visibility.

use glam::Vec2;
use plotters::style::RGBColor;
use proto::control::AgentState;
use proto::readings::{Hit, Proximity};
use proto::view::{Mark, MarkRole, RobotView};
use scenario::{Obstacle, Setup};
use world_server::world::Penetrability;

pub const FLOOR: RGBColor = RGBColor(246, 246, 244);
pub const BORDER: RGBColor = RGBColor(60, 60, 60);
const SOLID: RGBColor = RGBColor(130, 130, 130);
const SLOW: RGBColor = RGBColor(150, 110, 60);
const FAST: RGBColor = RGBColor(90, 170, 220);

/// Height of walls and robots, m.
pub const HEIGHT: f64 = 0.3;
/// Height of the beams of sensors, m.
pub const BEAM_HEIGHT: f64 = 0.15;
/// Thickness of flat objects on the floor, m.
pub const FLAT: f64 = 0.01;
/// Thickness of a line, m.
pub const THIN: f32 = 0.04;
/// Size of letters, m.
pub const LETTERS: f64 = 0.22;
/// Height of a robot's letters, m.
pub const ROBOT_LETTERS_HEIGHT: f64 = HEIGHT + 1.5 * LETTERS;
/// Thickness of the border, m.
const WALL: f64 = 0.05;

/// A rectangle on the floor: center and size, m.
pub struct Slab {
    pub center: (f64, f64),
    pub size: (f64, f64),
}

/// Returns the four walls of the border. They lie outside, so that a robot at the border touches them.
pub fn border(setup: &Setup) -> [Slab; 4] {
    let room = &setup.scenario.room;
    let (width, height) = (f64::from(room.width_m), f64::from(room.height_m));
    let (left, bottom) = (f64::from(room.x_m), f64::from(room.y_m));
    let outside = WALL / 2.0;
    let along = (width + 2.0 * WALL, WALL);
    let across = (WALL, height);
    [
        ((width / 2.0, -outside), along),
        ((width / 2.0, height + outside), along),
        ((-outside, height / 2.0), across),
        ((width + outside, height / 2.0), across),
    ]
    .map(|((x, y), size)| Slab {
        center: (left + x, bottom + y),
        size,
    })
}

/// Returns the color, the opacity and the height, m, of a rectangle on the floor: a block, or a patch that robots can
/// cross.
pub fn of_obstacle(obstacle: &Obstacle) -> (RGBColor, f64, f64) {
    match obstacle.penetrability {
        _ if Penetrability(obstacle.penetrability).is_solid() => (SOLID, 1.0, HEIGHT),
        slow if slow < 1.0 => (SLOW, 0.5, 2.0 * FLAT),
        _ => (FAST, 0.5, 2.0 * FLAT),
    }
}

/// Returns the opacity of a mark. A range is transparent, so that it hides nothing.
pub fn mark_opacity(mark: &Mark) -> f64 {
    if mark.role == MarkRole::Range {
        0.3
    } else {
        1.0
    }
}

/// Returns the opacity of a robot. A robot that does not take part is pale.
pub fn robot_opacity(robot: &RobotView) -> f64 {
    if robot.state == AgentState::Present {
        1.0
    } else {
        0.4
    }
}

/// Returns the activity of a robot in words: its behavior set, `idle`, or the state of its agent.
pub fn activity<'s>(setup: &'s Setup, robot: &RobotView) -> &'s str {
    match robot.active {
        _ if robot.state != AgentState::Present => robot.state.as_str(),
        Some(set) => setup.catalog.behavior_name(set),
        None => "idle",
    }
}

/// Returns the end points of the beams of collision avoidance in the robot's frame, m.
pub fn beam_ends(proximity: &Proximity, radius_m: f32) -> Vec<Vec2> {
    let [left, middle, right] = proximity.ahead;
    let mut points = Vec::new();
    let mut beam = |hit: Option<Hit>, from: Vec2, direction: Vec2| {
        points.extend(hit.map(|hit| from + direction * (radius_m + hit.distance_m)));
    };
    beam(left, Vec2::Y * radius_m, Vec2::X);
    beam(right, Vec2::NEG_Y * radius_m, Vec2::X);
    let from = [Vec2::X * radius_m, Vec2::ZERO, Vec2::NEG_X * radius_m];
    for (sides, direction) in [(proximity.left, Vec2::Y), (proximity.right, Vec2::NEG_Y)] {
        for (hit, from) in sides.into_iter().zip(from) {
            beam(hit, from, direction);
        }
    }
    // The middle beam is as wide as the body. It ends where the body, moved ahead, would touch.
    points.extend(
        middle.map(|hit| Vec2::X * hit.distance_m - Vec2::from_angle(hit.normal_rad) * radius_m),
    );
    points
}

/// Returns points on the floor as bytes: x, y and z in single precision.
pub fn point_bytes(points: &[Vec2]) -> Vec<u8> {
    let numbers = points.iter().flat_map(|point| [point.x, point.y, 0.0]);
    numbers.flat_map(f32::to_le_bytes).collect()
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{FRAC_PI_4, PI};

    use super::*;

    fn hit(distance_m: f32, normal_rad: f32) -> Option<Hit> {
        Some(Hit {
            distance_m,
            normal_rad,
        })
    }

    #[track_caller]
    fn assert_ends(proximity: Proximity, expected: &[(f32, f32)]) {
        let found = beam_ends(&proximity, 0.2);
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for (found, (x, y)) in found.iter().zip(expected) {
            let expected = Vec2::new(*x, *y);
            assert!(
                found.abs_diff_eq(expected, 1e-6),
                "{found} is not {expected}"
            );
        }
    }

    #[test]
    fn a_wall_across_the_way_is_met_at_the_same_distance_by_all_beams() {
        let wall = hit(0.1, PI);
        let proximity = Proximity {
            ahead: [wall; 3],
            ..Proximity::default()
        };
        assert_ends(proximity, &[(0.3, 0.2), (0.3, -0.2), (0.3, 0.0)]);
    }

    #[test]
    fn the_middle_beam_ends_where_the_body_would_touch() {
        // The corner of an object to the left of the path.
        let proximity = Proximity {
            ahead: [None, hit(0.1, -3.0 * FRAC_PI_4), None],
            ..Proximity::default()
        };
        let side = 0.2 * 0.5_f32.sqrt();
        assert_ends(proximity, &[(0.1 + side, side)]);
    }

    #[test]
    fn beams_to_the_sides_begin_at_front_center_and_rear() {
        let proximity = Proximity {
            left: [hit(0.0, -PI / 2.0), None, hit(0.4, -PI / 2.0)],
            right: [None, hit(0.1, PI / 2.0), None],
            ..Proximity::default()
        };
        assert_ends(proximity, &[(0.2, 0.2), (-0.2, 0.6), (0.0, -0.3)]);
        assert_ends(Proximity::default(), &[]);
    }
}
