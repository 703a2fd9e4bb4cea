//! Export of a run as a bag of ROS 2: a folder for `ros2 bag play` with an MCAP file of the profile `ros2`.
//!
//! The run is replayed twice, as for an MCAP recording: first for the rows of its tables, then with a view of each tick.
//! A message is written as soon as it is known, so the second replay needs no memory for messages. The bag does not
//! depend on `--log`. Times are simulated and begin at 1 ns, because ROS treats 0 as "no time".
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

mod bag;
mod bodies;
mod convert;
mod devices;
mod map;
mod markers;
mod metadata;
mod status;
mod team;

use std::iter::Peekable;
use std::path::Path;

use anyhow::{Context, bail};
use missions::Registry;
use proto::view::View;
use ros::messages::Clock;
use ros::{Qos, names};
use run_log::{EventRow, LogLevel, MemoryLog, PoseRow, ReadError, RunLog};
use scenario::time::SimTime;
use scenario::{Problem, Setup};
use terminal::stderr_line;
use world_server::simulation::SENSING_TEAM_MAX;

use super::{Differs, facts};
use crate::replay_views::retrace_into;
use bag::{Bag, Topic};
use bodies::{Body, BodyTopics};
use convert::stamp;
use devices::DeviceTopics;
use map::MapTopic;
use markers::MarkerTopic;
use status::StatusTopics;
use team::TeamTopics;

/// Checks that a run can be exported into a new folder.
///
/// # Errors
/// Returns an error when something has the path of the folder, or when ROS forbids the name of a robot.
pub fn check(log: &RunLog, folder: &Path) -> anyhow::Result<()> {
    ros_names(&log.run.setup)?;
    // A broken link also occupies the path.
    if folder.symlink_metadata().is_ok() {
        bail!(Problem::with_source(
            folder.display().to_string(),
            "the path of the bag is taken",
            "name a new folder with --rosbag=FOLDER"
        ));
    }
    Ok(())
}

/// Returns the ROS names of the robots, by rank.
fn ros_names(setup: &Setup) -> Result<Vec<String>, Problem> {
    let robots = setup.scenario.robots.iter();
    names::of_robots(robots.map(|robot| &*robot.name)).map_err(|error| {
        let remedy = "rename the robot in the scenario and run it again";
        Problem::with_source("--rosbag", error.to_string(), remedy)
    })
}

/// Replays a logged run and writes its bag into a new folder.
///
/// # Errors
/// Returns [`Differs`] when this program does not reproduce the run exactly, and the errors of [`check`]. Returns other
/// errors when the log has no complete tick or the folder cannot be written. No folder is left in these cases.
pub fn write(logged: &RunLog, folder: &Path) -> anyhow::Result<()> {
    check(logged, folder)?;
    let setup = &logged.run.setup;
    let first = retrace_into(logged, LogLevel::Compact, MemoryLog::default(), |_| {})?;
    if let Some(difference) = first.differs {
        return Err(Differs(difference).into());
    }
    let log = RunLog::from_memory(&first.sink, &Registry::current().vocabulary())?;
    let mut writer = RunWriter::new(&log, Bag::create(folder)?)?;
    let mut written = Ok(());
    retrace_into(logged, LogLevel::Off, MemoryLog::default(), |simulation| {
        if written.is_ok() {
            written = writer.write(&simulation.view_without_history());
        }
    })?;
    written?;
    let facts = facts(logged);
    let mut details = facts.clone();
    let scenario = setup.scenario.to_toml().context("the scenario as TOML")?;
    details.insert("scenario_toml".to_owned(), scenario);
    writer.finish(&first.end)?.finish(&facts, details)?;
    if setup.scenario.robots.len() > SENSING_TEAM_MAX {
        stderr_line!(
            "note: a team of more than {SENSING_TEAM_MAX} robots has no sensor readings in the bag"
        );
    }
    Ok(())
}

/// The topics of a run during their writing.
struct RunWriter<'l> {
    bag: Bag,
    setup: &'l Setup,
    clock: Topic<Clock>,
    bodies: BodyTopics,
    devices: DeviceTopics,
    status: StatusTopics,
    markers: MarkerTopic,
    map: MapTopic,
    team: TeamTopics,
    poses: Rows<'l, PoseRow>,
    events: Rows<'l, EventRow>,
}

impl<'l> RunWriter<'l> {
    fn new(log: &'l RunLog, mut bag: Bag) -> anyhow::Result<Self> {
        let setup = &log.run.setup;
        let names = ros_names(setup)?;
        Ok(Self {
            setup,
            clock: bag.topic("/clock", Qos::Stream)?,
            bodies: BodyTopics::new(&mut bag, setup, &names)?,
            devices: DeviceTopics::new(&mut bag, setup, &names)?,
            status: StatusTopics::new(&mut bag, setup, &names)?,
            markers: MarkerTopic::new(&mut bag, setup, &names)?,
            map: MapTopic::new(&mut bag, setup)?,
            team: TeamTopics::new(&mut bag, setup)?,
            poses: Rows::new(log.each_row(), |row: &PoseRow| row.t_ms),
            events: Rows::new(log.each_row(), |row: &EventRow| row.t_ms),
            bag,
        })
    }

    /// Writes everything between the previous view and this one. Readings belong to the tick before the view; all other
    /// messages have the time of the view.
    fn write(&mut self, view: &View) -> anyhow::Result<()> {
        let bag = &mut self.bag;
        let now = view.now;
        if view.tick > 0 {
            let sensed = now - SimTime(self.setup.scenario.step_ms);
            self.devices.write(bag, sensed, view)?;
        }
        let clock = stamp(now);
        bag.write(&self.clock, now, &Clock { clock })?;
        let poses = self.poses.until(now)?;
        let bodies: Vec<Body> = poses.iter().map(Body::of_row).collect();
        self.bodies.write(bag, now, &bodies)?;
        self.map.write(bag, view)?;
        self.markers.write(bag, view)?;
        self.status.write(bag, view)?;
        self.team.write_state(bag, view)?;
        for row in self.events.until(now)? {
            self.team.write_event(bag, &row)?;
        }
        Ok(())
    }

    /// Writes the final poses, which no row contains, and the last rows.
    fn finish(mut self, end: &View) -> anyhow::Result<Bag> {
        let bodies = Body::of_view(self.setup, end);
        self.bodies.write(&mut self.bag, end.now, &bodies)?;
        for row in self.events.until(SimTime(u64::MAX))? {
            self.team.write_event(&mut self.bag, &row)?;
        }
        Ok(self.bag)
    }
}

/// The rows of a table in order of time.
struct Rows<'l, R> {
    rows: Peekable<Box<dyn Iterator<Item = Result<R, ReadError>> + 'l>>,
    time: fn(&R) -> SimTime,
}

impl<'l, R> Rows<'l, R> {
    fn new(rows: impl Iterator<Item = Result<R, ReadError>> + 'l, time: fn(&R) -> SimTime) -> Self {
        let rows: Box<dyn Iterator<Item = Result<R, ReadError>> + 'l> = Box::new(rows);
        Self {
            rows: rows.peekable(),
            time,
        }
    }

    /// Returns the next rows up to a time.
    fn until(&mut self, end: SimTime) -> Result<Vec<R>, ReadError> {
        let time = self.time;
        let is_due = |row: &Result<R, _>| row.as_ref().map_or(true, |row| time(row) <= end);
        std::iter::from_fn(|| self.rows.next_if(is_due)).collect()
    }
}
