//! A team whose log another thread encodes and writes.

use proto::event::EventLine;
use proto::tick::Outcome;
use proto::view::View;
use run_log::RunFile;
use run_log::recorder::{BackgroundRecorder, RecordError, Recorder, Sink};
use world_server::simulation::Simulation;

use crate::external_controllers::TickError;
use crate::run::Run;

/// A team whose log another thread encodes and writes, with the same bytes. [`Team::into_background`] creates it.
///
/// [`Team::into_background`]: crate::Team::into_background
pub struct BackgroundTeam<S> {
    run: Run,
    recorder: BackgroundRecorder<S>,
}

impl<S: Sink + Send + 'static> BackgroundTeam<S> {
    pub(super) fn new(
        run: Run,
        recorder: Recorder<S>,
        is_threaded: bool,
    ) -> Result<Self, RecordError> {
        let recorder = BackgroundRecorder::new(recorder, is_threaded)?;
        Ok(Self { run, recorder })
    }

    pub fn simulation(&self) -> &Simulation {
        &self.run.simulation
    }

    pub fn view(&self) -> View {
        self.run.simulation.view_without_history()
    }

    /// Returns the events of the latest tick as rows of events.csv.
    pub fn take_events(&mut self) -> Vec<EventLine> {
        self.recorder.take_events()
    }

    /// Runs one tick. Returns the outcome if the run has ended.
    ///
    /// # Errors
    /// Returns errors of the log, also those of earlier ticks.
    pub fn tick(&mut self) -> Result<Option<Outcome>, TickError> {
        self.run.tick(&mut self.recorder)
    }

    /// Finishes the log with this outcome.
    ///
    /// # Errors
    /// Returns errors of the log, also those of earlier ticks.
    pub fn end(mut self, outcome: Outcome) -> Result<(RunFile, Recorder<S>), RecordError> {
        let ending = self.run.simulation.ending();
        let mut recorder = self.recorder.finish()?;
        let run = recorder.finish(outcome, ending)?;
        Ok((run, recorder))
    }
}
