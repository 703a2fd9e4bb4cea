//! Mission progress in numbers.

use scenario::mission::columns::{ColumnKind, ColumnValue};

use super::Simulation;
use crate::barrier::Presence;
use crate::mission::{FigureValue, TeamFigures};
use run_log::recorder::Ending;

/// Counts of a run so far, for the observation of its process.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// The number of ended ticks.
    pub ticks: u64,
    /// Agents that take part now.
    pub agents: u64,
    /// Times that the team continued without an agent that did not answer.
    pub stalls: u64,
    /// Messages that receivers missed, over all receivers: lost, dropped or cut.
    pub messages_dropped: u64,
}

impl Simulation {
    /// Returns the counts of the run so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        let robots = self.barrier.robots();
        let agents = robots.filter(|robot| self.barrier.presence(*robot) == Presence::Present);
        Counts {
            ticks: self.tick(),
            agents: agents.count() as u64,
            stalls: self.stalls,
            messages_dropped: self.messages_dropped,
        }
    }

    /// Keeps the figures of the ended tick before the mission changes between two ticks, so that they match the log.
    pub(super) fn keep_figures(&mut self) {
        if self.ended.figures.is_none() {
            self.ended.figures = Some(Box::new(self.figures()));
        }
    }

    /// Returns the mission's figures, its progress unless they contain it, and the energy used, if simulated.
    fn figures(&self) -> TeamFigures {
        let mut figures = TeamFigures::new(self.setup.scenario.robots.len());
        self.world.mission().figures(&mut figures);
        for column in self.mission_columns() {
            let counts = matches!(
                column.kind,
                ColumnKind::Done | ColumnKind::Left | ColumnKind::Expired
            );
            if counts && figures.mission.column(&column.name).is_none() {
                figures.mission.add(&column.name, column.value);
            }
        }
        if let Some(energy) = &self.setup.scenario.energy {
            let used = self.barrier.robots().filter_map(|robot| {
                let left_j = self.world.energy_j(robot)?;
                Some(f64::from(energy.capacity_j - left_j) + self.world.received_j(robot))
            });
            figures.mission.add("energy_used_j", used.sum::<f64>());
        }
        figures
    }

    /// Returns the current values of mission.csv, in the order of its columns.
    #[must_use]
    pub fn mission_row(&self) -> Vec<FigureValue> {
        let mut row = Vec::new();
        self.world.mission().row(&mut row);
        row
    }

    /// Returns the current values of mission.csv with their columns.
    #[must_use]
    pub fn mission_columns(&self) -> Vec<ColumnValue> {
        let columns = self.setup.catalog.mission.vocabulary().columns.iter();
        let columns = columns.zip(self.mission_row());
        columns
            .map(|(column, value)| column.with_value(value))
            .collect()
    }

    /// Returns the data of the run for the end of the log.
    #[must_use]
    pub fn ending(&self) -> Ending {
        let kept = self.ended.figures.as_deref().cloned();
        Ending {
            unscripted: self.unscripted,
            faults: self.schedule.ended(),
            figures: kept.unwrap_or_else(|| self.figures()),
            ..Ending::default()
        }
    }
}
