//! The summary as a page that needs no other, and as a table for programs.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::design::{Cell, Design};
use super::run::{End, FaultCount, Row};
use super::statistics::Estimate;
use super::summary::{Summary, failed_by_reason, faults_by_kind};
use crate::page_head::head;

/// More rows of a table than this are left to the files.
const ROWS: usize = 500;

/// Numbers stay in a line, and a table that is too wide moves by itself.
const TABLES: &str = "td { white-space: nowrap } .wide { overflow-x: auto }";

/// A drawing, with the column that it is about.
pub struct Figure {
    /// What it is about.
    pub column: String,
    /// The drawing.
    pub svg: String,
}

/// What is on the page.
pub struct Page<'s> {
    /// Its name.
    pub sweep: &'s str,
    /// Its runs.
    pub design: &'s Design,
    /// All rows, in order.
    pub rows: &'s [Row],
    /// All runs together.
    pub overall: &'s Summary,
    /// By settings but the seed.
    pub conditions: &'s [(Vec<&'s Cell>, Summary)],
    /// All of them.
    pub figures: &'s [Figure],
}

impl Page<'_> {
    /// The page.
    #[must_use]
    pub fn html(&self) -> String {
        let columns = self.setting_columns();
        let text = html! {
            (DOCTYPE)
            html lang="en" {
                (head(&format!("Sweep {}", self.sweep), TABLES))
                body {
                    h1 { "Sweep " (self.sweep) }
                    p {
                        (self.overall.runs) " runs: " (self.overall.complete) " complete, "
                        (self.overall.runs - self.overall.failed - self.overall.complete) " not complete, "
                        (self.overall.failed) " failed. A row for each is in "
                        a href="results.csv" { "results.csv" } " and " a href="results.parquet" { "results.parquet" } "."
                    }
                    h2 { "By settings" }
                    div.wide { table {
                        thead { tr {
                            @for column in &columns { th.text { (column) } }
                            th { "runs" } th { "failed" } th { "complete" } th { "share" } th { "95 %" }
                            th { "makespan, s" } th { "95 %" } th { "lateness, s" } th { "95 %" }
                        } }
                        tbody {
                            @for (cells, summary) in self.conditions.iter().take(ROWS) {
                                tr {
                                    @for cell in cells { td.text { (cell) } }
                                    (figures(summary))
                                }
                            }
                        }
                    } }
                    @if self.conditions.len() > ROWS {
                        p.note { "The other " (self.conditions.len() - ROWS) " are in " a href="summary.csv" { "summary.csv" } "." }
                    }
                    @if !self.figures.is_empty() {
                        h2 { "By each key" }
                        @for figure in self.figures {
                            figure {
                                (PreEscaped(&figure.svg))
                                figcaption {
                                    "Completion, makespan and lateness against " (figure.column) ", for each class of faults by itself, whatever "
                                    "else was varied; bars are intervals. Numbers stand to scale; the axes of times need not begin at 0."
                                }
                            }
                        }
                    }
                    (self.failures())
                    (self.faults())
                    h2 { "What is counted" }
                    dl {
                        dt { "share" }
                        dd { "Complete runs of those that did not fail, with Wilson's score interval." }
                        dt { "makespan" }
                        dd { "Median simulated time of complete runs in s, with the percentile interval of the bootstrap." }
                        dt { "lateness" }
                        dd {
                            "Median over the runs of the greatest lateness of what recurs in the mission in s, with the same interval; "
                            "runs without any are left out."
                        }
                    }
                }
            }
        };
        text.into_string()
    }

    /// The conditions as CSV, with a header line; times in s.
    ///
    /// # Errors
    /// None: it is written to memory.
    pub fn csv(&self) -> anyhow::Result<Vec<u8>> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let figures = [
            "runs",
            "failed",
            "complete",
            "share",
            "share_from",
            "share_to",
            "makespan_s",
            "makespan_from_s",
            "makespan_to_s",
            "lateness_s",
            "lateness_from_s",
            "lateness_to_s",
        ];
        writer.write_record(self.setting_columns().into_iter().chain(figures))?;
        for (cells, summary) in self.conditions {
            let number = |number: Option<f64>| number.map_or_else(String::new, |n| n.to_string());
            let share = summary.share();
            let estimated = |estimate: Option<Estimate>| {
                [
                    number(estimate.map(|found| found.median)),
                    number(estimate.map(|found| found.interval.0)),
                    number(estimate.map(|found| found.interval.1)),
                ]
            };
            let counts = [summary.runs, summary.failed, summary.complete].map(|n| n.to_string());
            let shares = [
                number(share),
                number(share.map(|_| summary.completion.0)),
                number(share.map(|_| summary.completion.1)),
            ];
            let cells = cells.iter().map(|cell| cell.to_string());
            let all = cells
                .chain(counts)
                .chain(shares)
                .chain(estimated(summary.makespan_s))
                .chain(estimated(summary.lateness_s));
            writer.write_record(all)?;
        }
        Ok(writer.into_inner()?)
    }

    /// All columns of settings but the seed.
    #[must_use]
    pub fn setting_columns(&self) -> Vec<&str> {
        let mut columns: Vec<&str> = self.design.columns().collect();
        columns.pop();
        columns
    }

    /// Faults by kind, with a header line; without any there is no table.
    ///
    /// # Errors
    /// None: it is written to memory.
    pub fn faults_csv(&self) -> anyhow::Result<Option<Vec<u8>>> {
        let faults = faults_by_kind(self.rows);
        if faults.is_empty() {
            return Ok(None);
        }
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(["kind", "armed", "hit", "hits"])?;
        for (kind, FaultCount { armed, hit, hits }) in faults {
            let counts = [armed, hit, hits].map(|n| n.to_string());
            writer.write_record([kind.to_owned()].into_iter().chain(counts))?;
        }
        Ok(Some(writer.into_inner()?))
    }

    fn faults(&self) -> Markup {
        let faults = faults_by_kind(self.rows);
        html! {
            @if !faults.is_empty() {
                h2 { "Faults" }
                p.note {
                    "Of all runs that did not fail. Hit: changed something; hits: how often. Also in "
                    a href="faults.csv" { "faults.csv" } "."
                }
                table {
                    thead { tr { th.text { "kind" } th { "armed" } th { "hit" } th { "hits" } } }
                    tbody {
                        @for (kind, count) in &faults {
                            tr { td.text { (kind) } td { (count.armed) } td { (count.hit) } td { (count.hits) } }
                        }
                    }
                }
            }
        }
    }

    fn failures(&self) -> Markup {
        let reasons = failed_by_reason(self.rows);
        let failures: Vec<_> = self
            .rows
            .iter()
            .filter_map(|row| match &row.end {
                End::Failed(failure) => Some((row.run, failure)),
                End::Ended(_) => None,
            })
            .collect();
        html! {
            @if !failures.is_empty() {
                h2 { "Failed runs" }
                p {
                    @for (place, (reason, runs)) in reasons.iter().enumerate() {
                        @if place > 0 { ", " }
                        (runs) " by " (reason)
                    }
                }
                p.note { "Each has its scenario in failures/, with the command that repeats it." }
                table {
                    thead { tr { th { "run" } th { "seed" } th.text { "reason" } } }
                    tbody {
                        @for (run, failure) in failures.iter().take(ROWS) {
                            tr {
                                td { a href=(format!("failures/{run}.toml")) { (run) } }
                                td { (self.design.seed(*run)) }
                                td.text { (failure.reason) }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn figures(summary: &Summary) -> Markup {
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let estimated = |estimate: Option<Estimate>| {
        let seconds = |seconds: f64| format!("{seconds:.1}");
        html! {
            @match estimate {
                Some(found) => {
                    td { (seconds(found.median)) }
                    td { (seconds(found.interval.0)) " – " (seconds(found.interval.1)) }
                },
                None => { td { "–" } td { "–" } },
            }
        }
    };
    html! {
        td { (summary.runs) } td { (summary.failed) } td { (summary.complete) }
        @match summary.share() {
            Some(share) => {
                td { (percent(share)) }
                td { (format!("{:.0}", 100.0 * summary.completion.0)) " – " (percent(summary.completion.1)) }
            },
            None => { td { "–" } td { "–" } },
        }
        (estimated(summary.makespan_s)) (estimated(summary.lateness_s))
    }
}
