//! The poses and scans that the other world has sent. Only poses in the room are used.

use std::time::Duration;

use analysis::ros_messages::MAP_FRAME;
use ros::incoming_odometry::PlanarPose;
use ros::incoming_scan::decode_scan;
use ros::messages::Time;
use scenario::Room;
use scenario::ids::RobotId;
use tokio::time::Instant;
use world_server::external_bodies::{BridgeMessage, ExternalPose, ExternalScan};
use world_server::world::Scan;

use super::BodySpec;

/// The largest number of robots that a message names.
const NAMES_SHOWN: usize = 3;

/// The largest part of a frame's name in a message, characters.
const FRAME_SHOWN: usize = 40;

/// The newest poses and scans of all bodies.
pub struct Received {
    spec: BodySpec,
    stall_after: Duration,
    bodies: Vec<Body>,
}

struct Body {
    odometry: Source<ExternalPose>,
    scan: Source<ExternalScan>,
}

/// A topic of a body.
struct Source<M> {
    topic: String,
    newest: Option<M>,
    /// `true` if the message has not been forwarded.
    is_new: bool,
    /// The time of arrival of the message, or the start of the bridge.
    since: Instant,
    /// The reason why the last message was refused; `None` if it was used.
    refused: Option<String>,
}

impl<M: Copy> Source<M> {
    fn new(topic: String, now: Instant) -> Self {
        Self {
            topic,
            newest: None,
            is_new: false,
            since: now,
            refused: None,
        }
    }

    /// Stores a message. Returns the reason if it is refused, unless the previous message was refused, too.
    fn store(&mut self, message: Result<M, String>, now: Instant) -> Option<String> {
        match message {
            Ok(message) => {
                self.newest = Some(message);
                self.is_new = true;
                self.since = now;
                self.refused = None;
                None
            }
            Err(why) => {
                let is_first = self.refused.is_none();
                let line = format!("{}: {why}", self.topic);
                self.refused = Some(why);
                is_first.then_some(line)
            }
        }
    }

    /// Returns the message if it has arrived since the last call.
    fn take_new(&mut self) -> Option<M> {
        self.newest.filter(|_| std::mem::take(&mut self.is_new))
    }
}

impl Received {
    /// Creates the state before the first message of the robots with these ROS names.
    pub fn new(robots: &[String], spec: BodySpec, stall_after: Duration, now: Instant) -> Self {
        let body = |robot: &String| Body {
            odometry: Source::new(format!("/{robot}/odom"), now),
            scan: Source::new(format!("/{robot}/scan"), now),
        };
        Self {
            spec,
            stall_after,
            bodies: robots.iter().map(body).collect(),
        }
    }

    /// Handles an odometry message of a robot. Returns the reason if it is refused, unless the previous message was refused,
    /// too.
    pub fn receive_pose(&mut self, rank: usize, message: &[u8], now: Instant) -> Option<String> {
        let pose = read_pose(rank, message, &self.spec.room);
        self.bodies[rank].odometry.store(pose, now)
    }

    /// Handles a scan of a robot in the same way.
    pub fn receive_scan(&mut self, rank: usize, message: &[u8], now: Instant) -> Option<String> {
        let scan = read_scan(rank, message, &self.spec);
        self.bodies[rank].scan.store(scan, now)
    }

    /// Returns the poses and scans since the last call.
    pub fn take_new(&mut self) -> Vec<BridgeMessage> {
        let messages = self.bodies.iter_mut().flat_map(|body| {
            let pose = body.odometry.take_new().map(BridgeMessage::Pose);
            let scan = body.scan.take_new().map(BridgeMessage::Scan);
            [pose, scan]
        });
        messages.flatten().collect()
    }

    /// Returns the topics without a usable pose so far, with the reasons. Empty if there are none.
    pub fn missing(&self) -> String {
        let sources = self.bodies.iter().map(|body| &body.odometry);
        list(sources.filter(|source| source.newest.is_none()))
    }

    /// Checks whether a body has sent no pose for the time after which it counts as lost, or no more scans.
    pub fn is_silent(&self, rank: usize, now: Instant) -> bool {
        let scan = &self.bodies[rank].scan;
        let is_blind = scan.newest.is_some() && self.is_over(scan.since, now);
        is_blind || self.is_over(self.bodies[rank].odometry.since, now)
    }

    /// Returns the topics of all poses with the reasons if every body counts as lost.
    pub fn lost(&self, now: Instant) -> Option<String> {
        let mut sources = self.bodies.iter().map(|body| &body.odometry);
        let all = sources.all(|source| self.is_over(source.since, now));
        all.then(|| list(self.bodies.iter().map(|body| &body.odometry)))
    }

    fn is_over(&self, since: Instant, now: Instant) -> bool {
        now.duration_since(since) > self.stall_after
    }
}

/// Lists topics, each with the reason why its last message was refused.
fn list<'s, M: 's>(sources: impl Iterator<Item = &'s Source<M>>) -> String {
    let mut topics: Vec<String> = sources
        .map(|source| match &source.refused {
            Some(why) => format!("{} ({why})", source.topic),
            None => source.topic.clone(),
        })
        .collect();
    let more = topics.len().saturating_sub(NAMES_SHOWN);
    topics.truncate(NAMES_SHOWN);
    if more > 0 {
        topics.push(format!("{more} more"));
    }
    topics.join(", ")
}

fn read_pose(rank: usize, message: &[u8], room: &Room) -> Result<ExternalPose, String> {
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
        robot: RobotId(rank as u32),
        x_m,
        y_m,
        heading_rad: pose.heading_rad as f32,
        stamp_ns: pose.stamp_ns,
    })
}

