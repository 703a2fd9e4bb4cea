//! Readings of the range sensors: distances from a robot to obstacles.

use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{LaserScan, PackedElementField, PointCloud};
use glam::Vec2;
use proto::control::AgentState;
use proto::readings::Readings;
use proto::view::View;
use scenario::Setup;
use scenario::time::SimTime;
use std::f64::consts::FRAC_PI_2;

use super::topics::{Channel, Message, Topics};
use super::well_known::{at, stamp, vector};
use crate::export::look::{BEAM_HEIGHT, beam_ends, point_bytes};

/// The topics `/sensors/ROBOT/…`.
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
    /// Adds the topics to a destination.
    pub fn new(to: &mut dyn Topics, setup: &Setup) -> anyhow::Result<Self> {
        let robots = setup.scenario.robots.iter();
        let robots = robots
            .map(|robot| {
                let name = robot.name.clone();
                Ok(Device {
                    border: to.channel(&format!("/sensors/{name}/border"))?,
                    avoidance: to.channel(&format!("/sensors/{name}/avoidance"))?,
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
                proximity.map_or_else(Vec::new, |proximity| beam_ends(&proximity, self.radius_m));
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
        pose: Some(at(vector(0.0, 0.0, BEAM_HEIGHT))),
        start_angle: 0.0,
        end_angle: FRAC_PI_2,
        ranges: ranges.to_vec(),
        intensities: Vec::new(),
    }
}

fn cloud(frame: &str, time: SimTime, points: &[Vec2]) -> PointCloud {
    let size = size_of::<f32>();
    let fields = ["x", "y", "z"].iter().enumerate();
    PointCloud {
        timestamp: Some(stamp(time)),
        frame_id: frame.to_owned(),
        pose: Some(at(vector(0.0, 0.0, BEAM_HEIGHT))),
        point_stride: 3 * size as u32,
        fields: fields
            .map(|(index, name)| PackedElementField {
                name: (*name).to_owned(),
                offset: (index * size) as u32,
                r#type: NumericType::Float32.into(),
            })
            .collect(),
        data: point_bytes(points).into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
