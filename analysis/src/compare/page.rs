//! The result as a self-contained HTML page. Its first screen has the question, the answer in three sentences, and one figure.

use std::path::Path;

use maud::{Markup, html};

use super::analysis::{Analysis, Summary};
use super::answer::{Answer, best, p_value};
use super::data::ComparisonData;
use super::hypotheses::Verdict;
use super::metrics::Metric;
use super::overview::overview;
use super::tables::{LATEX, NamedTable};
use crate::figures::Figure;
use crate::figures::files::SCRIPT;
use crate::page::{
    LANDSCAPE, about, choice, choosing, contents, document, drawing, estimate, heading, hinting,
    number, percent, sorting, table,
};
use crate::shell::shell_quoted;
use crate::sweep::statistics::Interval;

/// The columns of the tables by block after the primary metric: heading, metric and number of decimals.
const SHOWN: [(&str, Metric, usize); 16] = [
    ("PAR2, s", Metric::Par2, 1),
    ("makespan, s", Metric::Makespan, 1),
    ("done", Metric::Done, 1),
    ("expired", Metric::Expired, 1),
    ("lateness, s", Metric::Lateness, 1),
    ("regret, s", Metric::Regret, 1),
    ("gap, %", Metric::Gap, 2),
    ("messages", Metric::Messages, 0),
    ("kB", Metric::Bytes, 1),
    ("distance, m", Metric::Distance, 1),
    ("energy, kJ", Metric::Energy, 2),
    ("duplicate, s", Metric::Duplicate, 1),
    ("orphan, s", Metric::Orphan, 1),
    ("unattended, s", Metric::Unattended, 1),
    ("detection, s", Metric::Detection, 1),
    ("takeover, s", Metric::Takeover, 1),
];

pub struct Page<'c> {
    pub name: &'c str,
    /// The question that the plan states.
    pub question: Option<&'c str>,
    pub answer: &'c Answer,
    pub data: &'c ComparisonData,
    pub analysis: &'c Analysis,
    pub verdicts: &'c [Verdict],
    pub figures: &'c [Figure],
    pub tables: &'c [NamedTable],
    pub runs: (usize, usize),
}

