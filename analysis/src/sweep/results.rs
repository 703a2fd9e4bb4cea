//! The results table of a sweep: one row per run, in run order.

use std::collections::BTreeSet;

use scenario::mission::{FigureValue, MissionFigures};

use super::design::{Cell, Design};
use super::measures::{BroadcastTraffic, ComparisonMeasures};
use super::run::{Figures, Row, RunResult};
use crate::columns::Values::{Flags, Integers, Numbers, Texts};
use crate::columns::{Column, Table, Values};

/// Creates all columns: run number, settings, outcome, figures, and the reason of a failure.
#[must_use]
pub fn results_table(design: &Design, rows: &[Row]) -> Table {
    let column = |name: &str, values| Column {
        name: name.to_owned(),
        values,
    };
    let whole = |of: fn(&Figures) -> Option<u64>| {
        // Signed integers, as notebooks expect; none of these numbers approaches 2^63.
        let number = |row| figures_of(row).and_then(of).map(|number| number as i64);
        Integers(rows.iter().map(number).collect())
    };
    let runs = rows.iter().map(|row| Some(row.run as i64));
    let mut columns = vec![column("run", Integers(runs.collect()))];
    for (place, name) in design.columns().enumerate() {
        let cells = rows
            .iter()
            .filter_map(|row| design.cells(row.run).nth(place));
        columns.push(column(name, narrowest(&cells.collect::<Vec<_>>())));
    }
    let text = |of: fn(&Row) -> Option<String>| Texts(rows.iter().map(of).collect());
    columns.extend([
        column(
            "outcome",
            text(|row| {
                let outcome = figures_of(row).map_or("failed", |figures| figures.outcome.as_str());
                Some(outcome.to_owned())
            }),
        ),
        column(
            "hash",
            text(|row| figures_of(row).map(|figures| figures.hash.clone())),
        ),
        column(
            "build",
            text(|row| (!row.build.is_empty()).then(|| row.build.clone())),
        ),
        column("sim_time_ms", whole(|figures| Some(figures.sim_time_ms))),
    ]);
    columns.extend(of_mission(rows));
    columns.extend([
        column("activations", whole(|figures| Some(figures.activations))),
        column(
            "messages_sent",
            whole(|figures| Some(figures.messages_sent)),
        ),
        column("bytes_sent", whole(|figures| Some(figures.bytes_sent))),
        column(
            "messages_heard",
            whole(|figures| Some(figures.messages_heard)),
        ),
        column(
            "messages_lost",
            whole(|figures| Some(figures.messages_lost)),
        ),
        column(
            "faults_armed",
            whole(|figures| Some(figures.all_faults().armed)),
        ),
        column(
            "faults_hit",
            whole(|figures| Some(figures.all_faults().hit)),
        ),
        column(
            "fault_hits",
            whole(|figures| Some(figures.all_faults().hits)),
        ),
    ]);
    columns.extend(measured(rows));
    columns.extend([column(
        "reason",
        text(|row| match &row.end {
            RunResult::Ended(_) => None,
            RunResult::Failed(failure) => Some(failure.reason.clone()),
        }),
    )]);
    Table { columns }
}

/// Creates the columns of the measures that comparisons add. Returns none if no run was measured.
fn measured(rows: &[Row]) -> Vec<Column> {
    let all = || rows.iter().map(|row| figures_of(row)?.measures.as_deref());
    if all().flatten().next().is_none() {
        return Vec::new();
    }
    let number = |name: &str, of: fn(&ComparisonMeasures) -> Option<f64>| Column {
        name: name.to_owned(),
        values: Numbers(all().map(|measures| of(measures?)).collect()),
    };
    let mut columns = vec![
        number("distance_m", |measures| Some(measures.distance_m)),
        number("distance_gini", |measures| Some(measures.distance_gini)),
        number("energy_j", |measures| measures.energy_j),
        number("energy_gini", |measures| measures.energy_gini),
        number("duplicate_s", |measures| Some(measures.duplicate_s)),
        number("orphan_s", |measures| Some(measures.orphan_s)),
        number("unattended_s", |measures| Some(measures.unattended_s)),
        number("detection_s", |measures| measures.detection_s),
        number("takeover_s", |measures| measures.takeover_s),
    ];
    let kinds: BTreeSet<&String> = all()
        .flatten()
        .flat_map(|measures| measures.sent.keys())
        .collect();
    for kind in kinds {
        let whole = |of: fn(&BroadcastTraffic) -> u64| {
            let sent = |measures: &ComparisonMeasures| {
                measures.sent.get(kind).copied().unwrap_or_default()
            };
            Integers(
                all()
                    .map(|measures| Some(of(&sent(measures?)) as i64))
                    .collect(),
            )
        };
        columns.extend([
            Column {
                name: format!("{kind}_messages"),
                values: whole(|sent| sent.messages),
            },
            Column {
                name: format!("{kind}_bytes"),
                values: whole(|sent| sent.bytes),
            },
        ]);
    }
    columns
}

