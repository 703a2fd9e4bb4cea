//! Summaries of runs with equal settings.

use std::collections::BTreeMap;

use proto::tick::Outcome;

use super::design::{Cell, Design, FAULTS, PRESET};
use super::results::figures_of;
use super::run::{FaultCount, RankedBy, Row, RunResult};
use super::statistics::{Estimate, Interval, estimate, wilson};
use crate::distinct;

/// The number of distinct values from which a numeric column is divided into classes.
const MOST_GROUPS: usize = 12;

const CLASSES: usize = 8;

#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    pub runs: usize,
    /// The number of failed runs. They count in no other field.
    pub failed: usize,
    /// The number of runs that completed the mission.
    pub complete: usize,
    /// The interval of the share of complete runs.
    pub completion: Interval,
    /// Simulated time of complete runs, s.
    pub makespan_s: Option<Estimate>,
    /// The greatest lateness of a recurring task per run, s. `None` if a run has none: its task was perhaps never done, and
    /// the other runs alone would be the better ones.
    pub lateness_s: Option<Estimate>,
    /// The number of runs that did not fail and have no lateness, if others have one.
    pub without_lateness: usize,
    /// The measure by which the scenario ranks its runs; `None` for the time, and if the runs have different measures.
    pub primary: Option<Primary>,
}

/// The measure by which a scenario ranks its runs, if it is not the time.
#[derive(Clone, Debug, PartialEq)]
pub struct Primary {
    pub metric: String,
    pub more_is_better: bool,
    pub median: Estimate,
}

impl Primary {
    /// Returns the factor with which a smaller value is better: -1 or 1.
    #[must_use]
    pub fn sign(&self) -> f64 {
        if self.more_is_better { -1.0 } else { 1.0 }
    }

    /// Returns the measure of all runs that did not fail.
    fn of(values: &[&RankedBy]) -> Option<Self> {
        let (metric, more_is_better) = (&values.first()?.metric, values.first()?.more_is_better);
        let is_common = values.iter().all(|value| value.metric == *metric);
        let numbers = values.iter().filter_map(|value| value.value).collect();
        Some(Self {
            metric: metric.clone(),
            more_is_better,
            median: estimate(numbers).filter(|_| is_common)?,
        })
    }
}

impl Summary {
    /// Returns the summary of some runs.
    #[must_use]
    pub fn of<'r>(rows: impl IntoIterator<Item = &'r Row>) -> Self {
        let (mut runs, mut ended, mut makespans, mut lateness) = (0, 0, Vec::new(), Vec::new());
        let mut ranked = Vec::new();
        let seconds = |ms: u64| ms as f64 / 1000.0;
        for row in rows {
            runs += 1;
            let Some(figures) = figures_of(row) else {
                continue;
            };
            ended += 1;
            ranked.extend(&figures.ranked_by);
            if figures.outcome == Outcome::Complete {
                makespans.push(seconds(figures.sim_time_ms));
            }
            lateness.extend(figures.lateness_ms().map(seconds));
        }
        let without_lateness = ended - lateness.len();
        Self {
            runs,
            failed: runs - ended,
            complete: makespans.len(),
            completion: wilson(makespans.len(), ended),
            makespan_s: estimate(makespans),
            without_lateness: if lateness.is_empty() {
                0
            } else {
                without_lateness
            },
            lateness_s: estimate(lateness).filter(|_| without_lateness == 0),
            primary: Primary::of(&ranked).filter(|_| ranked.len() == ended),
        }
    }

    /// Returns the share of complete runs among those that did not fail, or `None` if all failed.
    #[must_use]
    pub fn share(&self) -> Option<f64> {
        let ended = self.runs - self.failed;
        (ended > 0).then(|| self.complete as f64 / ended as f64)
    }
}

/// Counts faults by kind over all runs that have figures.
#[must_use]
pub fn faults_by_kind(rows: &[Row]) -> BTreeMap<&str, FaultCount> {
    let mut all: BTreeMap<&str, FaultCount> = BTreeMap::new();
    for (kind, count) in rows
        .iter()
        .filter_map(figures_of)
        .flat_map(|figures| &figures.faults)
    {
        all.entry(kind).or_default().add(count);
    }
    all
}

