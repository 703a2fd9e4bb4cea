//! Export of a run as an MCAP recording for Foxglove, Lichtblick and PlotJuggler.
//!
//! A log does not contain every visible detail, so the run is replayed with a view of each tick. All rows come from the
//! replay, so the file does not depend on `--log`. Times are simulated, from 0.

mod recording;

use std::io::{Seek, Write};

use anyhow::Context;
use missions::Registry;
use proto::view::View;
use run_log::{LogLevel, MemoryLog, RunLog};

use super::{Differs, facts};
use crate::foxglove_messages::{Message, RunMessages, Topics};
use crate::replay_views::retrace_into;
use recording::Recording;

/// Replays a logged run and records it.
///
/// # Errors
/// Returns [`Differs`] when this program does not reproduce the run exactly. Returns other errors when the log has no
/// complete tick or the file cannot be written.
pub fn write(logged: &RunLog, mut file: impl Write + Seek) -> anyhow::Result<()> {
    let setup = &logged.run.setup;
    let mut recording = Recording::new(&mut file)?;
    let replayed = ReplayedMessages::new(logged, &mut recording)?;

    let mut facts = facts(logged);
    let scenario = setup.scenario.to_toml().context("the scenario as TOML")?;
    facts.insert("scenario_toml".to_owned(), scenario);
    recording.write_metadata("run", facts)?;
    replayed.write(|message| recording.write(message))?;
    recording.finish()
}

/// Replays a logged run, and returns all messages of its recording in their order.
///
/// # Errors
/// Returns [`Differs`] when this program does not reproduce the run exactly. Returns other errors when the log has no
/// complete tick, and the errors of the topics.
pub fn messages(logged: &RunLog, to: &mut dyn Topics) -> anyhow::Result<Vec<Message>> {
    let mut messages = Vec::new();
    ReplayedMessages::new(logged, to)?.write(|message| {
        messages.push(message.clone());
        Ok(())
    })?;
    Ok(messages)
}

/// The messages of a run after its replay.
struct ReplayedMessages {
    messages: RunMessages,
    log: RunLog,
    end: View,
}

impl ReplayedMessages {
    /// Replays a logged run, whose topics it adds to a destination.
    fn new(logged: &RunLog, to: &mut dyn Topics) -> anyhow::Result<Self> {
        let mut messages = RunMessages::new(&logged.run.setup, to)?;
        let memory = MemoryLog::default();
        let again = retrace_into(logged, LogLevel::Compact, memory, |simulation| {
            messages.see(&simulation.view());
        })?;
        if let Some(difference) = again.differs {
            return Err(Differs(difference).into());
        }
        Ok(Self {
            messages,
            log: RunLog::from_memory(&again.sink, &Registry::current().vocabulary())?,
            end: again.end,
        })
    }

    fn write(self, write: impl FnMut(&Message) -> anyhow::Result<()>) -> anyhow::Result<()> {
        self.messages.write_log(&self.log, &self.end, write)
    }
}
