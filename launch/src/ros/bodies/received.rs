//! The poses that the other world has sent. Only those in the room are used.

use std::time::Duration;

use analysis::ros_messages::MAP_FRAME;
use ros::incoming_odometry::PlanarPose;
use scenario::Room;
use scenario::ids::RobotId;
use tokio::time::Instant;
use world_server::external_bodies::ExternalPose;

/// The largest number of robots that a message names.
const NAMES_SHOWN: usize = 3;

/// The largest part of a frame's name in a message, characters.
const FRAME_SHOWN: usize = 40;

/// The newest poses of all bodies.
pub struct ReceivedPoses {
    room: Room,
    stall_after: Duration,
    bodies: Vec<Body>,
}

struct Body {
    topic: String,
    pose: Option<ExternalPose>,
    /// `true` if the pose has not been forwarded.
    is_new: bool,
    /// The time of arrival of the pose, or the start of the bridge.
    since: Instant,
    /// The reason why the last message was refused; `None` if it was used.
    refused: Option<String>,
}

impl ReceivedPoses {
    pub fn new(topics: &[String], room: Room, stall_after: Duration, now: Instant) -> Self {
        let body = |topic: &String| Body {
            topic: topic.clone(),
            pose: None,
            is_new: false,
            since: now,
            refused: None,
        };
        Self {
            room,
            stall_after,
            bodies: topics.iter().map(body).collect(),
        }
    }

    /// Handles an odometry message of a robot. Returns the reason if it is refused, unless the previous message was refused,
    /// too.
    pub fn receive(&mut self, rank: usize, message: &[u8], now: Instant) -> Option<String> {
        let body = &mut self.bodies[rank];
        match read(rank, message, &self.room) {
            Ok(pose) => {
                body.pose = Some(pose);
                body.is_new = true;
                body.since = now;
                body.refused = None;
                None
            }
            Err(why) => {
                let is_first = body.refused.is_none();
                let line = format!("{}: {why}", body.topic);
                body.refused = Some(why);
                is_first.then_some(line)
            }
        }
    }

    /// Returns the poses since the last call.
    pub fn take_new(&mut self) -> Vec<ExternalPose> {
        let new = self.bodies.iter_mut().filter(|body| body.is_new);
        new.filter_map(|body| {
            body.is_new = false;
            body.pose
        })
        .collect()
    }

    /// Returns the topics without a usable message so far, with the reasons. Empty if there are none.
    pub fn missing(&self) -> String {
        let missing = self.bodies.iter().filter(|body| body.pose.is_none());
        list(missing)
    }

    /// Checks whether a body has sent no pose for the time after which it counts as lost.
    pub fn is_silent(&self, rank: usize, now: Instant) -> bool {
        now.duration_since(self.bodies[rank].since) > self.stall_after
    }

    /// Returns the topics of all bodies with the reasons if every body counts as lost.
    pub fn lost(&self, now: Instant) -> Option<String> {
        let all = (0..self.bodies.len()).all(|rank| self.is_silent(rank, now));
        all.then(|| list(self.bodies.iter()))
    }
}

/// Lists topics, each with the reason why its last message was refused.
fn list<'b>(bodies: impl Iterator<Item = &'b Body>) -> String {
    let mut topics: Vec<String> = bodies
        .map(|body| match &body.refused {
            Some(why) => format!("{} ({why})", body.topic),
            None => body.topic.clone(),
        })
        .collect();
    let more = topics.len().saturating_sub(NAMES_SHOWN);
    topics.truncate(NAMES_SHOWN);
    if more > 0 {
        topics.push(format!("{more} more"));
    }
    topics.join(", ")
}

fn read(rank: usize, message: &[u8], room: &Room) -> Result<ExternalPose, String> {
    let pose = PlanarPose::decode(message).map_err(|error| error.to_string())?;
    if pose.frame != MAP_FRAME {
        let frame: String = pose.frame.escape_debug().take(FRAME_SHOWN).collect();
        return Err(format!(
            "the frame is '{frame}', and must be '{MAP_FRAME}', that of the room"
        ));
    }
    let (x_m, y_m) = (pose.x_m as f32, pose.y_m as f32);
    if !room.contains([x_m, y_m].into()) {
        return Err(format!("({x_m}, {y_m}) is not in the room"));
    }
    Ok(ExternalPose {
        robot: RobotId(rank as u16),
        x_m,
        y_m,
        heading_rad: pose.heading_rad as f32,
        stamp_ns: pose.stamp_ns,
    })
}

#[cfg(test)]
mod tests {
    use ros::messages::{Header, Odometry, turned};

    use super::*;

    fn message(frame: &str, x: f64) -> Vec<u8> {
        let mut odometry = Odometry {
            header: Header {
                frame_id: frame.to_owned(),
                ..Header::default()
            },
            ..Odometry::default()
        };
        odometry.pose.pose.position.x = x;
        odometry.pose.pose.orientation = turned(0.5);
        ros::encode(&odometry)
    }

    fn received() -> (ReceivedPoses, Instant) {
        let topics = ["/blue/odom", "/gold/odom"].map(str::to_owned);
        let now = Instant::now();
        let stall_after = Duration::from_secs(5);
        let received = ReceivedPoses::new(&topics, Room::default(), stall_after, now);
        (received, now)
    }

    #[test]
    fn the_newest_pose_in_the_room_is_forwarded_once() {
        let (mut poses, now) = received();
        assert_eq!(poses.missing(), "/blue/odom, /gold/odom");
        assert_eq!(poses.receive(0, &message("map", 1.0), now), None);
        assert_eq!(poses.receive(0, &message("map", 2.0), now), None);
        let new = poses.take_new();
        assert_eq!((new.len(), new[0].robot, new[0].x_m), (1, RobotId(0), 2.0));
        assert!(poses.take_new().is_empty());
        assert_eq!(poses.missing(), "/gold/odom");
    }

    #[test]
    fn wrong_messages_are_refused_with_the_reason_once() {
        let (mut poses, now) = received();
        let first = poses.receive(1, &message("odom", 1.0), now).unwrap();
        assert_eq!(
            first,
            "/gold/odom: the frame is 'odom', and must be 'map', that of the room"
        );
        assert_eq!(poses.receive(1, &message("map", f64::NAN), now), None);
        assert_eq!(
            poses.missing(),
            "/blue/odom, /gold/odom (the pose is not finite)"
        );
        assert_eq!(poses.receive(1, &message("map", -1.0), now), None);
        assert_eq!(poses.receive(1, &message("map", 1.0), now), None);
        let again = poses.receive(1, &message("map", 13.0), now).unwrap();
        assert_eq!(again, "/gold/odom: (13, 0) is not in the room");
        assert_eq!(poses.take_new()[0].x_m, 1.0);
        assert!(poses.receive(0, b"garbage", now).is_some());
    }

    #[test]
    fn bodies_are_lost_when_none_sends() {
        let (mut poses, start) = received();
        let later = start + Duration::from_secs(6);
        poses.receive(0, &message("map", 1.0), start + Duration::from_secs(2));
        assert!(poses.is_silent(1, later) && !poses.is_silent(0, later));
        assert_eq!(poses.lost(later), None);
        let lost = poses.lost(later + Duration::from_secs(2));
        assert_eq!(lost.as_deref(), Some("/blue/odom, /gold/odom"));
    }
}