/// Counts failed runs by the start of their reason.
#[must_use]
pub fn failed_by_reason(rows: &[Row]) -> BTreeMap<&str, usize> {
    let mut all = BTreeMap::new();
    for row in rows {
        if let RunResult::Failed(failure) = &row.end {
            let reason = failure.reason.split(": ").next().unwrap_or_default();
            *all.entry(reason).or_default() += 1;
        }
    }
    all
}

/// Summarizes the runs of each condition, which differ only in the seed. `rows` are all rows, in run order.
#[must_use]
pub fn by_condition<'d>(design: &'d Design, rows: &[Row]) -> Vec<(Vec<&'d Cell>, Summary)> {
    let condition = |row: &Row| row.run / design.seeds_per_condition();
    let conditions = rows.chunk_by(|a, b| condition(a) == condition(b));
    let summaries = conditions.map(|rows| {
        let mut cells: Vec<&Cell> = design.cells(rows[0].run).collect();
        cells.pop();
        (cells, Summary::of(rows))
    });
    summaries.collect()
}

#[derive(Clone, Debug, PartialEq)]
pub struct ColumnSeries {
    pub column: String,
    pub faults: Option<String>,
    /// The values, or classes of values, from left to right.
    pub groups: Vec<String>,
    /// The numeric values, if each has its own group.
    pub numbers: Option<Vec<f64>>,
    /// One series per preset, or a single one without a name. Each has a summary per group, or `None` without runs.
    pub series: Vec<(String, Vec<Option<Summary>>)>,
}

/// Summarizes runs by each swept column that has several values, except the seed, for each class of faults. Summaries cover all
/// values of the other columns. `rows` are all rows, in run order.
#[must_use]
pub fn by_column(design: &Design, rows: &[Row]) -> Vec<ColumnSeries> {
    let factor_of = |column: &str| {
        let mut factors = design.factors.iter();
        factors.position(|factor| factor.columns == [column])
    };
    let (presets, faults) = (factor_of(PRESET), factor_of(FAULTS));
    let mut all = Vec::new();
    // The last factor is the seed.
    let factors = design.factors.iter().enumerate();
    for (number, factor) in factors.take(design.factors.len().saturating_sub(1)) {
        for (place, column) in factor.columns.iter().enumerate() {
            let cells = factor.levels.iter().map(|level| &level.cells[place]);
            let Groups {
                names: groups,
                numbers,
                of: group_of,
            } = groups(&cells.collect::<Vec<_>>());
            if groups.len() < 2 {
                continue;
            }
            let names_of = |factor: usize| -> Vec<String> {
                let levels = design.factors[factor].levels.iter();
                levels.map(|level| level.cells[0].to_string()).collect()
            };
            let apart = presets.filter(|presets| *presets != number);
            let names = apart.map_or_else(|| vec![String::new()], names_of);
            let faults = faults.filter(|faults| *faults != number);
            let classes = faults.map_or_else(Vec::new, names_of);
            let classes: Vec<Option<String>> = match classes.len() {
                0 | 1 => vec![None],
                _ => classes.into_iter().map(Some).collect(),
            };
            let empty: Vec<Vec<Vec<&Row>>> = vec![vec![Vec::new(); groups.len()]; names.len()];
            let mut sorted = vec![empty; classes.len()];
            for row in rows {
                let places = design.level_indices(row.run);
                let class = match classes.len() {
                    1 => 0,
                    _ => faults.map_or(0, |faults| places[faults]),
                };
                let series = apart.map_or(0, |presets| places[presets]);
                sorted[class][series][group_of[places[number]]].push(row);
            }
            let summary = |rows: Vec<&Row>| (!rows.is_empty()).then(|| Summary::of(rows));
            for (faults, sorted) in classes.into_iter().zip(sorted) {
                let summaries = sorted.into_iter();
                let summaries = summaries.map(|groups| groups.into_iter().map(summary).collect());
                all.push(ColumnSeries {
                    column: column.clone(),
                    faults,
                    groups: groups.clone(),
                    numbers: numbers.clone(),
                    series: names.iter().cloned().zip(summaries).collect(),
                });
            }
        }
    }
    all
}

