//! The true poses of the bodies: frames and ground truth.

use std::collections::BTreeMap;
use std::f32::consts::{PI, TAU};

use proto::control::AgentState;
use proto::view::View;
use ros::Qos;
use ros::messages::{
    Covariance, Odometry, PoseWithCovariance, TfMessage, Transform, TransformStamped, Twist,
    TwistWithCovariance, Vector3, turned,
};
use run_log::PoseRow;
use scenario::Setup;
use scenario::time::SimTime;

use super::convert::{MAP_FRAME, beam_frame, body_frame, header, point, pose};
use super::destination::{Destination, Topic};
use crate::export::look::BEAM_HEIGHT;

/// The topics `/tf`, `/tf_static` and `/NAME/ground_truth`.
pub struct BodyTopics {
    tf: Topic<TfMessage>,
    /// By the name in the log.
    robots: BTreeMap<String, RobotBody>,
}

struct RobotBody {
    /// The name in ROS.
    name: String,
    truth: Topic<Odometry>,
    /// The time and the heading of the latest message.
    latest: Option<(SimTime, f32)>,
}

/// A body at a time.
pub struct Body<'r> {
    robot: &'r str,
    /// The x coordinate of the center, m.
    x: f32,
    /// The y coordinate of the center, m.
    y: f32,
    heading_rad: f32,
    speed_m_s: f32,
}

impl<'r> Body<'r> {
    pub fn of_row(row: &'r PoseRow) -> Self {
        Self {
            robot: &row.robot,
            x: row.x_m,
            y: row.y_m,
            heading_rad: row.heading_rad,
            speed_m_s: row.speed_m_s,
        }
    }

    /// Returns the bodies in the room.
    pub fn of_view(setup: &'r Setup, view: &View) -> Vec<Self> {
        let robots = setup.scenario.robots.iter().zip(&view.robots);
        let robots = robots.filter(|(_, robot)| robot.state != AgentState::Absent);
        let bodies = robots.map(|(spec, robot)| Self {
            robot: &spec.name,
            x: robot.pose.position.x,
            y: robot.pose.position.y,
            heading_rad: robot.pose.heading_rad,
            speed_m_s: robot.speed_m_s,
        });
        bodies.collect()
    }
}

impl BodyTopics {
    /// Adds the topics, and writes the fixed frames.
    pub fn new(to: &mut dyn Destination, setup: &Setup, names: &[String]) -> anyhow::Result<Self> {
        let tf = to.topic("/tf", Qos::Stream)?;
        let mut robots = BTreeMap::new();
        for (robot, name) in setup.scenario.robots.iter().zip(names) {
            let body = RobotBody {
                name: name.clone(),
                truth: to.topic(format!("/{name}/ground_truth"), Qos::Stream)?,
                latest: None,
            };
            robots.insert(robot.name.clone(), body);
        }
        let beams = names.iter().map(|name| TransformStamped {
            header: header(SimTime::ZERO, body_frame(name)),
            child_frame_id: beam_frame(name),
            transform: Transform {
                translation: Vector3 {
                    z: BEAM_HEIGHT,
                    ..Vector3::default()
                },
                rotation: turned(0.0),
            },
        });
        let transforms = beams.collect();
        let fixed = to.topic("/tf_static", Qos::Latched)?;
        to.write(&fixed, SimTime::ZERO, &TfMessage { transforms })?;
        Ok(Self { tf, robots })
    }

    /// Writes the poses of all bodies in the room at a time.
    pub fn write(
        &mut self,
        to: &mut dyn Destination,
        now: SimTime,
        bodies: &[Body<'_>],
    ) -> anyhow::Result<()> {
        let mut transforms = Vec::new();
        for body in bodies {
            let Some(robot) = self.robots.get_mut(body.robot) else {
                continue;
            };
            transforms.push(frame(now, &robot.name, body));
            let turn_rad_s = robot.latest.map_or(0.0, |(time, heading_rad)| {
                turn_rate(body.heading_rad - heading_rad, now.since(time))
            });
            robot.latest = Some((now, body.heading_rad));
            let truth = odometry(now, &robot.name, body, turn_rad_s);
            to.write(&robot.truth, now, &truth)?;
        }
        if transforms.is_empty() {
            return Ok(());
        }
        to.write(&self.tf, now, &TfMessage { transforms })
    }
}

fn frame(now: SimTime, name: &str, body: &Body<'_>) -> TransformStamped {
    TransformStamped {
        header: header(now, MAP_FRAME),
        child_frame_id: body_frame(name),
        transform: Transform {
            translation: Vector3 {
                x: body.x.into(),
                y: body.y.into(),
                z: 0.0,
            },
            rotation: turned(body.heading_rad),
        },
    }
}

fn odometry(now: SimTime, name: &str, body: &Body<'_>, turn_rad_s: f64) -> Odometry {
    let mut twist = Twist::default();
    twist.linear.x = body.speed_m_s.into();
    twist.angular.z = turn_rad_s;
    Odometry {
        header: header(now, MAP_FRAME),
        child_frame_id: body_frame(name),
        pose: PoseWithCovariance {
            pose: pose(point(body.x, body.y, 0.0), body.heading_rad),
            covariance: Covariance::default(),
        },
        twist: TwistWithCovariance {
            twist,
            covariance: Covariance::default(),
        },
    }
}

/// Returns the turn rate of the shorter turn, rad/s, or 0 without a span.
fn turn_rate(turn_rad: f32, span: SimTime) -> f64 {
    if span == SimTime::ZERO {
        return 0.0;
    }
    let shorter = match turn_rad {
        left if left > PI => left - TAU,
        right if right <= -PI => right + TAU,
        turn_rad => turn_rad,
    };
    f64::from(shorter) / span.as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_across_the_rear_is_short() {
        let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-4, "{found}");
        near(turn_rate(0.1, SimTime(50)), 2.0);
        near(turn_rate(0.1 - TAU, SimTime(50)), 2.0);
        near(turn_rate(TAU - 0.1, SimTime(50)), -2.0);
        near(turn_rate(1.0, SimTime::ZERO), 0.0);
    }
}
