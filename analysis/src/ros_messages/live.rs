//! The messages of a live run.

use std::collections::VecDeque;

use proto::view::View;
use run_log::{EventRow, PoseRow};
use scenario::Setup;
use scenario::time::SimTime;

use super::{Destination, RunMessages};
use crate::live::{Follower, NewRows, RowSource};

/// An observer that writes the messages of a run to a destination.
pub struct LiveMessages<D> {
    pub destination: D,
    messages: RunMessages,
    /// The rows of later times than that of the latest view.
    poses: VecDeque<PoseRow>,
    events: VecDeque<EventRow>,
}

impl<D: Destination> LiveMessages<D> {
    /// Adds the topics to a destination. `names` are the ROS names of the robots.
    ///
    /// # Errors
    /// Returns the errors of the destination.
    pub fn new(setup: &Setup, names: &[String], mut destination: D) -> anyhow::Result<Self> {
        Ok(Self {
            messages: RunMessages::new(setup, names, &mut destination)?,
            destination,
            poses: VecDeque::new(),
            events: VecDeque::new(),
        })
    }

    fn take(&mut self, rows: &NewRows) -> anyhow::Result<()> {
        for row in rows.each_row() {
            self.poses.push_back(row?);
        }
        for row in rows.each_row() {
            self.events.push_back(row?);
        }
        Ok(())
    }
}

impl<D: Destination> Follower for LiveMessages<D> {
    fn tick(&mut self, view: &View, rows: &NewRows) -> anyhow::Result<()> {
        self.take(rows)?;
        let poses = until(&mut self.poses, view.now, |row| row.t_ms);
        let events = until(&mut self.events, view.now, |row| row.t_ms);
        self.messages
            .write(&mut self.destination, view, &poses, &events)
    }

    fn finish(&mut self, end: &View, rows: &NewRows) -> anyhow::Result<()> {
        self.take(rows)?;
        let events = self.events.make_contiguous();
        self.messages.finish(&mut self.destination, end, events)
    }
}

/// Removes and returns the first rows up to a time.
fn until<R>(rows: &mut VecDeque<R>, end: SimTime, time: fn(&R) -> SimTime) -> Vec<R> {
    std::iter::from_fn(|| rows.pop_front_if(|row| time(row) <= end)).collect()
}
