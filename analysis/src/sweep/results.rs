//! The results table of a sweep: one row per run, in run order.

use std::collections::BTreeSet;

use scenario::mission::FigureValue;

use super::design::{Cell, Design};
use super::run::{Figures, Row, RunResult};
use crate::columns::{Entry, Table};
use crate::distinct;

/// Creates all columns: run number, settings, outcome, figures, and the reason of a failure.
#[must_use]
pub fn results_table(design: &Design, rows: &[Row]) -> Table {
    let ended = || rows.iter().filter_map(figures_of);
    let of_mission = ended().flat_map(|figures| figures.mission.iter());
    let of_mission = distinct(of_mission.map(|(name, _)| name));
    let measured = || ended().filter_map(|figures| figures.measures.as_deref());
    // Other sweeps than comparisons measure no run.
    let unmeasured = measured().next().map(|measures| measures.figures());
    let measure_names = unmeasured.into_iter().flatten().map(|(name, _)| name);
    let measure_names: Vec<&str> = measure_names.collect();
    let kinds: BTreeSet<&String> = measured().flat_map(|all| all.sent.keys()).collect();
    let kinds = kinds.into_iter();
    let kinds = kinds.map(|kind| (kind, format!("{kind}_messages"), format!("{kind}_bytes")));
    let kinds: Vec<(&String, String, String)> = kinds.collect();
    let places = 0..design.columns().count();
    let is_text = places.map(|place| {
        let cells = || {
            rows.iter()
                .filter_map(|row| design.cells(row.run).nth(place))
        };
        let are_flags = cells().all(|cell| matches!(cell, Cell::Flag(_)));
        !are_flags && cells().any(|cell| cell.number().is_none())
    });
    let is_text: Vec<bool> = is_text.collect();
    Table::of_rows(rows.iter().map(|row| {
        let figures = figures_of(row);
        let measures = figures.and_then(|figures| figures.measures.as_deref());
        let whole = |of: fn(&Figures) -> u64| whole(figures.map(of));
        let mut cells = vec![("run", Entry::count(row.run))];
        let settings = design.cells(row.run).zip(&is_text);
        let settings = settings.map(|(cell, is_text)| match cell {
            cell if *is_text => Entry::text(cell),
            Cell::Flag(flag) => Entry::Flag(*flag),
            Cell::Integer(number) => Entry::Whole(Some(*number)),
            cell => Entry::number(cell.number()),
        });
        cells.extend(design.columns().zip(settings));
        let outcome = figures.map_or("failed", |figures| figures.outcome.as_str());
        cells.extend([
            ("outcome", Entry::text(outcome)),
            (
                "hash",
                Entry::Text(figures.map(|figures| figures.hash.clone())),
            ),
            (
                "build",
                Entry::Text((!row.build.is_empty()).then(|| row.build.clone())),
            ),
            ("sim_time_ms", whole(|figures| figures.sim_time_ms)),
        ]);
        cells.extend(of_mission.iter().map(|&name| {
            let value = figures.map_or(FigureValue::None, |figures| figures.mission.get(name));
            let cell = match value {
                FigureValue::Count(count) => self::whole(Some(count)),
                other => Entry::computed(other.number()),
            };
            (name, cell)
        }));
        cells.extend([
            ("activations", whole(|figures| figures.activations)),
            ("messages_sent", whole(|figures| figures.messages_sent)),
            ("bytes_sent", whole(|figures| figures.bytes_sent)),
            (
                "messages_received",
                whole(|figures| figures.messages_received),
            ),
            ("messages_lost", whole(|figures| figures.messages_lost)),
            ("faults_armed", whole(|figures| figures.all_faults().armed)),
            ("faults_hit", whole(|figures| figures.all_faults().hit)),
            ("fault_hits", whole(|figures| figures.all_faults().hits)),
        ]);
        let values = measures.map(|measures| measures.figures());
        cells.extend(measure_names.iter().enumerate().map(|(place, name)| {
            (
                *name,
                Entry::computed(values.and_then(|values| values[place].1)),
            )
        }));
        for (kind, messages, bytes) in &kinds {
            let sent =
                measures.map(|measures| measures.sent.get(*kind).copied().unwrap_or_default());
            cells.push((messages, self::whole(sent.map(|sent| sent.messages))));
            cells.push((bytes, self::whole(sent.map(|sent| sent.bytes))));
        }
        let reason = match &row.end {
            RunResult::Ended(_) => None,
            RunResult::Failed(failure) => Some(failure.reason.clone()),
        };
        cells.push(("reason", Entry::Text(reason)));
        cells
    }))
}

