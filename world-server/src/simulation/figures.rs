//! How far the mission has come, in numbers.

use alliance_proto::mission::columns::{ColumnKind, ColumnValue};

use super::Simulation;
use crate::mission::{TeamFigures, Value};
use crate::recorder::Ending;

impl Simulation {
    /// Before anything changes the mission between two ticks: its figures are those of the tick that has ended, as all that is
    /// in the log.
    pub(super) fn keep_figures(&mut self) {
        if self.ended.figures.is_none() {
            self.ended.figures = Some(Box::new(self.figures()));
        }
    }

    /// Those that the mission tells, how far it has come if it does not say so itself, and what energy all robots have used, if that is
    /// simulated.
    fn figures(&self) -> TeamFigures {
        let mut figures = TeamFigures::new(self.setup.scenario.robots.len());
        self.world.mission().figures(&mut figures);
        for column in self.mission_columns() {
            let counts = matches!(column.kind, ColumnKind::Done | ColumnKind::Left);
            if counts && figures.mission.column(&column.name).is_none() {
                figures.mission.add(&column.name, column.value);
            }
        }
        if let Some(energy) = &self.setup.scenario.energy {
            let left = self
                .barrier
                .robots()
                .filter_map(|it| self.world.energy_j(it));
            let used = left.map(|left_j| f64::from(energy.capacity_j - left_j));
            figures.mission.add("energy_used_j", used.sum::<f64>());
        }
        figures
    }

    /// The values of mission.csv now, in the order of its columns.
    #[must_use]
    pub fn mission_row(&self) -> Vec<Value> {
        let mut row = Vec::new();
        self.world.mission().row(&mut row);
        row
    }

    /// The same with their columns.
    #[must_use]
    pub fn mission_columns(&self) -> Vec<ColumnValue> {
        let columns = self.setup.catalog.mission.terms().columns.iter();
        let columns = columns.zip(self.mission_row());
        columns.map(|(column, value)| column.with(value)).collect()
    }

    /// What the end of the log tells of the run.
    #[must_use]
    pub fn ending(&self) -> Ending {
        let kept = self.ended.figures.as_deref().cloned();
        Ending {
            unscripted: self.unscripted,
            faults: self.faults(),
            figures: kept.unwrap_or_else(|| self.figures()),
        }
    }
}