/// Reads a scan as the reading of collision avoidance. The scanner is at the center of the body, and its angle 0 is ahead,
/// so the frame has no meaning.
fn read_scan(rank: usize, message: &[u8], spec: &BodySpec) -> Result<ExternalScan, String> {
    let scan = decode_scan(message).map_err(|error| error.to_string())?;
    let Time { sec, nanosec } = scan.header.stamp;
    let measured = Scan {
        first_rad: scan.angle_min,
        step_rad: scan.angle_increment,
        min_m: scan.range_min,
        max_m: scan.range_max,
        ranges_m: scan.ranges,
    };
    Ok(ExternalScan {
        robot: RobotId(rank as u32),
        beams: measured.proximity(spec.radius_m, spec.avoidance_range_m),
        stamp_ns: i64::from(sec) * 1_000_000_000 + i64::from(nanosec),
    })
}

#[cfg(test)]
mod tests {
    use ros::messages::{Header, LaserScan, Odometry, turned};

    use super::*;

    const STALL_AFTER: Duration = Duration::from_secs(5);

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

    fn scan(range_m: f32) -> Vec<u8> {
        ros::encode(&LaserScan {
            angle_min: -0.1,
            angle_increment: 0.1,
            range_min: 0.05,
            range_max: 3.0,
            ranges: vec![range_m; 3],
            ..LaserScan::default()
        })
    }

    fn received() -> (Received, Instant) {
        let robots = ["blue", "gold"].map(str::to_owned);
        let now = Instant::now();
        let spec = BodySpec {
            room: Room::default(),
            radius_m: 0.2,
            avoidance_range_m: 0.4,
        };
        (Received::new(&robots, spec, STALL_AFTER, now), now)
    }

    fn x_m(message: &BridgeMessage) -> f32 {
        match message {
            BridgeMessage::Pose(pose) => pose.x_m,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_newest_pose_in_the_room_is_forwarded_once() {
        let (mut received, now) = received();
        assert_eq!(received.missing(), "/blue/odom, /gold/odom");
        assert_eq!(received.receive_pose(0, &message("map", 1.0), now), None);
        assert_eq!(received.receive_pose(0, &message("map", 2.0), now), None);
        let new = received.take_new();
        assert_eq!((new.len(), x_m(&new[0])), (1, 2.0));
        assert!(received.take_new().is_empty());
        assert_eq!(received.missing(), "/gold/odom");
    }

    #[test]
    fn wrong_messages_are_refused_with_the_reason_once() {
        let (mut received, now) = received();
        let mut receive = |message: &[u8]| received.receive_pose(1, message, now);
        let first = receive(&message("odom", 1.0)).unwrap();
        assert_eq!(
            first,
            "/gold/odom: the frame is 'odom', and must be 'map', that of the room"
        );
        assert_eq!(receive(&message("map", f64::NAN)), None);
        assert_eq!(
            received.missing(),
            "/blue/odom, /gold/odom (the pose is not finite)"
        );
        let mut receive = |message: &[u8]| received.receive_pose(1, message, now);
        assert_eq!(receive(&message("map", -1.0)), None);
        assert_eq!(receive(&message("map", 1.0)), None);
        let again = receive(&message("map", 13.0)).unwrap();
        assert_eq!(again, "/gold/odom: (13, 0) is not in the room");
        assert_eq!(x_m(&received.take_new()[0]), 1.0);
        assert!(received.receive_pose(0, b"garbage", now).is_some());
    }

    #[test]
    fn bodies_are_lost_when_none_sends() {
        let (mut received, start) = received();
        let later = start + STALL_AFTER + Duration::from_secs(1);
        received.receive_pose(0, &message("map", 1.0), start + Duration::from_secs(2));
        assert!(received.is_silent(1, later) && !received.is_silent(0, later));
        assert_eq!(received.lost(later), None);
        let lost = received.lost(later + Duration::from_secs(2));
        assert_eq!(lost.as_deref(), Some("/blue/odom, /gold/odom"));
    }

    #[test]
    fn a_scan_is_forwarded_as_beams() {
        let (mut received, now) = received();
        assert_eq!(received.receive_scan(1, &scan(0.5), now), None);
        let new = received.take_new();
        let [BridgeMessage::Scan(scanned)] = &new[..] else {
            panic!("{new:?}");
        };
        let ahead = scanned.beams.ahead[1].map(|hit| hit.distance_m);
        assert!((ahead.unwrap() - 0.3).abs() < 0.01, "{ahead:?}");
        assert_eq!(scanned.robot, RobotId(1));
        // A scan is no pose.
        assert_eq!(received.missing(), "/blue/odom, /gold/odom");
        let refused = received.receive_scan(1, b"garbage", now).unwrap();
        assert_eq!(
            refused,
            "/gold/scan: the message is no sensor_msgs/LaserScan in plain CDR"
        );
        assert!(received.take_new().is_empty());
    }

    #[test]
    fn a_body_whose_scanner_falls_silent_is_silent() {
        let (mut received, start) = received();
        received.receive_scan(0, &scan(0.5), start);
        let later = start + STALL_AFTER + Duration::from_secs(1);
        for rank in [0, 1] {
            received.receive_pose(rank, &message("map", 1.0), later);
        }
        // The other body has no scanner.
        assert!(received.is_silent(0, later) && !received.is_silent(1, later));
        assert_eq!(received.lost(later), None);
    }
}
