//! The summary of a sweep as a self-contained HTML page and as CSV.

use maud::{Markup, html};

use super::design::{Cell, Design};
use super::execution::counted;
use super::run::{FaultCount, Row, RunResult};
use super::statistics::Estimate;
use super::summary::{Summary, failed_by_reason, faults_by_kind};
use crate::columns::{Entry, Table};
use crate::figures::Figure;
use crate::page::{document, drawing, estimate, percent, table};

/// The largest number of rows in a table of the page; the files contain the rest.
const ROWS: usize = 500;

pub struct Page<'s> {
    pub sweep: &'s str,
    pub design: &'s Design,
    pub rows: &'s [Row],
    pub overall: &'s Summary,
    /// The summaries by condition: all settings except the seed.
    pub conditions: &'s [(Vec<&'s Cell>, Summary)],
    pub figures: &'s [Figure],
}

impl Page<'_> {
    #[must_use]
    pub fn html(&self) -> String {
        let columns = self.setting_columns();
        let (first, rest) = self.figures.split_at(self.figures.len().min(1));
        let head = html! {
            @for column in &columns { th.text { (column) } }
            th { "runs" } th { "failed" } th { "complete" } th { "share" } th { "95 %" }
            th { "makespan, s" } th { "95 %" } th { "lateness, s" } th { "95 %" }
        };
        let rows = html! {
            @for (cells, summary) in self.conditions.iter().take(ROWS) {
                tr { @for cell in cells { td.text { (cell) } } (figures(summary)) }
            }
        };
        let title = format!("Sweep {}", self.sweep);
        let body = html! {
            h1 { (title) }
            p {
                (counted(self.overall.runs, "run")) ": " (self.overall.complete) " complete, "
                (self.overall.runs - self.overall.failed - self.overall.complete) " not complete, "
                (self.overall.failed) " failed. A row for each is in "
                a href="results.csv" { "results.csv" } " and " a href="results.parquet" { "results.parquet" } "."
            }
            @for sentence in self.answer() { p { (sentence) } }
            @for figure in first { (drawing(figure)) }
            h2 { "By settings" }
            (table(&head, &rows))
            @if self.conditions.len() > ROWS {
                p.note { (counted(self.conditions.len() - ROWS, "more row")) ": see " a href="summary.csv" { "summary.csv" } "." }
            }
            @if !rest.is_empty() {
                h2 { "By each further key" }
                @for figure in rest { (drawing(figure)) }
            }
            (self.failures())
            (self.faults())
            h2 { "Definitions" }
            dl {
                dt { "share" } dd { "Complete runs divided by runs that did not fail, with Wilson's score interval." }
                dt { "makespan" } dd { "Median simulated time of complete runs in s, with the bootstrap's percentile interval." }
                dt { "lateness" } dd { "Median over the runs of the greatest lateness of a recurring task in s, with the same kind of interval; runs without recurring tasks are omitted." }
            }
        };
        document(&title, "", &body)
    }

    /// Returns the result in two sentences: the settings with the extreme completion and makespan.
    fn answer(&self) -> Vec<String> {
        let all_complete = self.overall.share() == Some(1.0);
        let completion = match self.extremes(Summary::share) {
            None if all_complete => "Every run that did not fail completed its mission.".to_owned(),
            None => "Completion does not depend on the settings.".to_owned(),
            Some([(least, low), (most, high)]) => format!(
                "Completion is lowest, {:.0} %, with {low}, and highest, {:.0} %, with {high}.",
                100.0 * least,
                100.0 * most
            ),
        };
        let median = |summary: &Summary| summary.makespan_s.map(|found| found.0);
        let makespan = self.extremes(median).map(|[(least, low), (most, high)]| {
            format!("The median makespan is shortest, {least:.1} s, with {low}, and longest, {most:.1} s, with {high}.")
        });
        [completion].into_iter().chain(makespan).collect()
    }

    /// Returns the least and the greatest value with their settings, or `None` if all values are equal.
    fn extremes(&self, of: impl Fn(&Summary) -> Option<f64>) -> Option<[(f64, String); 2]> {
        let values = self.conditions.iter();
        let values = values.filter_map(|(cells, summary)| Some((of(summary)?, cells)));
        let values: Vec<(f64, &Vec<&Cell>)> = values.collect();
        let least = values.iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
        let most = values.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let named = |(value, cells): &(f64, &Vec<&Cell>)| (*value, self.settings(cells));
        (least.0 < most.0).then(|| [named(least), named(most)])
    }

    /// Names the settings that vary, such as `body.speed_m_s 0.5, preset team`.
    fn settings(&self, cells: &[&Cell]) -> String {
        let columns = self.setting_columns().into_iter().enumerate();
        let varied = columns.filter(|(place, _)| {
            let mut all = self.conditions.iter().map(|(cells, _)| cells[*place]);
            all.any(|cell| cell != cells[*place])
        });
        let named = varied.map(|(place, column)| format!("{column} {}", cells[place]));
        named.collect::<Vec<_>>().join(", ")
    }

    /// Returns the conditions as a table; times in s.
    #[must_use]
    pub fn table(&self) -> Table {
        let columns = self.setting_columns();
        let rows = self.conditions.iter().map(|(cells, summary)| {
            let share = summary.share().map(|share| (share, summary.completion));
            let [share, share_from, share_to] = Entry::with_interval(share);
            let [makespan, makespan_from, makespan_to] = Entry::with_interval(summary.makespan_s);
            let [lateness, lateness_from, lateness_to] = Entry::with_interval(summary.lateness_s);
            let settings = columns.iter().zip(cells);
            let settings = settings.map(|(column, cell)| (*column, Entry::text(cell)));
            settings.chain([
                ("runs", Entry::count(summary.runs)),
                ("failed", Entry::count(summary.failed)),
                ("complete", Entry::count(summary.complete)),
                ("share", share),
                ("share_from", share_from),
                ("share_to", share_to),
                ("makespan_s", makespan),
                ("makespan_from_s", makespan_from),
                ("makespan_to_s", makespan_to),
                ("lateness_s", lateness),
                ("lateness_from_s", lateness_from),
                ("lateness_to_s", lateness_to),
            ])
        });
        Table::of_rows(rows)
    }

    #[must_use]
    pub fn setting_columns(&self) -> Vec<&str> {
        let mut columns: Vec<&str> = self.design.columns().collect();
        columns.pop();
        columns
    }

    /// Returns the faults by kind.
    #[must_use]
    pub fn fault_table(&self) -> Table {
        let faults = faults_by_kind(self.rows).into_iter();
        Table::of_rows(faults.map(|(kind, FaultCount { armed, hit, hits })| {
            // Counts of faults fit a usize on all supported platforms.
            [
                ("kind", Entry::text(kind)),
                ("armed", Entry::count(armed as usize)),
                ("hit", Entry::count(hit as usize)),
                ("hits", Entry::count(hits as usize)),
            ]
        }))
    }

    fn faults(&self) -> Markup {
        let faults = faults_by_kind(self.rows);
        html! {
            @if !faults.is_empty() {
                h2 { "Faults" }
                p.note {
                    "Faults of all runs that did not fail. Hit: the fault had an effect; hits: the number of effects. Also in "
                    a href="faults.csv" { "faults.csv" } "."
                }
                (table(&html! { th.text { "kind" } th { "armed" } th { "hit" } th { "hits" } }, &html! {
                    @for (kind, count) in &faults {
                        tr { td.text { (kind) } td { (count.armed) } td { (count.hit) } td { (count.hits) } }
                    }
                }))
            }
        }
    }

    fn failures(&self) -> Markup {
        let reasons = failed_by_reason(self.rows);
        let failures = self.rows.iter().filter_map(|row| match &row.end {
            RunResult::Failed(failure) => Some((row.run, failure)),
            RunResult::Ended(_) => None,
        });
        let failures: Vec<_> = failures.collect();
        html! {
            @if !failures.is_empty() {
                h2 { "Failed runs" }
                p {
                    @for (place, (reason, runs)) in reasons.iter().enumerate() {
                        @if place > 0 { ", " }
                        (counted(*runs, "run")) ": " (reason)
                    }
                }
                p.note { "The folder failures/ contains the scenario of each failed run and the command that repeats it." }
                (table(&html! { th { "run" } th { "seed" } th.text { "reason" } }, &html! {
                    @for (run, failure) in failures.iter().take(ROWS) {
                        tr {
                            td { a href=(format!("failures/{run}.toml")) { (run) } }
                            td { (self.design.seed(*run)) }
                            td.text { (failure.reason) }
                        }
                    }
                }))
            }
        }
    }
}

