//! Export of a run as an MCAP recording for Foxglove, Lichtblick and PlotJuggler.
//!
//! A log does not contain every visible detail, so the run is replayed with a view of each tick. All rows come from the
//! replay, so the file does not depend on `--log`. Times are simulated, from 0.
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
mod merge;
mod proto;
mod recording;
mod scene;
mod sensors;
mod tables;
mod well_known;

use std::io::{Seek, Write};

use anyhow::Context;
use missions::Registry;
use run_log::{LogLevel, MemoryLog, RunLog};

use super::{Differs, facts};
use crate::replay_views::retrace_into;
use frames::FrameTopic;
use merge::merge;
use recording::Recording;
use scene::SceneTopics;
use sensors::SensorTopics;
use tables::TableTopics;

/// Replays a logged run and records it.
///
/// # Errors
/// Returns [`Differs`] when this program does not reproduce the run exactly. Returns other errors when the log has no
/// complete tick or the file cannot be written.
pub fn write(logged: &RunLog, mut file: impl Write + Seek) -> anyhow::Result<()> {
    let setup = &logged.run.setup;
    let mut recording = Recording::new(&mut file)?;
    let frames = FrameTopic::new(&mut recording, setup)?;
    let mut scene = SceneTopics::new(&mut recording, setup)?;
    let mut sensors = SensorTopics::new(&mut recording, setup)?;

    let mut seen = Vec::new();
    let memory = MemoryLog::default();
    let again = retrace_into(logged, LogLevel::Compact, memory, |simulation| {
        let view = simulation.view();
        scene.record(&view, &mut seen);
        sensors.see(&view, &mut seen);
    })?;
    if let Some(difference) = again.differs {
        return Err(Differs(difference).into());
    }
    let log = RunLog::from_memory(&again.sink, &Registry::current().vocabulary())?;
    let tables = TableTopics::new(&mut recording, &log)?;
    // Sensor readings belong to the previous tick. The sort is stable for equal times.
    seen.sort_by_key(|message| message.at);

    let mut facts = facts(logged);
    let scenario = setup.scenario.to_toml().context("the scenario as TOML")?;
    facts.insert("scenario_toml".to_owned(), scenario);
    recording.write_metadata("run", facts)?;
    let frames = frames.stream(&log, &again.end);
    let seen = Box::new(seen.into_iter().map(Ok));
    let streams = [frames, seen].into_iter().chain(tables.streams(&log));
    for message in merge(streams) {
        recording.write(&message?)?;
    }
    recording.finish()
}
