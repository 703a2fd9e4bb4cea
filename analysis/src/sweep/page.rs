//! The summary of a sweep as a self-contained HTML page and as CSV.

use std::cmp::Ordering;

use maud::{Markup, html};
use terminal::counted;

use super::design::{Cell, Design, FAULTS};
use super::figures::measures;
use super::run::{FaultCount, Row, RunResult};
use super::statistics::Estimate;
use super::summary::{Primary, Summary, failed_by_reason, faults_by_kind};
use crate::columns::latex::{self, LatexCell};
use crate::columns::{Entry, Table};
use crate::figures::Figure;
use crate::figures::files::SCRIPT;
use crate::page::{
    about, choice, choosing, contents, document, drawing, estimate, heading, hinting, number,
    percent, sorting, table,
};

/// The name of the file with the table of [`Page::latex`].
pub const LATEX: &str = "summary.tex";

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
        let varied = self.varied();
        let columns = self.setting_columns();
        let best = self.best();
        let has_best = best.contains(&true);
        let has_failures = self.overall.failed > 0;
        let has_lateness = self.has_lateness();
        let primary = self.primary();
        let (first, rest) = self.figures.split_at(self.figures.len().min(1));
        let head = html! {
            // A long key can break after each dot.
            @for place in &varied { th.text data-setting { (columns[*place].replace('.', ".\u{200b}")) } }
            th { "runs" } @if has_failures { th { "failed" } }
            @for head in ["complete", "share", "95 % of share"] { th data-about=[measure("complete")] { (head) } }
            @for head in ["makespan, s", "95 % of makespan"] { th data-about=[measure("makespan")] { (head) } }
            @if has_lateness { @for head in ["lateness, s", "95 % of lateness"] { th data-about=[measure("lateness")] { (head) } } }
            @if let Some(Primary { metric, .. }) = primary {
                th data-about=[measure(metric)] { (metric) } th data-about=[measure(metric)] { "95 % of " (metric) }
            }
        };
        let rows = html! {
            @for (place, (cells, summary)) in self.conditions.iter().enumerate().take(ROWS) {
                tr.best[best[place]] data-about=[about(&settings_of(&columns, cells, &varied))] {
                    @for column in &varied { td.text { (cells[*column].short()) } }
                    (figures(summary, has_failures, has_lateness))
                    @if primary.is_some() {
                        (estimate(summary.primary.as_ref().map(|primary| primary.median), number))
                    }
                }
            }
        };
        let title = format!("Sweep {}", self.sweep);
        let parts = html! {
            (heading("By settings"))
            @if has_best {
                p.note {
                    "Highlighted, for each class of faults: the best median of the scenario's own measure, if all rows have one; then the most complete runs, and of several such settings the shortest median "
                    "makespan. A heading sorts the table."
                }
            }
            @if let Some(constants) = self.constants(&varied) { p.note { "The same in all rows: " (constants) "." } }
            (table(&head, &rows))
            @if self.conditions.len() > ROWS {
                p.note { (counted(self.conditions.len() - ROWS, "more row")) ": see " a href="summary.csv" { "summary.csv" } "." }
            }
            @if !rest.is_empty() {
                (heading("By each further key"))
                @for figure in rest { (drawing(figure)) }
            }
            (self.failures())
            (self.faults())
            (heading("Definitions"))
            dl {
                dt { "share" } dd { "Complete runs divided by runs that did not fail, with Wilson's score interval." }
                dt { "makespan" } dd { "Median simulated time of complete runs in s, with the bootstrap's percentile interval." }
                @if let Some(primary) = primary {
                    dt { (primary.metric) } dd { "Median of the measure by which the scenario ranks its runs, with the same kind of interval. " (if primary.more_is_better { "More" } else { "Less" }) " is better." }
                }
                dt { "lateness" } dd { "Median over the runs of the greatest lateness of a recurring task in s, with the same kind of interval. It is left out if some runs have none, because in these the task was perhaps never done." }
            }
        };
        let body = html! {
            h1 { (title) }
            p {
                (counted(self.overall.runs, "run")) ": " (self.overall.complete) " complete, "
                (self.overall.runs - self.overall.failed - self.overall.complete) " not complete, "
                (self.overall.failed) " failed. A row for each is in "
                a href="results.csv" { "results.csv" } " and " a href="results.parquet" { "results.parquet" } ". "
                "The table below for LaTeX: " a href=(LATEX) { (LATEX) } ". The figures with matplotlib: "
                a href=(SCRIPT) { (SCRIPT) } "."
            }
            @for sentence in self.answer() { p { (sentence) } }
            (contents(&parts))
            (choice())
            @for figure in first { (drawing(figure)) }
            (parts)
            (sorting())
            (choosing())
            (hinting())
        };
        document(&title, "", &body)
    }

    /// Returns whether the mission has recurring events.
    pub fn has_lateness(&self) -> bool {
        let mut all = self.conditions.iter();
        all.any(|(_, summary)| summary.lateness_s.is_some() || summary.without_lateness > 0)
    }

    /// Returns the measure of the first condition, if all conditions have the same one.
    pub fn primary(&self) -> Option<&Primary> {
        let mut all = self
            .conditions
            .iter()
            .map(|(_, summary)| summary.primary.as_ref());
        let first = all.next().flatten()?;
        let is_same =
            |other: Option<&Primary>| other.is_some_and(|other| other.metric == first.metric);
        all.all(is_same).then_some(first)
    }

    /// Returns the indices of the setting columns with several values, or of all if there is one condition.
    fn varied(&self) -> Vec<usize> {
        let columns = 0..self.setting_columns().len();
        let is_varied = |place: &usize| {
            let mut cells = self.conditions.iter().map(|(cells, _)| cells[*place]);
            let first = cells.next();
            self.conditions.len() < 2 || cells.any(|cell| Some(cell) != first)
        };
        columns.filter(is_varied).collect()
    }

    /// Returns the settings that no row of the table changes, such as `preset team`.
    fn constants(&self, varied: &[usize]) -> Option<String> {
        let (cells, _) = self.conditions.first()?;
        let columns = self.setting_columns().into_iter().enumerate();
        let constant = columns.filter(|(place, _)| !varied.contains(place));
        let named = constant.map(|(place, column)| format!("{column} {}", cells[place].short()));
        let named: Vec<String> = named.collect();
        (!named.is_empty()).then(|| named.join(", "))
    }

    /// Returns whether a condition has the best median of the common measure of all with its class of faults, of several such
    /// the largest share of complete runs, and of these the shortest median makespan. No condition is the best of equal ones.
    fn best(&self) -> Vec<bool> {
        let faults = self
            .setting_columns()
            .into_iter()
            .position(|column| column == FAULTS);
        let rank = |summary: &Summary| {
            let share = summary.share().unwrap_or(0.0);
            let makespan = summary.makespan_s.map_or(f64::INFINITY, |found| found.0);
            let primary = summary
                .primary
                .as_ref()
                .filter(|_| self.primary().is_some());
            let primary = primary.map_or(0.0, |primary| primary.sign() * primary.median.0);
            [primary, -share, makespan]
        };
        let ranks: Vec<[f64; 3]> = self
            .conditions
            .iter()
            .map(|(_, summary)| rank(summary))
            .collect();
        let order = |a: &[f64; 3], b: &[f64; 3]| {
            let pairs = a.iter().zip(b);
            pairs.fold(Ordering::Equal, |order, (a, b)| order.then(a.total_cmp(b)))
        };
        let conditions = self.conditions.iter().zip(&ranks);
        let is_best = conditions.clone().map(|((cells, _), rank)| {
            let class = faults.map(|place| cells[place]);
            let of_class = conditions.clone();
            let of_class =
                of_class.filter(|((cells, _), _)| faults.map(|place| cells[place]) == class);
            let others: Vec<_> = of_class.map(|(_, other)| order(rank, other)).collect();
            others.iter().all(|order| order.is_le()) && others.iter().any(|order| order.is_lt())
        });
        is_best.collect()
    }

    /// Returns the result in sentences: the settings with the extreme values of the scenario's own measure, if there is one,
    /// and the extreme completion and makespan.
    fn answer(&self) -> Vec<String> {
        let all_complete = self.overall.share() == Some(1.0);
        let own = self.primary().map(|Primary { metric, median, .. }| {
            let of = |summary: &Summary| summary.primary.as_ref().map(|primary| primary.median.0);
            match self.extremes(of) {
                None => format!(
                    "The median {metric} is the same for all settings, {}.",
                    number(median.0)
                ),
                Some([(least, low), (most, high)]) => format!(
                    "The median {metric} is lowest, {}, with {low}, and highest, {}, with {high}.",
                    number(least),
                    number(most)
                ),
            }
        });
        let completion = match self.extremes(Summary::share) {
            None if own.is_some() => "Completion does not depend on the settings.".to_owned(),
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
        own.into_iter()
            .chain([completion])
            .chain(makespan)
            .collect()
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
        let named = varied.map(|(place, column)| format!("{column} {}", cells[place].short()));
        named.collect::<Vec<_>>().join(", ")
    }

    /// Returns the conditions as a table for LaTeX, without constant settings. The best one is bold.
    #[must_use]
    pub fn latex(&self) -> String {
        let varied = self.varied();
        let columns = self.setting_columns();
        let best = self.best();
        let settings = varied.iter().map(|place| columns[*place].to_owned());
        let measures = ["complete", "makespan, s", "lateness, s"].map(str::to_owned);
        let own = self.primary();
        let own_head = own.map(|own| own.metric.clone());
        let heads: Vec<String> = settings.chain(measures).chain(own_head).collect();
        let seconds = |time: Option<Estimate>| match time {
            Some((median, (from, to))) => format!("{median:.1} [{from:.1} – {to:.1}]"),
            None => "–".to_owned(),
        };
        let conditions = self.conditions.iter().enumerate();
        let rows = conditions.map(|(place, (cells, summary))| {
            let settings = varied.iter().map(|column| cells[*column].short());
            let complete = format!("{} of {}", summary.complete, summary.runs - summary.failed);
            let measures = [
                complete,
                seconds(summary.makespan_s),
                seconds(summary.lateness_s),
            ];
            let own = own.and(summary.primary.as_ref()).map(|own| {
                let (median, (from, to)) = own.median;
                format!("{} [{} – {}]", number(median), number(from), number(to))
            });
            let texts = settings.chain(measures).chain(own);
            texts
                .map(|text| LatexCell {
                    text,
                    is_best: best[place],
                })
                .collect()
        });
        let note = "Complete runs, and medians with 95 % intervals. Bold: the best of each class of faults.";
        latex::table("sweep", note, &heads, &rows.collect::<Vec<_>>())
    }

    /// Returns the conditions as a table; times in s.
    #[must_use]
    pub fn table(&self) -> Table {
        let columns = self.setting_columns();
        let rows = self.conditions.iter().map(|(cells, summary)| {
            let settings = columns.iter().zip(cells);
            let settings = settings.map(|(column, cell)| (*column, Entry::text(cell)));
            let counts = [
                ("runs", Entry::count(summary.runs)),
                ("failed", Entry::count(summary.failed)),
                ("complete", Entry::count(summary.complete)),
            ];
            settings.chain(counts).chain(measures(summary))
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
                (heading("Faults"))
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
                (heading("Failed runs"))
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

/// Returns the attribute of a column of a measure.
fn measure(name: &str) -> Option<String> {
    about(&[("measure", name.to_owned())])
}

/// Returns the settings of a row that vary, each with its value.
fn settings_of<'c>(
    columns: &[&'c str],
    cells: &[&Cell],
    varied: &[usize],
) -> Vec<(&'c str, String)> {
    let varied = varied.iter();
    varied
        .map(|place| (columns[*place], cells[*place].to_string()))
        .collect()
}

fn figures(summary: &Summary, has_failures: bool, has_lateness: bool) -> Markup {
    let seconds = |time: Option<Estimate>| estimate(time, |seconds| format!("{seconds:.1}"));
    let share = summary.share().map(|share| (share, summary.completion));
    html! {
        td { (summary.runs) } @if has_failures { td { (summary.failed) } } td { (summary.complete) }
        (estimate(share, percent)) (seconds(summary.makespan_s))
        @if summary.without_lateness > 0 { td colspan="2" { "none in " (counted(summary.without_lateness, "run")) } }
        @else if has_lateness { (seconds(summary.lateness_s)) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::results::tests::{complete, design, incomplete};
    use super::super::run::RankedBy;
    use super::super::summary::by_condition;
    use super::*;

    #[test]
    fn the_answer_names_the_settings_with_extreme_results() {
        let design =
            design("seeds = 2\npresets = ['team']\n[grid]\nbody.speed_m_s = [0.5, 0.25, 0.1]\n");
        let highlighted = |rows: &[Row]| {
            let page = Page {
                sweep: "s",
                design: &design,
                rows,
                overall: &Summary::of(rows),
                conditions: &by_condition(&design, rows),
                figures: &[],
            };
            let html = page.html();
            // The preset and the count of failures are the same everywhere.
            assert!(
                html.contains("The same in all rows: preset team."),
                "{html}"
            );
            assert!(
                !html.contains(">preset<") && !html.contains(">failed<"),
                "{html}"
            );
            let has_rate = page.latex().contains("& rate \\\\");
            assert_eq!(has_rate, page.primary().is_some());
            page.best()
        };
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
        assert_eq!(highlighted(&rows), [true, false, false]);
        // A scenario that ranks its runs by a figure is judged by it, and not by the equal times.
        let ranked: Vec<Row> = (0..6)
            .map(|run| {
                let mut row = complete(run, 9000);
                if let RunResult::Ended(figures) = &mut row.end {
                    figures.ranked_by = Some(RankedBy {
                        metric: "rate".to_owned(),
                        more_is_better: true,
                        value: Some(10.0 * run as f64),
                    });
                }
                row
            })
            .collect();
        assert_eq!(
            answer(&ranked),
            [
                "The median rate is lowest, 5.000, with body.speed_m_s 0.5, and highest, 45.0, with body.speed_m_s 0.1.",
                "Completion does not depend on the settings."
            ]
        );
        assert_eq!(highlighted(&ranked), [false, false, true]);
        rows[5] = incomplete(5);
        assert_eq!(
            answer(&rows)[0],
            "Completion is lowest, 50 %, with body.speed_m_s 0.1, and highest, 100 %, with body.speed_m_s 0.25."
        );
    }
}
