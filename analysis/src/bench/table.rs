//! The table of all allocators of a result, in Markdown.

use std::fmt::Write;

use proto::tick::Outcome;

use super::result::{BenchResult, BenchRun};
use super::suite::SuitePlan;
use crate::compare::statistics::friedman::friedman;
use crate::distinct;
use crate::sweep::statistics::mean;

/// A row of the table.
struct AllocatorRow {
    name: String,
    /// The mean rank over all missions and classes of faults, 1 for the best; `None` with one allocator.
    rank: Option<f64>,
    cells: Vec<String>,
}

/// Returns the text between the markers: the origin of the result, and the table, best allocators first.
#[must_use]
pub fn markdown(result: &BenchResult, plan: &SuitePlan) -> String {
    let missions = distinct(result.runs.iter().map(|run| (&run.mission, &run.metric)));
    let ranks = mean_ranks(result, plan);
    let mut rows: Vec<AllocatorRow> = Vec::new();
    for (place, name) in result.allocators.iter().enumerate() {
        let of_allocator = || result.runs.iter().filter(|run| run.allocator == *name);
        let complete = of_allocator().filter(|run| run.outcome == Outcome::Complete);
        let share = 100.0 * complete.count() as f64 / of_allocator().count().max(1) as f64;
        let mean_of = |values: Vec<f64>, digits: usize| {
            mean(&values).map_or("–".to_owned(), |mean| format!("{mean:.digits$}"))
        };
        let rank = ranks.as_ref().map(|ranks| ranks[place]);
        let mut cells = vec![
            rank.map_or("–".to_owned(), |rank| format!("{rank:.2}")),
            format!("{share:.0} %"),
        ];
        for (mission, metric) in &missions {
            let runs = of_allocator().filter(|run| run.mission == **mission);
            let digits = if metric.ends_with("_s") { 1 } else { 3 };
            cells.push(mean_of(runs.filter_map(|run| run.value).collect(), digits));
        }
        let bytes = of_allocator().map(|run| run.bytes as f64 / 1000.0);
        cells.push(mean_of(bytes.collect(), 1));
        rows.push(AllocatorRow {
            name: name.clone(),
            rank,
            cells,
        });
    }
    rows.sort_by(|a, b| {
        a.rank
            .partial_cmp(&b.rank)
            .unwrap_or(std::cmp::Ordering::Equal)
    });

    let mut text = format!(
        "Suite {} (digest {}), version {} (build {}), {} runs.\n\n| allocator | mean rank | complete |",
        result.suite,
        result.suite_digest,
        result.version,
        result.build,
        result.runs.len()
    );
    // Writing to a String cannot fail.
    for (mission, metric) in &missions {
        let _ = write!(text, " {mission}, {metric} |");
    }
    let _ = writeln!(text, " kB |\n|---|{}", "--:|".repeat(missions.len() + 3));
    for row in rows {
        let _ = writeln!(text, "| `{}` | {} |", row.name, row.cells.join(" | "));
    }
    text
}

/// Returns the mean ranks of the allocators over all missions and classes of faults, by the means of the primary
/// metric. Returns `None` with one allocator.
fn mean_ranks(result: &BenchResult, plan: &SuitePlan) -> Option<Vec<f64>> {
    let condition = |run: &BenchRun| (run.mission.clone(), run.faults.clone());
    let mut conditions: Vec<Vec<f64>> = Vec::new();
    let mut first = 0;
    for runs in result.runs.chunk_by(|a, b| condition(a) == condition(b)) {
        let sign = plan.objective(first).metric.sign();
        let means = result.allocators.iter().map(|allocator| {
            let runs = runs.iter().filter(|run| run.allocator == *allocator);
            let values: Vec<f64> = runs.filter_map(|run| run.value).collect();
            Some(sign * mean(&values)?)
        });
        conditions.extend(means.collect::<Option<Vec<f64>>>());
        first += runs.len();
    }
    friedman(&conditions).map(|ranked| ranked.mean_ranks)
}

/// Returns a document with this text between the markers `<!-- bench SUITE -->` and `<!-- end -->`, or `None` without them.
#[must_use]
pub fn insert(document: &str, suite: &str, text: &str) -> Option<String> {
    let marker = format!("<!-- bench {suite} -->\n");
    let (before, rest) = document.split_once(&marker)?;
    let (_, after) = rest.split_once("<!-- end -->")?;
    Some(format!("{before}{marker}\n{text}\n<!-- end -->{after}"))
}