/// Signed integers, as notebooks expect; none of these numbers approaches 2^63.
fn whole(number: Option<u64>) -> Entry {
    Entry::Whole(number.map(|number| number as i64))
}

#[must_use]
pub fn figures_of(row: &Row) -> Option<&Figures> {
    match &row.end {
        RunResult::Ended(figures) => Some(figures),
        RunResult::Failed(_) => None,
    }
}

#[cfg(test)]
pub(crate) mod tests {

    use missions::waste::data::default_scenario;
    use proto::tick::Outcome;
    use scenario::mission::MissionFigures;

    use super::super::plan::Plan;
    use super::super::run::{Failure, FaultCount};
    use super::*;

    pub fn design(text: &str) -> Design {
        let plan = Plan::parse("plan.toml", text, |_| Ok(default_scenario()));
        plan.unwrap().design
    }

    pub fn complete(run: usize, sim_time_ms: u64) -> Row {
        let mut mission = MissionFigures::default();
        mission.add("items_delivered", 24_u32);
        mission.add("items_total", 24_u32);
        mission.add("reports_made", 2_u32);
        mission.add("report_lateness_mean_ms", 1.5);
        mission.add("report_lateness_max_ms", 3_u32);
        let figures = Figures {
            outcome: Outcome::Complete,
            hash: "00ff".to_owned(),
            sim_time_ms,
            mission,
            done: Some(24),
            expired: None,
            ranked_by: None,
            activations: 8,
            messages_sent: 100,
            bytes_sent: 2000,
            messages_received: 190,
            messages_lost: 10,
            faults: [("kill", 1, 7), ("mute", 0, 0)]
                .map(|(kind, hit, hits)| {
                    let armed = 1;
                    (kind.to_owned(), FaultCount { armed, hit, hits })
                })
                .into(),
            measures: None,
        };
        Row {
            run,
            build: "000000000000000a".to_owned(),
            end: RunResult::Ended(figures),
        }
    }

    pub fn incomplete(run: usize) -> Row {
        let mut row = complete(run, 9_000);
        if let RunResult::Ended(figures) = &mut row.end {
            figures.outcome = Outcome::TimeLimit;
            let mission = &mut figures.mission;
            *mission = MissionFigures::default();
            mission.add("items_delivered", 3_u32);
            mission.add("items_total", 24_u32);
            mission.add("reports_made", 0_u32);
            mission.add("report_lateness_mean_ms", FigureValue::None);
            mission.add("report_lateness_max_ms", FigureValue::None);
        }
        row
    }

    pub fn failed(run: usize) -> Row {
        Row {
            run,
            build: String::new(),
            end: RunResult::Failed(Failure {
                reason: "no place, \"anywhere\"".to_owned(),
                scenario: String::new(),
            }),
        }
    }

    #[test]
    fn column_names_are_unique() {
        let text = "presets = ['team']\n[faults.none]\n[grid]\nbody.speed_m_s = [0.5]\n";
        let csv = results_table(&design(text), &[complete(0, 4_000)]).csv();
        let csv = String::from_utf8(csv.unwrap()).unwrap();
        let columns = csv.lines().next().unwrap().split(',');
        assert_eq!(
            columns.clone().collect::<BTreeSet<_>>().len(),
            columns.count()
        );
    }

    #[test]
    fn each_line_has_settings_and_figures_or_a_reason() {
        let design =
            design("[grid]\nbody.speed_m_s = [0.5, 1, 0.25]\nwaste.spills.0.name = ['top']\n");
        let rows = [complete(0, 4_000), incomplete(1), failed(2)];
        let table = results_table(&design, &rows);
        let csv = String::from_utf8(table.csv().unwrap()).unwrap();
        insta::assert_snapshot!(csv);
    }
}
