//! Export of a run as a bag of ROS 2: a folder for `ros2 bag play` with an MCAP file of the profile `ros2`.
//!
//! The run is replayed twice, as for an MCAP recording: first for the rows of its tables, then with a view of each tick.
//! A message is written as soon as it is known, so the second replay needs no memory for messages. The bag does not
//! depend on `--log`. Times are simulated and begin at 1 ns, because ROS treats 0 as "no time".

mod bag;
mod metadata;

use std::iter::Peekable;
use std::path::Path;

use anyhow::{Context, bail};
use missions::Registry;
use proto::view::View;
use run_log::{EventRow, LogLevel, MemoryLog, PoseRow, ReadError, RunLog};
use scenario::Problem;
use scenario::time::SimTime;
use terminal::stderr_line;
use world_server::simulation::SENSING_TEAM_MAX;

use super::{Differs, facts};
use crate::replay_views::retrace_into;
use crate::ros_messages::{RunMessages, robot_names};
use bag::Bag;

/// The option of the export, for error messages.
const OPTION: &str = "--rosbag";

/// Checks that a run can be exported into a new folder.
///
/// # Errors
/// Returns an error when something has the path of the folder, or when ROS forbids the name of a robot.
pub fn check(log: &RunLog, folder: &Path) -> anyhow::Result<()> {
    robot_names(&log.run.setup, OPTION)?;
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

/// A bag with the rows that its messages need.
struct RunWriter<'l> {
    bag: Bag,
    messages: RunMessages,
    poses: Rows<'l, PoseRow>,
    events: Rows<'l, EventRow>,
}

impl<'l> RunWriter<'l> {
    fn new(log: &'l RunLog, mut bag: Bag) -> anyhow::Result<Self> {
        let setup = &log.run.setup;
        let names = robot_names(setup, OPTION)?;
        Ok(Self {
            messages: RunMessages::new(setup, &names, &mut bag)?,
            poses: Rows::new(log.each_row(), |row: &PoseRow| row.t_ms),
            events: Rows::new(log.each_row(), |row: &EventRow| row.t_ms),
            bag,
        })
    }

    /// Writes everything between the previous view and this one.
    fn write(&mut self, view: &View) -> anyhow::Result<()> {
        let (poses, events) = (self.poses.until(view.now)?, self.events.until(view.now)?);
        self.messages.write(&mut self.bag, view, &poses, &events)
    }

    /// Writes all remaining messages.
    fn finish(mut self, end: &View) -> anyhow::Result<Bag> {
        let events = self.events.until(SimTime(u64::MAX))?;
        self.messages.finish(&mut self.bag, end, &events)?;
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
