//! The messages of a live run.

use ::proto::view::View;
use scenario::Setup;
use scenario::time::SimTime;

use super::merge::{Stream, merge};
use super::topics::{Message, Topics};
use super::{ROW_STREAMS, RunMessages, in_order};
use crate::live::{Follower, NewRows};

/// Channels to which clients subscribe.
pub trait Channels: Topics {
    /// Sends a message. The order is that of a recording.
    fn send(&mut self, message: Message);

    /// Takes the time up to which all messages have been sent.
    fn set_time(&mut self, now: SimTime);
}

/// An observer that sends the messages of a run.
///
/// The view of a tick contains the sensor readings of the tick before. A message is therefore sent when the next tick is
/// known, so that times never decrease.
pub struct LiveMessages<C> {
    pub channels: C,
    messages: RunMessages,
    /// The messages of each stream that are not sent yet.
    rows: [Vec<Message>; ROW_STREAMS],
    ends: Vec<Message>,
}

impl<C: Channels> LiveMessages<C> {
    /// Adds the topics to the channels.
    ///
    /// # Errors
    /// Returns the errors of the channels.
    pub fn new(setup: &Setup, mut channels: C) -> anyhow::Result<Self> {
        let messages = RunMessages::new(setup, &mut channels)?;
        Ok(Self {
            channels,
            rows: Default::default(),
            ends: vec![messages.tables.threshold(SimTime::ZERO)],
            messages,
        })
    }

    fn take(&mut self, rows: &NewRows) -> anyhow::Result<()> {
        let streams = self.messages.row_streams(rows);
        for (waiting, stream) in self.rows.iter_mut().zip(streams) {
            for message in stream {
                waiting.push(message?);
            }
        }
        Ok(())
    }

    /// Sends all messages from before `end`.
    fn send_until(&mut self, end: SimTime) -> anyhow::Result<()> {
        let seen = &mut self.messages.seen;
        let waiting = in_order(self.rows.each_mut(), seen, &mut self.ends);
        let due = waiting.map(|waiting| -> Stream<'_> {
            let due = waiting.partition_point(|message| message.at < end);
            Box::new(waiting.drain(..due).map(Ok))
        });
        for message in merge(due) {
            self.channels.send(message?);
        }
        Ok(())
    }
}

impl<C: Channels> Follower for LiveMessages<C> {
    fn tick(&mut self, view: &View, rows: &NewRows) -> anyhow::Result<()> {
        self.messages.see(view);
        self.take(rows)?;
        self.send_until(view.now)?;
        self.channels.set_time(view.now);
        Ok(())
    }

    fn finish(&mut self, end: &View, rows: &NewRows) -> anyhow::Result<()> {
        self.take(rows)?;
        let [frames, ..] = &mut self.rows;
        frames.push(self.messages.frames.last(end));
        self.ends.push(self.messages.tables.threshold(end.now));
        self.send_until(SimTime(u64::MAX))?;
        self.channels.set_time(end.now);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use foxglove::Schema;
    use in_process::Team;
    use missions::Registry;
    use run_log::recorder::Folder;
    use run_log::{LogLevel, MemoryLog, RunLog};

    use super::*;
    use crate::live::{LiveRun, Progress};
    use crate::replay_views::retrace_into;
    use crate::testkit::{setup, shipped};

    /// Channels that keep the time, the topic and the content of all messages.
    #[derive(Default)]
    struct Collected {
        topics: Vec<String>,
        messages: Vec<(SimTime, String, Vec<u8>)>,
    }

    impl Topics for Collected {
        fn add(&mut self, topic: &str, _: &Schema, _: &str) -> anyhow::Result<u16> {
            self.topics.push(topic.to_owned());
            Ok(u16::try_from(self.topics.len() - 1)?)
        }
    }

    impl Channels for Collected {
        fn send(&mut self, message: Message) {
            let topic = self.topics[usize::from(message.channel)].clone();
            self.messages.push((message.at, topic, message.bytes));
        }

        fn set_time(&mut self, now: SimTime) {
            assert!(self.messages.iter().all(|(at, ..)| *at <= now));
        }
    }

    /// Runs a shipped scenario for a few seconds, and compares the messages of its log with those of a recording.
    #[track_caller]
    fn check(scenario: &str, topic: &str) {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        let mut scenario = shipped(scenario);
        scenario.limit_s = 3.0;
        let log = Folder::create(&run).unwrap();
        let team = Team::new(setup(scenario), LogLevel::Compact, log).unwrap();
        team.run().unwrap();

        let mut live = LiveRun::open(&run, "--foxglove").unwrap();
        let mut found = LiveMessages::new(live.setup(), Collected::default()).unwrap();
        while live.advance(&mut found).unwrap() != Progress::Over {}
        let found = found.channels.messages;

        let vocabulary = Registry::built_in().vocabulary();
        let logged = RunLog::open(&run, &vocabulary).unwrap();
        let mut recorded = Collected::default();
        let mut messages = RunMessages::new(&logged.run.setup, &mut recorded).unwrap();
        let memory = MemoryLog::default();
        let again = retrace_into(&logged, LogLevel::Compact, memory, |simulation| {
            messages.see(&simulation.view());
        });
        let again = again.unwrap();
        let log = RunLog::from_memory(&again.sink, &vocabulary).unwrap();
        let written = messages.write_log(&log, &again.end, |message| {
            recorded.send(Message {
                bytes: message.bytes.clone(),
                ..*message
            });
            Ok(())
        });
        written.unwrap();
        assert_eq!(found.len(), recorded.messages.len());
        for (found, recorded) in found.iter().zip(&recorded.messages) {
            assert!(found == recorded, "{found:?} is not {recorded:?}");
        }
        assert!(found.is_sorted_by_key(|(at, ..)| *at));
        assert!(found.iter().any(|(_, found, _)| found == topic), "{topic}");
    }

    #[test]
    fn a_live_run_has_the_messages_of_its_recording() {
        check("waste-cleanup", "/sensors/blue/border");
    }

    #[test]
    fn targets_have_topics() {
        check("cmommt", "/targets/t0");
    }
}
