//! Mission progress in numbers.

use scenario::mission::columns::{ColumnKind, ColumnValue};

use super::Simulation;
use crate::mission::{FigureValue, TeamFigures};
use run_log::recorder::Ending;

impl Simulation {
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
            faults: self.faults(),
            figures: kept.unwrap_or_else(|| self.figures()),
            ..Ending::default()
        }
    }
}