struct Groups {
    names: Vec<String>,
    /// The values of the groups, if each group has one number.
    numbers: Option<Vec<f64>>,
    of: Vec<usize>,
}

/// Groups the cells of a column by value. Numbers are sorted; many numbers form classes of about equal size.
fn groups(cells: &[&Cell]) -> Groups {
    let mut values: Vec<&Cell> = distinct(cells.iter().copied());
    let numbers: Option<Vec<f64>> = values.iter().map(|cell| cell.number()).collect();
    let mut numbers = numbers.map(|mut numbers| {
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|a, b| numbers[*a].total_cmp(&numbers[*b]));
        values = order.into_iter().map(|place| values[place]).collect();
        numbers.sort_by(f64::total_cmp);
        numbers
    });
    let mut count = values.len();
    if numbers.is_some() && count > MOST_GROUPS {
        count = CLASSES;
        numbers = None;
    }
    let group = |place: usize| place * count / values.len();
    let names = (0..count).map(|wanted| {
        let mut members = (0..values.len()).filter(|place| group(*place) == wanted);
        let (first, last) = (members.next(), members.next_back());
        match (first, last) {
            (Some(first), Some(last)) => {
                format!("{} to {}", rounded(values[first]), rounded(values[last]))
            }
            (Some(only), None) => values[only].to_string(),
            _ => String::new(),
        }
    });
    let places = cells.iter().map(|cell| {
        let place = values.iter().position(|value| value == cell);
        group(place.unwrap_or_default())
    });
    Groups {
        names: names.collect(),
        numbers,
        of: places.collect(),
    }
}

