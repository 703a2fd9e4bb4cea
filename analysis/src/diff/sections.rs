//! The hashes of the sections of a tick, which a compact log does not contain.

use in_process::{AnswerSource, LoggedAnswers, Team};
use missions::Registry;
use proto::tick::Outcome;
use run_log::recorder::{RecordError, Sink};
use run_log::{Document, LogLevel, RUN_SECTION, RunLog, Table, TickRow};

/// Repeats a run up to the tick of a hash, and returns the hashes of that tick by section. Returns `None` if the
/// repetition fails or has another hash, for example because another version made the run.
pub fn sections_of(logged: &RunLog, sealed: &TickRow) -> Option<Vec<TickRow>> {
    let setup = logged.run.setup.clone();
    let worlds = Registry::current().worlds();
    let world = worlds.find(&setup.scenario).ok()?;
    world.start_poses(&setup.scenario).ok()?;
    let inputs = logged.inputs().ok()?;
    let answers = LoggedAnswers::of(logged).ok()?;
    let answers = answers.map(|answers| Box::new(answers) as Box<dyn AnswerSource>);
    let sink = TickSink::new(sealed);
    let mut team = Team::with_answer_source(setup, inputs, LogLevel::Full, sink, answers).ok()?;
    let outcome = team.continue_for(sealed.tick + 1, Outcome::Interrupted, |_| {});
    let (_, recorder) = team.end(outcome.ok()?).ok()?;
    let mut rows = recorder.into_sink().rows()?;
    // The last tick is sealed again if messages are in flight.
    let run = rows.iter().find(|row| row.section == RUN_SECTION)?;
    if run.hash != sealed.hash {
        return None;
    }
    rows.retain(|row| {
        let is_table = |table: &Table| table.file_name() == row.section;
        row.section != RUN_SECTION && !Table::ALL.iter().any(is_table)
    });
    Some(rows)
}

/// A log that keeps the rows of ticks.csv for one tick.
struct TickSink {
    /// The start of a row of the tick.
    start: String,
    rows: Vec<u8>,
}

impl TickSink {
    fn new(tick: &TickRow) -> Self {
        let header = Table::Ticks.header().unwrap_or_default();
        Self {
            start: format!("{},{},", tick.t_ms.0, tick.tick),
            rows: header.as_bytes().to_vec(),
        }
    }

    fn rows(&self) -> Option<Vec<TickRow>> {
        let rows = csv::Reader::from_reader(&*self.rows).into_deserialize();
        rows.collect::<Result<_, _>>().ok()
    }
}

impl Sink for TickSink {
    fn append(&mut self, table: Table, bytes: &[u8]) -> Result<(), RecordError> {
        if table == Table::Ticks {
            // The recorder appends whole rows.
            let rows = bytes.split_inclusive(|byte| *byte == b'\n');
            let of_tick = rows.filter(|row| row.starts_with(self.start.as_bytes()));
            of_tick.for_each(|row| self.rows.extend_from_slice(row));
        }
        Ok(())
    }

    fn replace(&mut self, _: Document, _: &str) -> Result<(), RecordError> {
        Ok(())
    }
}
