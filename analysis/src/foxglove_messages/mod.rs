//! A run as messages for Foxglove, Lichtblick and PlotJuggler. A recording and the channels of a live run contain the
//! same messages. Times are simulated, from 0.
//!
//! | topic | messages |
//! |---|---|
//! | `/tf` | the pose of each robot as its frame in `world`; each tick |
//! | `/scene/…` | the room, the mission's marks, obstacles, items and robots; on each change |
//! | `/sensors/ROBOT/…` | readings of the range sensors, in the robot's frame; while there are any |
//! | `/motivations/ROBOT/SET`, `/allocation/ROBOT/SET` of robots with another allocator than ALLIANCE, `/poses/ROBOT`, `/targets/TARGET`, `/messages`, `/events`, `/mission` | the rows of the tables, with all columns |
//! | `/threshold` | θ at the beginning and the end: a line across a plot |
//! | `/log` | events as sentences, those about failures as warnings |
//!
//! When a user jumps in time, players show the latest message of each topic and drop earlier ones. Each message
//! therefore contains the full state of its topic, and parts that change independently have their own topics.

mod frames;
mod live;
mod merge;
mod proto;
mod scene;
mod sensors;
mod tables;
mod topics;
mod well_known;

use ::proto::view::View;
use run_log::RunLog;
use scenario::Setup;
use scenario::time::SimTime;

use crate::live::RowSource;
use frames::FrameTopic;
pub use live::{Channels, LiveMessages};
use merge::{Stream, merge};
use scene::SceneTopics;
use sensors::SensorTopics;
use tables::TableTopics;
pub use topics::{Message, Topics, nanoseconds};

/// The number of streams of rows: the frames, one stream for each table, and `/log`.
const ROW_STREAMS: usize = 9;

/// The topics of a run.
pub struct RunMessages {
    frames: FrameTopic,
    scene: SceneTopics,
    sensors: SensorTopics,
    tables: TableTopics,
    /// The messages about what is visible, which no row contains.
    seen: Vec<Message>,
}

impl RunMessages {
    /// Adds the topics to a destination.
    ///
    /// # Errors
    /// Returns the errors of the destination.
    pub fn new(setup: &Setup, to: &mut dyn Topics) -> anyhow::Result<Self> {
        Ok(Self {
            frames: FrameTopic::new(to, setup)?,
            scene: SceneTopics::new(to, setup)?,
            sensors: SensorTopics::new(to, setup)?,
            tables: TableTopics::new(to, setup)?,
            seen: Vec::new(),
        })
    }

    /// Takes the view at the start of a tick, or at the end of the run. The sensor readings belong to the tick before, so
    /// they come first, and the messages are in order of time.
    pub fn see(&mut self, view: &View) {
        self.sensors.see(view, &mut self.seen);
        self.scene.record(view, &mut self.seen);
    }

    /// Writes all messages of a run in order of time, after all its views. `end` is the last of them.
    ///
    /// # Errors
    /// Returns the errors of the log and of `write`.
    pub fn write_log(
        mut self,
        log: &RunLog,
        end: &View,
        mut write: impl FnMut(&Message) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let seen = std::mem::take(&mut self.seen);
        let mut rows = self.row_streams(log);
        let last = self.frames.last(end);
        let [frames, ..] = &mut rows;
        let ticks = std::mem::replace(frames, Box::new(std::iter::empty()));
        *frames = Box::new(ticks.chain([Ok(last)]));
        let ends = [SimTime::ZERO, end.now].map(|at| Ok(self.tables.threshold(at)));
        let seen: Stream<'_> = Box::new(seen.into_iter().map(Ok));
        for message in merge(in_order(rows, seen, Box::new(ends.into_iter()))) {
            write(&message?)?;
        }
        Ok(())
    }

    /// Returns the messages of all rows.
    fn row_streams<'s>(&'s self, rows: &'s impl RowSource) -> [Stream<'s>; ROW_STREAMS] {
        let [a, b, c, d, e, f, g, h] = self.tables.streams(rows);
        [self.frames.stream(rows), a, b, c, d, e, f, g, h]
    }
}

/// Returns the streams in the order of messages with equal times. `ends` are the messages of the start and the end.
fn in_order<S>(rows: [S; ROW_STREAMS], seen: S, ends: S) -> impl Iterator<Item = S> {
    let mut rows = rows.into_iter();
    let frames = rows.next();
    frames.into_iter().chain([seen]).chain(rows).chain([ends])
}
