//! Readings of the range sensors: distances from a robot to obstacles.

use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{LaserScan, PackedElementField, PointCloud};
use glam::Vec2;
use proto::control::AgentState;
use proto::readings::{Hit, Proximity, Readings};
use proto::view::View;
use scenario::Setup;
use scenario::time::SimTime;
use std::f64::consts::FRAC_PI_2;

use super::recording::{Channel, Message, Recording};
use super::well_known::{at, stamp, vector};

/// Height of the beams, m.
const HEIGHT: f64 = 0.15;

/// The topics `/sensors/ROBOT/…` of a recording.
pub struct SensorTopics {
    radius_m: f32,
    step: SimTime,
    /// The robots' topics, by rank.
    robots: Vec<Device>,
}

struct Device {
    name: String,
    border: Channel<LaserScan>,
    avoidance: Channel<PointCloud>,
    /// For each topic, `true` if its latest message contains readings.
    shows: [bool; 2],
}

impl SensorTopics {
    /// Creates the topics in a recording.
    pub fn new(recording: &mut Recording<'_>, setup: &Setup) -> anyhow::Result<Self> {
        let robots = setup.scenario.robots.iter();
        let robots = robots
            .map(|robot| {
                let name = robot.name.clone();
                Ok(Device {
                    border: recording.channel(&format!("/sensors/{name}/border"))?,
                    avoidance: recording.channel(&format!("/sensors/{name}/avoidance"))?,
                    name,
                    shows: [false; 2],
                })
            })
            .collect::<anyhow::Result<_>>()?;
        Ok(Self {
            radius_m: setup.scenario.body.radius_m,
            step: SimTime(setup.scenario.step_ms),
            robots,
        })
    }

    /// Publishes the readings of the previous tick, at the time of that tick, because the beams start at its poses.
    pub fn see(&mut self, view: &View, seen: &mut Vec<Message>) {
        if view.tick == 0 {
            return;
        }
        let time = view.now - self.step;
        for (device, robot) in self.robots.iter_mut().zip(&view.robots) {
            // Absent robots have readings from an earlier time.
            let readings = (robot.state == AgentState::Present).then_some(&robot.readings);
            let ranges = readings.map_or([f64::NAN; 2], |readings| border(readings, self.radius_m));
            let shows = ranges.iter().any(|range| range.is_finite());
            if shows || device.shows[0] {
                let scan = scan(&device.name, time, ranges);
                seen.push(device.border.message(time, &scan));
            }
            device.shows[0] = shows;

            let proximity = readings.and_then(|readings| readings.proximity);
            let points =
                proximity.map_or_else(Vec::new, |proximity| points(&proximity, self.radius_m));
            let shows = !points.is_empty();
            if shows || device.shows[1] {
                let cloud = cloud(&device.name, time, &points);
                seen.push(device.avoidance.message(time, &cloud));
            }
            device.shows[1] = shows;
        }
    }
}

/// Returns the distances from the center of the body to the border ahead and to the left, m. They are infinite beyond
/// the range and NaN for a device without readings.
fn border(readings: &Readings, radius_m: f32) -> [f64; 2] {
    [readings.front_border, readings.side_border].map(|reading| match reading {
        None => f64::NAN,
        Some(None) => f64::INFINITY,
        Some(Some(distance_m)) => f64::from(radius_m + distance_m),
    })
}

fn scan(frame: &str, time: SimTime, ranges: [f64; 2]) -> LaserScan {
    LaserScan {
        timestamp: Some(stamp(time)),
        frame_id: frame.to_owned(),
        pose: Some(at(vector(0.0, 0.0, HEIGHT))),
        start_angle: 0.0,
        end_angle: FRAC_PI_2,
        ranges: ranges.to_vec(),
        intensities: Vec::new(),
    }
}

/// Returns the end points of the proximity beams in the robot's frame, m.
fn points(proximity: &Proximity, radius_m: f32) -> Vec<Vec2> {
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

fn cloud(frame: &str, time: SimTime, points: &[Vec2]) -> PointCloud {
    let size = size_of::<f32>();
    let fields = ["x", "y", "z"].iter().enumerate();
    let bytes: Vec<u8> = points
        .iter()
        .flat_map(|point| [point.x, point.y, 0.0])
        .flat_map(f32::to_le_bytes)
        .collect();
    PointCloud {
        timestamp: Some(stamp(time)),
        frame_id: frame.to_owned(),
        pose: Some(at(vector(0.0, 0.0, HEIGHT))),
        point_stride: 3 * size as u32,
        fields: fields
            .map(|(index, name)| PackedElementField {
                name: (*name).to_owned(),
                offset: (index * size) as u32,
                r#type: NumericType::Float32.into(),
            })
            .collect(),
        data: bytes.into(),
    }
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
    fn assert_points(proximity: Proximity, expected: &[(f32, f32)]) {
        let found = points(&proximity, 0.2);
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
        assert_points(proximity, &[(0.3, 0.2), (0.3, -0.2), (0.3, 0.0)]);
    }

    #[test]
    fn the_middle_beam_ends_where_the_body_would_touch() {
        // The corner of an object to the left of the path.
        let proximity = Proximity {
            ahead: [None, hit(0.1, -3.0 * FRAC_PI_4), None],
            ..Proximity::default()
        };
        let side = 0.2 * 0.5_f32.sqrt();
        assert_points(proximity, &[(0.1 + side, side)]);
    }

    #[test]
    fn beams_to_the_sides_begin_at_front_center_and_rear() {
        let proximity = Proximity {
            left: [hit(0.0, -PI / 2.0), None, hit(0.4, -PI / 2.0)],
            right: [None, hit(0.1, PI / 2.0), None],
            ..Proximity::default()
        };
        assert_points(proximity, &[(0.2, 0.2), (-0.2, 0.6), (0.0, -0.3)]);
        assert_points(Proximity::default(), &[]);
    }

    #[test]
    fn out_of_range_differs_from_a_missing_sensor() {
        let readings = Readings {
            front_border: Some(None),
            ..Readings::default()
        };
        let [front, side] = border(&readings, 0.2);
        assert!(front == f64::INFINITY && side.is_nan());
        let readings = Readings {
            front_border: Some(Some(0.3)),
            side_border: Some(Some(0.0)),
            ..Readings::default()
        };
        assert_eq!(
            border(&readings, 0.25),
            [0.3_f32 + 0.25, 0.25].map(f64::from)
        );
    }
}