impl Page<'_> {
    #[must_use]
    pub fn html(&self) -> String {
        let title = format!("Comparison {}", self.name);
        let parts = html! {
            (self.hypotheses())
            (heading("Figures"))
            (choice())
            p.note { "Each figure is also a file in several formats, with its numbers. Measures in which all allocators are equal are left out." }
            @for figure in self.figures.iter().skip(1) { (drawing(figure)) }
            @if !self.answer.details.is_empty() {
                (heading("Details"))
                ul.answer { @for detail in &self.answer.details { li { (detail) } } }
            }
            (heading("All blocks"))
            p.note {
                "Means over the seeds with their intervals. Less is better, except for completion, finished work (done) and some missions' own "
                "figures. Columns in which all allocators are equal are left out. The last columns compare with the best allocator of the block "
                "(except the oracle), which is highlighted. In the other columns the best value is highlighted, with its interval; the pointer shows "
                "the interval of any value. \"in 7 of 10\" marks the mean of the runs that have the value, such as the makespan of complete runs or a takeover. A heading sorts its table. The effect is the matched-pairs rank-biserial correlation, from -1 (always less than that of the best) to 1 (always more); "
                "p comes from Wilcoxon's signed-rank test with Holm's correction over all pairs of the block."
            }
            @for block in 0..self.data.blocks.len() { (self.block(block)) }
            (self.downloads())
            (self.repeat())
            (self.definitions())
        };
        let body = html! {
            h1 { (title) }
            p.question {
                (self.question.unwrap_or("Which allocation rule copes best with which faults, and is the difference real?"))
            }
            ul.answer { @for sentence in &self.answer.sentences { li { (sentence) } } }
            dl.facts { @for (heading, text) in overview(self.data, self.analysis, self.runs) { dt { (heading) } dd { (text) } } }
            (contents(&parts))
            @for figure in self.figures.iter().take(1) { (drawing(figure)) }
            (parts)
            (sorting())
            (choosing())
            (hinting())
        };
        document(&title, LANDSCAPE, &body)
    }

    fn hypotheses(&self) -> Markup {
        html! {
            @if !self.verdicts.is_empty() {
                (heading("Hypotheses"))
                @if let Some(claims) = &self.answer.claims { p { (claims) } }
                p.note {
                    "The plan declared these before the first run. Held: the interval of every part lies within the claim. Failed: the interval of some part, "
                    "at a level corrected for the number of parts, lies outside. Otherwise undecided."
                }
                @for verdict in self.verdicts {
                    details {
                        summary {
                            span class=(verdict.outcome.as_str()) { (verdict.outcome.as_str()) } " · " (verdict.name) ": " (verdict.claim)
                        }
                        (table(&html! { th.text { "block" } th.text { "claim" } th { "mean" } th { "95 %" } th.text { "outcome" } }, &html! {
                            @for part in &verdict.parts { tr {
                                td.text { (self.data.blocks[part.block].name()) }
                                td.text { (part.claim) }
                                (estimate(part.found, number))
                                td.text { span class=(part.outcome.as_str()) { (part.outcome.as_str()) } }
                            } }
                        }))
                    }
                }
            }
        }
    }

    fn block(&self, number: usize) -> Markup {
        let block = &self.data.blocks[number];
        let best = best(self.data, number);
        let own = self.data.metrics.iter().filter_map(|metric| match metric {
            Metric::Own(own) => Some((own.name.as_str(), metric, 2)),
            _ => None,
        });
        let shown = SHOWN
            .iter()
            .map(|(head, metric, digits)| (*head, metric, *digits))
            .chain(own)
            .filter(|(_, metric, _)| {
                **metric != block.primary
                    && self.data.metrics.contains(metric)
                    && !self.data.are_equal(number, metric)
            });
        let shown: Vec<_> = shown.collect();
        html! {
            details open[number == 0] data-about=[about(&[("mission", block.mission.clone()), ("faults", block.faults.clone())])] {
                summary { (block.name()) }
                (table(&html! {
                        th { "allocator" } th { "runs" }
                        th data-about=[measure(&Metric::Completion)] { "complete" } th data-about=[measure(&Metric::Completion)] { "95 %" }
                        th data-about=[measure(&block.primary)] { (block.primary.heading()) }
                        th data-about=[measure(&block.primary)] { "95 %" }
                        @for (head, metric, _) in &shown { th data-about=[measure(metric)] { (head) } }
                        @for head in ["difference to the best", "95 %", "effect", "p"] { th data-about=[measure(&block.primary)] { (head) } }
                    }, &html! {
                    @for (rival, cell) in block.cells.iter().enumerate() {
                        tr.best[best == Some(rival)] {
                            td { (self.data.allocators[rival]) }
                            td { (cell.counted()) @if cell.is_constant { " equal" } @if cell.without_effect > 0 { " (" (cell.without_effect) " not hit)" } @if cell.failed > 0 { " (" (cell.failed) " failed)" } }
                            @if cell.counted() == 0 {
                                td.text colspan=(shown.len() + 8) { "no data: " (why_none(cell.without_effect)) "; repeat with: " code { (self.again("cell", cell.number)) } }
                            } @else {
                                (estimate(self.estimate(number, rival, &Metric::Completion), percent))
                                (estimate(self.estimate(number, rival, &block.primary), |value| in_unit(&block.primary, value)))
                                @for (_, metric, digits) in &shown {
                                    (self.value(number, rival, metric, *digits))
                                }
                                (self.against_best(number, rival, best))
                            }
                        }
                    }
                }))
            }
        }
    }

    fn summary(&self, block: usize, rival: usize, place: usize) -> Option<Summary> {
        self.analysis.blocks[block].summaries[rival][place]
    }

    /// Returns the mean of a metric with its interval.
    fn estimate(&self, block: usize, rival: usize, metric: &Metric) -> Option<(f64, Interval)> {
        let summary = self.summary(block, rival, self.data.metric_index(metric));
        summary.map(|found| (found.mean, found.interval))
    }

    /// Returns the cell with the mean of a metric. The best one of its block has its interval below it.
    fn value(&self, block: usize, rival: usize, metric: &Metric, digits: usize) -> Markup {
        let scale = match metric {
            Metric::Bytes | Metric::Energy => 1000.0,
            Metric::Gap => 0.01,
            _ => 1.0,
        };
        let Some(summary) = self.summary(block, rival, self.data.metric_index(metric)) else {
            return html! { td { "–" } };
        };
        let (mean, interval) = (summary.mean, summary.interval);
        // Runs without a value, such as the makespan of an incomplete run, make the mean one of a selection.
        let cell = &self.data.blocks[block].cells[rival];
        let counted = cell.counted();
        let selected = (!cell.is_constant && summary.n < counted)
            .then(|| format!("in {} of {counted}", summary.n));
        let shown = |value: f64| format!("{:.digits$}", value / scale);
        let interval = format!("{} – {}", shown(interval.0), shown(interval.1));
        let rivals = 0..self.data.allocators.len();
        let means = rivals.filter(|rival| Some(*rival) != self.data.reference);
        let means = means.filter_map(|rival| Some(self.estimate(block, rival, metric)?.0));
        let best = means.map(|mean| metric.sign() * mean).reduce(f64::min);
        let is_best = best.is_some_and(|best| metric.sign() * mean <= best);
        html! {
            td.least[is_best] title={ "95 %: " (interval) } {
                (shown(mean)) @if is_best { " " small { (interval) } } @if let Some(selected) = &selected { " " small { (selected) } }
            }
        }
    }

    fn against_best(&self, block: usize, rival: usize, best: Option<usize>) -> Markup {
        let pair = best.and_then(|best| self.analysis.decided(self.data, block, (best, rival)));
        html! {
            @match pair {
                _ if best == Some(rival) => { td.text colspan="4" { "the best" } },
                Some((metric, pair)) if pair.n > 0 => {
                    (estimate(pair.mean, |value| in_unit(metric, value)))
                    td { (format!("{:.2}", pair.effect)) }
                    td { (pair.adjusted.map_or_else(|| "exact".to_owned(), p_value).trim_start_matches("= ")) }
                },
                _ => { td.text colspan="4" { "–" } },
            }
        }
    }

    fn downloads(&self) -> Markup {
        html! {
            (heading("All numbers"))
            ul {
                li { "runs: one row per run: " a href="results.csv" { "results.csv" } ", " a href="results.parquet" { "results.parquet" } }
                li { "the table of means for LaTeX: " a href=(LATEX) { (LATEX) } }
                li { "the figures' numbers, drawn with matplotlib: " a href=(SCRIPT) { (SCRIPT) } }
                @for table in self.tables {
                    li {
                        (table.name) ": " (table.description) ": "
                        a href=(format!("{}.csv", table.name)) { (table.name) ".csv" } ", "
                        a href=(format!("{}.parquet", table.name)) { (table.name) ".parquet" }
                    }
                }
            }
        }
    }

    fn again(&self, option: &str, number: usize) -> String {
        let plan = shell_quoted(Path::new(&format!("{}.toml", self.name)));
        format!("alliance compare {plan} --{option} {number}")
    }

    fn repeat(&self) -> Markup {
        html! {
            (heading("Repeat"))
            p {
                "Run these commands in the folder of the plan. All runs of a cell (cells.csv lists the numbers): " code { (self.again("cell", 0)) } ". The scenario of one run and the command that runs it: "
                code { (self.again("scenario", 0)) } ". A copy of the plan: " a href="plan.toml" { "plan.toml" } "."
            }
        }
    }

    fn definitions(&self) -> Markup {
        html! {
            (heading("Definitions"))
            dl {
                @for metric in &self.data.metrics {
                    @if !matches!(metric, Metric::MessagesOf(_) | Metric::BytesOf(_)) { dt { (metric.name()) } dd { (metric.meaning()) } }
                }
                dt { "primary" } dd { "The measure that ranks the runs of a mission: the one that the plan states, or that the mission declares for its scenario: PAR2, finished work (done), or an own figure. If all allocators of a block are equal by it, the first measure of the outcome in which they differ decides, and PAR2 decides between equal ones." }
                dt { "censored" } dd { "A run that reaches its limit before the mission is complete is censored: its makespan is at least the limit, and not known. PAR2 (penalized average runtime) counts it as twice the limit, so no run is left out. A mean of makespans has only the complete runs." }
                dt { "effect" } dd { "The matched-pairs rank-biserial correlation: the share of rank sums in favor of one side, less that of the other. 1 or -1: one allocator is better with every seed; 0: neither. Unlike p, it does not grow with the number of seeds." }
                dt { "correction" } dd { "Of 20 tests without any difference, one is below 0.05 by chance. Holm's correction raises the p values of a block so that this risk holds for all pairs together." }
                dt { "no data" } dd { "A run whose faults had no effect does not count, and its seed is omitted from pairs. A cell without counted runs has no data." }
                dt { "equal" } dd { "The seed has no effect: all runs of the cell have the same figures and count as one run. The difference of two such cells is exact, and no test applies." }
                dt { "intervals" } dd { "95 % intervals: percentiles of 10,000 bootstrap resamples of the paired seeds; for completion Wilson's interval; for mean ranks resamples of the blocks." }
                dt { "ranks" } dd { "Ranks of the allocators' means within each block. The sample consists of blocks, so more seeds do not enlarge it." }
            }
        }
    }
}

/// Returns the attribute of a column of a metric.
fn measure(metric: &Metric) -> Option<String> {
    about(&[("measure", metric.name())])
}

/// Formats a value of a block's primary metric.
fn in_unit(metric: &Metric, value: f64) -> String {
    let digits = match metric {
        Metric::Own(_) => 3,
        _ => 1,
    };
    format!("{value:.digits$}")
}

fn why_none(unhit: usize) -> &'static str {
    if unhit > 0 {
        "the fault never hit"
    } else {
        "every run failed"
    }
}
