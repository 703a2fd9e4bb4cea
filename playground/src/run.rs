//! A run with orders of a person and frames for the page, without a clock.

use in_process::{StartError, Team, TickError};
use observation::feed::Feed;
use proto::control::{Armed, Cleared, ClockStatus, FaultStatus};
use proto::event::TickEvents;
use proto::tick::Outcome;
use proto::view::View;
use run_log::{LogLevel, MemoryLog};
use scenario::fault::Order;
use scenario::ids::Tick;
use scenario::{Problem, Setup};
use serde_json::json;

/// A run in one process that stops at its end.
pub struct Run {
    team: Team<MemoryLog>,
    feed: Feed,
    /// Frames of events since the last call of [`Run::frames`].
    news: Vec<String>,
    outcome: Option<Outcome>,
}

impl Run {
    /// Creates a run before its first tick.
    ///
    /// # Errors
    /// If the setup contains something that this program does not support.
    pub fn new(setup: Setup) -> Result<Self, StartError> {
        let feed = Feed::new(&setup);
        // The log has only the inputs, which the hash does not depend on.
        let mut team = Team::new(setup, LogLevel::Off, MemoryLog::default())?;
        // The first calls start the collection of events, messages and curves.
        team.take_events();
        team.observe();
        let outcome = team.simulation().outcome();
        Ok(Self {
            team,
            feed,
            news: Vec::new(),
            outcome,
        })
    }

    /// Counts the messages of the run from now on, for the frames.
    pub fn count_messages(&mut self) {
        self.team.count_traffic();
    }

    /// Orders a fault for a person.
    ///
    /// # Errors
    /// If the order is invalid or would have no effect.
    pub fn order(&mut self, order: Order) -> Result<Armed, Problem> {
        self.team.order(order)
    }

    /// Clears a fault, or all faults, for a person.
    ///
    /// # Errors
    /// If there is no such fault, or it has already ended.
    pub fn clear(&mut self, id: Option<&str>) -> Result<Cleared, Problem> {
        self.team.clear(id)
    }

    #[must_use]
    pub fn faults(&self) -> Vec<FaultStatus> {
        self.team.simulation().faults()
    }

    #[must_use]
    pub fn next_tick(&self) -> Tick {
        self.team.simulation().tick()
    }

    #[must_use]
    pub fn outcome(&self) -> Option<Outcome> {
        self.outcome
    }

    /// Returns the hash of the run so far.
    #[must_use]
    pub fn hash(&self) -> String {
        self.team.hash()
    }

    /// Runs one tick, unless the run is over.
    ///
    /// # Errors
    /// If the tick cannot be recorded.
    pub fn tick(&mut self) -> Result<(), TickError> {
        if self.outcome.is_some() {
            return Ok(());
        }
        let tick = self.next_tick();
        self.outcome = self.team.tick()?;
        let events = self.team.take_events();
        if !events.is_empty() {
            self.news
                .extend(self.feed.add_events(&TickEvents { tick, events }));
        }
        Ok(())
    }

    /// Returns the present view.
    pub fn view(&mut self) -> View {
        self.team.observe()
    }

    /// Returns the frames since the last call: all news, the newest view with the state of the clock, the number of messages
    /// if they are counted, and the hash so far.
    pub fn frames(&mut self, clock: ClockStatus) -> Vec<String> {
        let mut frames = std::mem::take(&mut self.news);
        let mut view = self.view();
        view.clock = Some(clock);
        if let Some(shown) = self.feed.add_view(view) {
            frames.extend(shown.news);
            frames.push(shown.view);
        }
        if let Some(counts) = self.team.traffic() {
            let messages: u64 = counts.by_kind().map(|(_, count)| count.messages).sum();
            frames.push(json!({"broadcasts": messages}).to_string());
        }
        frames.push(json!({"hash": self.hash()}).to_string());
        frames
    }

    /// Returns the frame of the end.
    #[must_use]
    pub fn end_frame(&self) -> String {
        json!({"ended": {"outcome": self.outcome, "folder": ""}}).to_string()
    }
}