/// Rounds to three digits, for the label of a class.
fn rounded(cell: &Cell) -> String {
    match cell.number() {
        Some(number) if number != 0.0 => {
            let digits = (2.0 - number.abs().log10().floor()).clamp(0.0, 9.0);
            let scale = 10_f64.powf(digits);
            ((number * scale).round() / scale).to_string()
        }
        _ => cell.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::results::tests::{complete, design, failed, incomplete};
    use super::*;

    #[test]
    fn failed_runs_count_only_as_failed() {
        let two = [complete(0, 4_000), complete(1, 6_000)];
        let rows = [&two[..], &[incomplete(2), failed(3)]].concat();
        let summary = Summary::of(&rows);
        assert_eq!((summary.runs, summary.failed, summary.complete), (4, 1, 2));
        assert_eq!(summary.share(), Some(2.0 / 3.0));
        assert_eq!(summary.completion, wilson(2, 3));
        assert_eq!(summary.makespan_s.unwrap().0, 5.0);
        assert_eq!((summary.lateness_s, summary.without_lateness), (None, 1));
        assert_eq!(Summary::of(&two).lateness_s.unwrap().0, 0.003);
        let none = Summary::of(&[failed(0)]);
        assert_eq!(
            (none.share(), none.makespan_s, none.completion),
            (None, None, (0.0, 1.0))
        );
    }

    #[test]
    fn faults_by_kind_and_failures_by_reason() {
        let failure = |run, reason: &str| {
            let mut row = failed(run);
            if let RunResult::Failed(failure) = &mut row.end {
                failure.reason = reason.to_owned();
            }
            row
        };
        let rows = [
            complete(0, 4_000),
            incomplete(1),
            failure(2, "no overlap: tick 7: blue is in obstacle-1"),
            failure(3, "no overlap: tick 8: gold is in obstacle-1"),
            failure(4, "no room"),
        ];
        let faults: Vec<(&str, [u64; 3])> = faults_by_kind(&rows)
            .into_iter()
            .map(|(kind, count)| (kind, [count.armed, count.hit, count.hits]))
            .collect();
        assert_eq!(faults, [("kill", [2, 2, 14]), ("mute", [2, 0, 0])]);
        let reasons: Vec<(&str, usize)> = failed_by_reason(&rows).into_iter().collect();
        assert_eq!(reasons, [("no overlap", 2), ("no room", 1)]);
    }

    #[test]
    fn by_condition_and_by_column() {
        let design =
            design("seeds = 2\npresets = ['team', 'par98']\n[grid]\nbody.speed_m_s = [1.0, 0.5]\n");
        // Speed 1: 1, 2 s (team) and 3, 4 s (par98); speed 0.5: 5, 6 s and 7, 8 s.
        let rows: Vec<Row> = (0..8)
            .map(|run| complete(run, (run as u64 + 1) * 1000))
            .collect();
        let conditions: Vec<String> = by_condition(&design, &rows)
            .into_iter()
            .map(|(cells, summary)| {
                let cells: Vec<String> = cells.iter().map(|cell| cell.to_string()).collect();
                format!("{}: {}", cells.join(" "), median(&summary))
            })
            .collect();
        let expected = [
            "1 team: 1.5",
            "1 par98: 3.5",
            "0.5 team: 5.5",
            "0.5 par98: 7.5",
        ];
        assert_eq!(conditions, expected);
        let expected = [
            "body.speed_m_s, 0.5 and 1: team 5.5 1.5, par98 7.5 3.5",
            "preset, team and par98:  3.5 5.5",
        ];
        assert_eq!(columns(&design, &rows), expected);
    }

    fn median(summary: &Summary) -> f64 {
        summary.makespan_s.unwrap().0
    }

    /// Describes the groups of each column, and the medians of each series.
    fn columns(design: &Design, rows: &[Row]) -> Vec<String> {
        let described = by_column(design, rows).into_iter().map(|against| {
            let series = against.series.iter().map(|(name, groups)| {
                let medians = groups.iter().flatten().map(median);
                medians.fold(name.clone(), |text, median| format!("{text} {median}"))
            });
            let faults = against
                .faults
                .map_or_else(String::new, |faults| format!(" ({faults})"));
            format!(
                "{}{faults}, {}: {}",
                against.column,
                against.groups.join(" and "),
                series.collect::<Vec<_>>().join(", ")
            )
        });
        described.collect()
    }

    #[test]
    fn classes_of_faults_are_separate() {
        let plan = "[grid]\nbody.speed_m_s = [1.0, 0.5]\n[faults.none]\n\
             [faults.dies]\ntimeline = [{ fault.kill = 'blue', at_s = 1.0 }]\n";
        let design = design(plan);
        let rows: Vec<Row> = (0..4)
            .map(|run| complete(run, (run as u64 + 1) * 1000))
            .collect();
        // One block per class of faults, and one with the classes as groups.
        let expected = [
            "body.speed_m_s (dies), 0.5 and 1:  3 1",
            "body.speed_m_s (none), 0.5 and 1:  4 2",
            "faults, dies and none:  2 3",
        ];
        assert_eq!(columns(&design, &rows), expected);
    }

    #[test]
    fn many_numbers_form_classes_of_equal_size() {
        let cells: Vec<Cell> = (0..16)
            .map(|i| Cell::Number(1.0 / f64::from(i + 1)))
            .collect();
        let found = groups(&cells.iter().collect::<Vec<_>>());
        let (names, group_of) = (found.names, found.of);
        assert_eq!(found.numbers, None);
        assert_eq!(names.len(), CLASSES);
        assert_eq!(names[0], "0.0625 to 0.0667");
        assert_eq!(names[7], "0.5 to 1");
        for group in 0..CLASSES {
            assert_eq!(group_of.iter().filter(|found| **found == group).count(), 2);
        }
        assert_eq!((group_of[0], group_of[15]), (7, 0));

        let few = [Cell::Integer(10), Cell::Integer(9), Cell::Integer(10)];
        let found = groups(&few.iter().collect::<Vec<_>>());
        assert_eq!(
            (found.names.join(" "), found.of),
            ("9 10".to_owned(), vec![1, 0, 1])
        );
        assert_eq!(found.numbers, Some(vec![9.0, 10.0]));
    }
}
