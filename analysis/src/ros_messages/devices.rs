//! Readings of the robots' own sensors, faulty ones included. A dead sensor publishes nothing.

use std::f32::consts::FRAC_PI_2;

use proto::control::AgentState;
use proto::readings::{Pose as PoseReading, Proximity, Readings};
use proto::view::View;
use ros::Qos;
use ros::messages::{
    Covariance, LaserScan, Odometry, PointCloud2, PointField, PoseWithCovariance, Twist,
    TwistWithCovariance,
};
use scenario::time::SimTime;
use scenario::{Robot, Sensors, Setup};

use super::convert::{MAP_FRAME, beam_frame, body_frame, header, point, pose};
use super::destination::{Destination, Topic};
use crate::export::look::{beam_ends, point_bytes};

/// The variance of each velocity of `/NAME/odom`, (m/s)² and (rad/s)². The position sensor measures no velocity, and a
/// large variance means that the zeros are no measurement.
const UNKNOWN: f64 = 1e6;

/// The topics `/NAME/odom`, `/NAME/scan`, `/NAME/border` and `/NAME/avoidance` of all robots, by rank.
pub struct DeviceTopics(Vec<RobotDevices>);

/// The same topics of one robot.
pub struct RobotDevices {
    /// The name of the robot in ROS.
    name: String,
    sensors: Sensors,
    radius_m: f32,
    step: SimTime,
    has_side_sensor: bool,
    odom: Topic<Odometry>,
    scan: Topic<LaserScan>,
    border: Topic<LaserScan>,
    avoidance: Topic<PointCloud2>,
}

impl DeviceTopics {
    pub fn new(to: &mut dyn Destination, setup: &Setup, names: &[String]) -> anyhow::Result<Self> {
        let robots = setup.scenario.robots.iter().zip(names);
        let topics = robots.map(|(robot, name)| RobotDevices::new(to, setup, robot, name));
        topics.collect::<anyhow::Result<_>>().map(Self)
    }

    /// Writes the readings in a view, which were measured at the time `at`.
    pub fn write(&self, to: &mut dyn Destination, at: SimTime, view: &View) -> anyhow::Result<()> {
        for (robot, shown) in self.0.iter().zip(&view.robots) {
            // Other robots have readings from an earlier time.
            if shown.state == AgentState::Present {
                robot.write(to, at, &shown.readings)?;
            }
        }
        Ok(())
    }
}

impl RobotDevices {
    /// Adds the topics of a robot, which has the name `name` in ROS.
    pub fn new(
        to: &mut dyn Destination,
        setup: &Setup,
        robot: &Robot,
        name: &str,
    ) -> anyhow::Result<Self> {
        let scenario = &setup.scenario;
        Ok(Self {
            name: name.to_owned(),
            sensors: scenario.sensors,
            radius_m: scenario.body.radius_m,
            step: SimTime(scenario.step_ms),
            has_side_sensor: robot.has_device(Robot::SIDE_BORDER),
            odom: to.topic(format!("/{name}/odom"), Qos::Stream)?,
            scan: to.topic(format!("/{name}/scan"), Qos::Stream)?,
            border: to.topic(format!("/{name}/border"), Qos::Stream)?,
            avoidance: to.topic(format!("/{name}/avoidance"), Qos::Stream)?,
        })
    }

    /// Writes the readings that were measured at the time `at`.
    pub fn write(
        &self,
        to: &mut dyn Destination,
        at: SimTime,
        readings: &Readings,
    ) -> anyhow::Result<()> {
        if let Some(measured) = &readings.pose {
            to.write(&self.odom, at, &odometry(at, &self.name, measured))?;
        }
        if let Some(proximity) = &readings.proximity {
            let range_m = self.sensors.avoidance_range_m;
            let scan = self.scan(at, range_m, center_beams(proximity));
            to.write(&self.scan, at, &scan)?;
            let points = beam_ends(proximity, self.radius_m);
            let header = header(at, beam_frame(&self.name));
            let bytes = point_bytes(&points);
            let cloud = cloud(points.len() as u32, bytes);
            to.write(&self.avoidance, at, &PointCloud2 { header, ..cloud })?;
        }
        let border = [readings.front_border, readings.side_border];
        if border.iter().any(Option::is_some) {
            let range_m = self.sensors.border_range_m;
            let beams = border.into_iter().zip([0.0, FRAC_PI_2]);
            let beams: Vec<Beam> = beams
                .take(if self.has_side_sensor { 2 } else { 1 })
                .map(|(reading, angle_rad)| Beam { angle_rad, reading })
                .collect();
            let scan = self.scan(at, range_m, beams);
            to.write(&self.border, at, &scan)?;
        }
        Ok(())
    }

