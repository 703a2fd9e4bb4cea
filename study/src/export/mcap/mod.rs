//! A run as an MCAP recording: what Foxglove, Lichtblick and PlotJuggler open.
//!
//! A log does not say how everything looked, so the run is run again, with a view of each tick. All rows come from the second
//! time, too: the file is the same whatever `--log` the first one had. Times are simulated, from 0.
//!
//! | topic | messages |
//! |---|---|
//! | `/tf` | where each robot is, as its frame in `world`; each tick |
//! | `/scene/…` | the room, what the mission shows (marks), obstacles, items and robots; whenever they change |
//! | `/sensors/ROBOT/…` | what the sensors with a range tell, in the robot's frame; while there is something |
//! | `/motivations/ROBOT/SET`, `/allocation/ROBOT/SET` of robots with another allocator than ALLIANCE, `/poses/ROBOT`, `/targets/TARGET`, `/messages`, `/events`, `/mission` | the rows of the tables, with all columns |
//! | `/threshold` | θ, at the beginning and the end: a line across a plot |
//! | `/log` | events as sentences, those about failures as warnings |
//!
//! Players show the latest message of each topic when somebody jumps in time, and forget what came before. So a topic tells
//! all there is to know in each message, and what changes by itself has its own.

mod frames;
mod merge;
mod mission;
mod recording;
mod scene;
mod sensors;
mod tables;
mod well_known;

use std::io::{Seek, Write};

use alliance_proto::log::{LogLevel, RunLog};
use anyhow::Context;

use super::facts;
use crate::retrace::retrace;
use frames::Frames;
use merge::merge;
use recording::Recording;
use scene::SceneTopics;
use sensors::Sensors;
use tables::Tables;

/// The run cannot be shown as it was.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Differs(String);

/// Runs a logged run again and records it.
///
/// # Errors
/// [`Differs`] when this program does not repeat it exactly; when the log has no whole tick, and when the file cannot be
/// written.
pub fn write(logged: &RunLog, file: impl Write + Seek) -> anyhow::Result<()> {
    let setup = &logged.run.setup;
    let mut recording = Recording::new(file)?;
    let frames = Frames::new(&mut recording, setup)?;
    let mut scene = SceneTopics::new(&mut recording, setup)?;
    let mut sensors = Sensors::new(&mut recording, setup)?;

    let mut seen = Vec::new();
    let mut end = None;
    let again = retrace(logged, LogLevel::Full, |view| {
        scene.see(&view, &mut seen);
        sensors.see(&view, &mut seen);
        end = Some(view);
    })?;
    let end = end.context("nothing was seen of the run")?;
    if let Some(difference) = again.differs {
        return Err(Differs(difference).into());
    }
    let tables = Tables::new(&mut recording, &again.log)?;
    // Sensors tell of the tick before; the order of what tells of the same time stays.
    seen.sort_by_key(|message| message.at);

    let mut facts = facts(logged);
    let scenario = setup.scenario.to_toml().context("the scenario as TOML")?;
    facts.insert("scenario_toml".to_owned(), scenario);
    recording.write_metadata("run", facts)?;
    let frames = frames.stream(&again.log, &end);
    let seen = Box::new(seen.into_iter().map(Ok));
    let streams = [frames, seen].into_iter().chain(tables.streams(&again.log));
    for message in merge(streams) {
        recording.write(&message?)?;
    }
    recording.finish()
}
