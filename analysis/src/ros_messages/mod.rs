//! A run as messages of ROS 2. A bag and the topics of a live run contain the same messages.
//!
//! Times are simulated and begin at 1 ns, because ROS treats 0 as "no time".
//!
//! | topic | type | messages |
//! |---|---|---|
//! | `/clock` | `rosgraph_msgs/Clock` | the time, each tick |
//! | `/tf`, `/tf_static` | `tf2_msgs/TFMessage` | true poses of the bodies in the frame `map`, each tick; the sensors on the bodies, once |
//! | `/NAME/ground_truth` | `nav_msgs/Odometry` | the true pose, each tick |
//! | `/NAME/odom` | `nav_msgs/Odometry` | the pose that the position sensor measured, while it works |
//! | `/NAME/scan`, `/NAME/border` | `sensor_msgs/LaserScan` | beams from the center: of collision avoidance, and to the border |
//! | `/NAME/avoidance` | `sensor_msgs/PointCloud2` | end points of all beams of collision avoidance |
//! | `/NAME/status` | `diagnostic_msgs/DiagnosticArray` | the state of the agent, on each change and each second |
//! | `/markers` | `visualization_msgs/MarkerArray` | the visible scene, on each change |
//! | `/map` | `nav_msgs/OccupancyGrid` | border and obstacles, on each change |
//! | `/alliance/…` | `std_msgs/String` | tasks, allocations, faults and events, as JSON |

mod bodies;
mod convert;
mod destination;
mod devices;
mod live;
mod map;
mod markers;
mod robot;
mod status;
mod team;

use proto::view::View;
use ros::messages::Clock;
use ros::{Qos, names};
use run_log::{EventRow, PoseRow};
use scenario::time::SimTime;
use scenario::{Problem, Setup};

use bodies::{Body, BodyTopics};
use convert::stamp;
pub use convert::{CLOCK, MAP_FRAME};
use destination::Topic;
pub use destination::{Destination, TopicSpec};
use devices::DeviceTopics;
pub use live::LiveMessages;
use map::MapTopic;
use markers::MarkerTopic;
pub use robot::{RobotMessages, body_frame, stamp as stamp_of};
use status::StatusTopics;
use team::TeamTopics;

/// Returns the ROS names of the robots, by rank.
///
/// # Errors
/// Returns an error that names the command-line `option` if ROS cannot have the name of a robot.
pub fn robot_names(setup: &Setup, option: &str) -> Result<Vec<String>, Problem> {
    let robots = setup.scenario.robots.iter();
    names::of_robots(robots.map(|robot| &*robot.name)).map_err(|error| {
        let remedy = "rename the robot in the scenario and run it again";
        Problem::with_source(option, error.to_string(), remedy)
    })
}

/// The topics of a run, with the latest messages of those that are sent on a change.
pub struct RunMessages {
    setup: Setup,
    clock: Topic<Clock>,
    bodies: BodyTopics,
    devices: DeviceTopics,
    status: StatusTopics,
    markers: MarkerTopic,
    map: MapTopic,
    team: TeamTopics,
}

impl RunMessages {
    /// Adds the topics to a destination, and writes the fixed frames. `names` are the ROS names of the robots.
    ///
    /// # Errors
    /// Returns the errors of the destination.
    pub fn new(setup: &Setup, names: &[String], to: &mut dyn Destination) -> anyhow::Result<Self> {
        Ok(Self {
            setup: setup.clone(),
            clock: to.topic(CLOCK, Qos::Stream)?,
            bodies: BodyTopics::new(to, setup, names)?,
            devices: DeviceTopics::new(to, setup, names)?,
            status: StatusTopics::new(to, setup, names)?,
            markers: MarkerTopic::new(to, setup, names)?,
            map: MapTopic::new(to, setup)?,
            team: TeamTopics::new(to, setup)?,
        })
    }

    /// Writes everything between the previous view and this one. `poses` and `events` are the rows since then, up to the
    /// time of the view. Readings belong to the tick before the view; all other messages have the time of the view.
    ///
    /// # Errors
    /// Returns the errors of the destination.
    pub fn write(
        &mut self,
        to: &mut dyn Destination,
        view: &View,
        poses: &[PoseRow],
        events: &[EventRow],
    ) -> anyhow::Result<()> {
        let now = view.now;
        if view.tick > 0 {
            let sensed = now - SimTime(self.setup.scenario.step_ms);
            self.devices.write(to, sensed, view)?;
        }
        let clock = stamp(now);
        to.write(&self.clock, now, &Clock { clock })?;
        let bodies: Vec<Body> = poses.iter().map(Body::of_row).collect();
        self.bodies.write(to, now, &bodies)?;
        self.map.write(to, view)?;
        self.markers.write(to, view)?;
        self.status.write(to, view)?;
        self.team.write_state(to, view)?;
        for row in events {
            self.team.write_event(to, row)?;
        }
        Ok(())
    }

    /// Writes the final poses, which no row contains, and the last events.
    ///
    /// # Errors
    /// Returns the errors of the destination.
    pub fn finish(
        &mut self,
        to: &mut dyn Destination,
        end: &View,
        events: &[EventRow],
    ) -> anyhow::Result<()> {
        let bodies = Body::of_view(&self.setup, end);
        self.bodies.write(to, end.now, &bodies)?;
        for row in events {
            self.team.write_event(to, row)?;
        }
        Ok(())
    }
}
