//! The recorder on a separate thread writes the same log.

use proptest::prelude::*;
use scenario::testkit::default_setup;

use super::torn::{Dying, run_of};
use super::*;

proptest! {
    #[test]
    fn has_the_same_bytes_and_hash_whenever_it_is_flushed(
        ticks in 0..100_usize,
        flush_every in 1..60_u64,
        level in prop::sample::select(vec![LogLevel::Full, LogLevel::Compact, LogLevel::Summary]),
    ) {
        let setup = default_setup(7);
        let ticks = run_of(ticks);
        let (run, expected) = log(level, &ticks);
        let recorder = Recorder::new(&setup, level, MemoryLog::default()).unwrap();
        let mut background = BackgroundRecorder::new(recorder, true).unwrap();
        let mut news = Vec::new();
        for tick in &ticks {
            tick.record(&mut background).unwrap();
            encode::event_rows(&background.take_events(), &mut news);
            if (tick.tick + 1).is_multiple_of(flush_every) {
                background.flush().unwrap();
            }
        }
        let mut recorder = background.finish().unwrap();
        prop_assert_eq!(recorder.finish(Outcome::TimeLimit, Ending::default()).unwrap(), run);
        // Events are available at once and equal to the rows of the table.
        let events = &expected.tables[&Table::Events];
        let header = events.iter().position(|byte| *byte == b'\n').unwrap() + 1;
        prop_assert_eq!(&events[header..], news);
        prop_assert_eq!(recorder.into_sink(), expected);
    }
}

#[test]
fn a_flush_writes_without_a_following_tick() {
    let (sender, receiver) = std::sync::mpsc::sync_channel(8);
    let recorder =
        Recorder::new(&default_setup(7), LogLevel::Full, ForwardingSink(sender)).unwrap();
    let mut background = BackgroundRecorder::new(recorder, true).unwrap();
    for tick in run_of(4) {
        tick.record(&mut background).unwrap();
    }
    // Only the header lines are written, no ticks.
    let mut written = receiver
        .try_iter()
        .fold(String::new(), |all, more| all + &more);
    assert!(!written.contains("run,"), "{written}");
    background.flush().unwrap();
    while written.matches(",run,").count() < 4 {
        written += &receiver.recv().unwrap();
    }
}

/// A sink that forwards the bytes of ticks.csv.
struct ForwardingSink(std::sync::mpsc::SyncSender<String>);

impl Sink for ForwardingSink {
    fn append(&mut self, table: Table, bytes: &[u8]) -> Result<(), RecordError> {
        if table == Table::Ticks {
            self.0.send(String::from_utf8_lossy(bytes).into()).unwrap();
        }
        Ok(())
    }

    fn replace(&mut self, _: Document, _: &str) -> Result<(), RecordError> {
        Ok(())
    }
}

#[test]
fn a_failed_write_is_reported_once_and_ends_the_log() {
    let sink = Dying {
        memory: MemoryLog::default(),
        bytes_left: 2000,
    };
    let recorder = Recorder::new(&default_setup(7), LogLevel::Full, sink).unwrap();
    let mut background = BackgroundRecorder::new(recorder, true).unwrap();
    // The run is longer than the queue.
    let failed = run_of(2000)
        .iter()
        .position(|tick| tick.record(&mut background).is_err());
    assert!(failed.is_some());
    assert!(matches!(background.flush(), Err(RecordError::Broken)));
    assert!(matches!(background.finish(), Err(RecordError::Broken)));
}