    /// Returns a scan of beams at equal angles. Distances are from the center of the body, and ranges of sensors from its
    /// edge.
    fn scan(&self, at: SimTime, range_m: f32, beams: impl IntoIterator<Item = Beam>) -> LaserScan {
        let beams: Vec<Beam> = beams.into_iter().collect();
        let angle = |beam: Option<&Beam>| beam.map_or(0.0, |beam| beam.angle_rad);
        let (first, last) = (angle(beams.first()), angle(beams.last()));
        LaserScan {
            header: header(at, beam_frame(&self.name)),
            angle_min: first,
            angle_max: last,
            angle_increment: if beams.len() > 1 { FRAC_PI_2 } else { 0.0 },
            time_increment: 0.0,
            scan_time: self.step.as_secs_f64() as f32,
            range_min: self.radius_m,
            range_max: self.radius_m + range_m,
            ranges: beams
                .iter()
                .map(|beam| match beam.reading {
                    None => f32::NAN,
                    Some(None) => f32::INFINITY,
                    Some(Some(distance_m)) => self.radius_m + distance_m,
                })
                .collect(),
            intensities: Vec::new(),
        }
    }
}

/// A beam from the center of the body.
struct Beam {
    angle_rad: f32,
    /// The distance from the edge of the body, m: `Some(None)` beyond the range, `None` without a working device.
    reading: Option<Option<f32>>,
}

/// Returns the beams of collision avoidance that begin at the center: right, ahead, left.
fn center_beams(proximity: &Proximity) -> [Beam; 3] {
    let [_, ahead, _] = proximity.ahead;
    let [_, left, _] = proximity.left;
    let [_, right, _] = proximity.right;
    [(-FRAC_PI_2, right), (0.0, ahead), (FRAC_PI_2, left)].map(|(angle_rad, hit)| Beam {
        angle_rad,
        reading: Some(hit.map(|hit| hit.distance_m)),
    })
}

fn odometry(at: SimTime, name: &str, measured: &PoseReading) -> Odometry {
    let position = measured.position;
    Odometry {
        header: header(at, MAP_FRAME),
        child_frame_id: body_frame(name),
        pose: PoseWithCovariance {
            pose: pose(point(position.x, position.y, 0.0), measured.heading_rad),
            covariance: Covariance::default(),
        },
        twist: TwistWithCovariance {
            twist: Twist::default(),
            covariance: Covariance::diagonal(UNKNOWN),
        },
    }
}

/// Creates a cloud without a header from points of three numbers of single precision.
fn cloud(points: u32, data: Vec<u8>) -> PointCloud2 {
    const NUMBER: u32 = 4;
    let fields = ["x", "y", "z"].into_iter().zip(0..);
    let fields: Vec<PointField> = fields
        .map(|(name, index)| PointField {
            name: name.to_owned(),
            offset: index * NUMBER,
            datatype: PointField::FLOAT32,
            count: 1,
        })
        .collect();
    let point_step = fields.len() as u32 * NUMBER;
    PointCloud2 {
        height: 1,
        width: points,
        fields,
        is_bigendian: false,
        point_step,
        row_step: points * point_step,
        data,
        is_dense: true,
        ..PointCloud2::default()
    }
}

#[cfg(test)]
mod tests {
    use proto::readings::Hit;

    use super::*;

    #[test]
    fn a_scan_contains_the_beams_from_the_center() {
        let hit = |distance_m| {
            Some(Hit {
                distance_m,
                normal_rad: 0.0,
            })
        };
        let proximity = Proximity {
            ahead: [hit(9.0), hit(0.25), hit(9.0)],
            left: [hit(9.0), None, hit(9.0)],
            right: [None, hit(0.5), None],
        };
        let beams = center_beams(&proximity).map(|beam| (beam.angle_rad, beam.reading));
        let expected = [
            (-FRAC_PI_2, Some(Some(0.5))),
            (0.0, Some(Some(0.25))),
            (FRAC_PI_2, Some(None)),
        ];
        assert_eq!(beams, expected);
    }

    #[test]
    fn a_cloud_states_its_sizes() {
        let cloud = cloud(2, vec![0; 24]);
        assert_eq!((cloud.point_step, cloud.row_step), (12, 24));
        assert_eq!(cloud.fields[2].offset, 8);
    }
}