/// Creates the columns of the mission's figures in their order. A column is integer if all its values are.
fn of_mission(rows: &[Row]) -> impl Iterator<Item = Column> {
    let missions = || {
        rows.iter()
            .filter_map(figures_of)
            .map(|figures| &figures.mission)
    };
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in missions().flat_map(MissionFigures::iter) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names.into_iter().map(|name| {
        let values = || {
            rows.iter()
                .map(|row| Some(figures_of(row)?.mission.get(name)))
        };
        let has = |wanted: fn(&FigureValue) -> bool| values().flatten().any(|value| wanted(&value));
        let is_whole = has(|value| matches!(value, FigureValue::Count(_)))
            && !has(|value| matches!(value, FigureValue::Real(_)));
        let values = if is_whole {
            let whole = |value: FigureValue| value.number().map(|_| value.count() as i64);
            Integers(values().map(|value| whole(value?)).collect())
        } else {
            Numbers(values().map(|value| value?.number()).collect())
        };
        Column {
            name: name.to_owned(),
            values,
        }
    })
}

#[must_use]
pub fn figures_of(row: &Row) -> Option<&Figures> {
    match &row.end {
        RunResult::Ended(figures) => Some(figures),
        RunResult::Failed(_) => None,
    }
}

/// Converts cells to the narrowest type that holds all of them.
fn narrowest(cells: &[&Cell]) -> Values {
    let all = |fits: fn(&Cell) -> bool| cells.iter().all(|cell| fits(cell));
    if all(|cell| matches!(cell, Cell::Integer(_))) {
        let numbers = cells.iter().map(|cell| match cell {
            Cell::Integer(number) => Some(*number),
            _ => None,
        });
        Integers(numbers.collect())
    } else if all(|cell| cell.number().is_some()) {
        Numbers(cells.iter().map(|cell| cell.number()).collect())
    } else if all(|cell| matches!(cell, Cell::Flag(_))) {
        let flags = cells.iter().map(|cell| match cell {
            Cell::Flag(flag) => Some(*flag),
            _ => None,
        });
        Flags(flags.collect())
    } else {
        Texts(cells.iter().map(|cell| Some(cell.to_string())).collect())
    }
}

#[cfg(test)]
pub(crate) mod tests {

    use missions::waste::data::default_scenario;
    use proto::tick::Outcome;

    use super::super::plan::Plan;
    use super::super::run::{Failure, FaultCount};
    use super::*;

    pub fn design(text: &str) -> Design {
        let plan = Plan::parse("plan.toml", text, |_| Ok(default_scenario()));
        plan.unwrap().design
    }

    pub fn complete(run: usize, sim_time_ms: u64) -> Row {
        let mut mission = MissionFigures::default();
        for (name, count) in [
            ("items_delivered", 24_u32),
            ("items_total", 24),
            ("reports_made", 2),
        ] {
            mission.add(name, count);
        }
        mission.add("report_lateness_mean_ms", 1.5);
        mission.add("report_lateness_max_ms", 3_u32);
        let figures = Figures {
            outcome: Outcome::Complete,
            hash: "00ff".to_owned(),
            sim_time_ms,
            mission,
            expired: None,
            activations: 8,
            messages_sent: 100,
            bytes_sent: 2000,
            messages_heard: 190,
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
            for (name, count) in [
                ("items_delivered", 3_u32),
                ("items_total", 24),
                ("reports_made", 0),
            ] {
                mission.add(name, count);
            }
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
        let columns = results_table(&design(text), &[complete(0, 4_000)]).columns;
        let names: std::collections::BTreeSet<&String> =
            columns.iter().map(|column| &column.name).collect();
        assert_eq!(names.len(), columns.len());
    }

    #[test]
    fn each_line_has_settings_and_figures_or_a_reason() {
        let design =
            design("[grid]\nbody.speed_m_s = [0.5, 1, 0.25]\nwaste.spills.0.name = ['top']\n");
        let rows = [complete(0, 4_000), incomplete(1), failed(2)];
        let table = results_table(&design, &rows);
        let csv = String::from_utf8(table.csv().unwrap()).unwrap();
        let expected = "\
            run,body.speed_m_s,waste.spills.0.name,seed,outcome,hash,build,sim_time_ms,items_delivered,items_total,reports_made,\
            report_lateness_mean_ms,report_lateness_max_ms,activations,messages_sent,bytes_sent,messages_heard,messages_lost,\
            faults_armed,faults_hit,fault_hits,reason\n\
            0,0.5,top,1,complete,00ff,000000000000000a,4000,24,24,2,1.5,3,8,100,2000,190,10,2,1,7,\n\
            1,1,top,1,time-limit,00ff,000000000000000a,9000,3,24,0,,,8,100,2000,190,10,2,1,7,\n\
            2,0.25,top,1,failed,,,,,,,,,,,,,,,,,\"no place, \"\"anywhere\"\"\"\n";
        assert_eq!(csv, expected);
    }
}