fn figures(summary: &Summary) -> Markup {
    let seconds = |time: Option<Estimate>| estimate(time, |seconds| format!("{seconds:.1}"));
    let share = summary.share().map(|share| (share, summary.completion));
    html! {
        td { (summary.runs) } td { (summary.failed) } td { (summary.complete) }
        (estimate(share, percent)) (seconds(summary.makespan_s)) (seconds(summary.lateness_s))
    }
}

#[cfg(test)]
mod tests {
    use super::super::results::tests::{complete, design, incomplete};
    use super::super::summary::by_condition;
    use super::*;

    #[test]
    fn the_answer_names_the_settings_with_extreme_results() {
        let design =
            design("seeds = 2\npresets = ['team']\n[grid]\nbody.speed_m_s = [0.5, 0.25, 0.1]\n");
        let answer = |rows: &[Row]| {
            let page = Page {
                sweep: "s",
                design: &design,
                rows,
                overall: &Summary::of(rows),
                conditions: &by_condition(&design, rows),
                figures: &[],
            };
            page.answer()
        };
        let mut rows: Vec<Row> = (0..6)
            .map(|run| complete(run, 1000 * (run as u64 + 1)))
            .collect();
        assert_eq!(
            answer(&rows),
            [
                "Every run that did not fail completed its mission.",
                "The median makespan is shortest, 1.5 s, with body.speed_m_s 0.5, and longest, 5.5 s, with body.speed_m_s 0.1."
            ]
        );
        rows[5] = incomplete(5);
        assert_eq!(
            answer(&rows)[0],
            "Completion is lowest, 50 %, with body.speed_m_s 0.1, and highest, 100 %, with body.speed_m_s 0.25."
        );
    }
}
