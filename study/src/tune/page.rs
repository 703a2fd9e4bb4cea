//! The result as a page that needs no other: first what was found and whether it is better.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::command::{Result, TUNED};
use super::importance::importance;
use super::search::Method;
use super::task::Task;
use super::verdict::Verdict;
use crate::compare::page::LOOKS;
use crate::page_head::head;
use crate::report::figures::Figure;

/// What is on the page.
pub struct Page<'p> {
    /// Its name.
    pub name: &'p str,
    /// What was tuned, by what.
    pub task: &'p Task,
    /// By allocator.
    pub results: &'p [Result<'p>],
    /// By allocator.
    pub figures: &'p [Vec<Figure>],
}

/// What came of an allocator.
#[must_use]
pub fn sentence(task: &Task, result: &Result<'_>) -> String {
    let verdict = &result.verdicts[result.chosen][0];
    let (percent, (from, to)) = verdict.percent;
    let outcome = if result.is_better() {
        "better than the defaults"
    } else {
        "not shown to be better, so the defaults stay"
    };
    let ratio = if task.metric.more_is_better() {
        "the defaults' share of "
    } else {
        ""
    };
    let unseen = result.verdicts[result.chosen].get(1);
    let unseen = unseen.filter(|_| task.conditions.iter().any(|it| it.is_unseen));
    let unseen = unseen.map_or_else(String::new, |it| {
        let (percent, (from, to)) = it.percent;
        format!("; under faults that the search had not, {percent:+.1} % ({from:+.1} to {to:+.1})")
    });
    format!(
        "{}: {outcome}; what {} found has on {} unseen seeds {ratio}{} {percent:+.1} % ({from:+.1} to {to:+.1}){unseen}; bytes {:+.1} %.",
        result.allocator.name,
        Method::ALL[result.chosen].as_str(),
        verdict.n,
        task.metric.name(),
        verdict.bytes_percent,
    )
}

impl Page<'_> {
    /// The page.
    #[must_use]
    pub fn html(&self) -> String {
        let tuning = &self.task.tuning;
        let question = self.task.plan.question.as_deref();
        let seen: Vec<&str> = self
            .task
            .seen()
            .map(|it| &self.task.conditions[it].name[..])
            .collect();
        let text = html! {
            (DOCTYPE)
            html lang="en" {
                (head(&format!("Tuning {}", self.name), LOOKS))
                body {
                    h1 { "Tuning " (self.name) }
                    p.question { (question.unwrap_or("Which parameters are good, and how much better are they than the defaults?")) }
                    ul.answer { @for result in self.results { li { (sentence(self.task, result)) } } }
                    p.note {
                        "Searched for: little " (self.task.metric.name())
                        @if self.task.metric.more_is_better() { " lost" }
                        ", as the mean logarithm of its ratio to that of the defaults in the same runs, over " (seen.len()) " conditions ("
                        (seen.join("; ")) "), which weigh the same"
                        @if tuning.bytes_weight > 0.0 { "; and " (tuning.bytes_weight) " times that of the bytes" }
                        ". Each method had " (tuning.budget) " runs, on " (tuning.training.0.len()) " training seeds, of which a candidate has at most "
                        (tuning.seeds_per_candidate) "; its best " (tuning.finalists) " met on " (tuning.selection.0.len())
                        " selection seeds, and the best of these is judged here on " (tuning.test.0.len())
                        " test seeds. No seed is in two of these. Intervals are of 95 %, by the bootstrap over seeds."
                    }
                    p.note { "The scenario: " a href=(TUNED) { (TUNED) } ". All numbers: " a href="test.csv" { "test.csv" } ", " a href="candidates.csv" { "candidates.csv" } "." }
                    @for (result, figures) in self.results.iter().zip(self.figures) { (allocator(result, figures)) }
                }
            }
        };
        text.into_string()
    }
}

fn allocator(result: &Result<'_>, figures: &[Figure]) -> Markup {
    let importance = importance(&result.tuned.candidates);
    let parameters = &result.allocator.parameters;
    html! {
        h2 { (result.allocator.name) }
        div.wide { table {
            thead { tr {
                th.text { "parameter" } th.text { "searched" }
                @for method in Method::ALL { th { (method.as_str()) } }
                th { "η²" } th { "by chance" } th { "Spearman's ρ" }
            } }
            tbody {
                @for (place, parameter) in parameters.iter().enumerate() {
                    tr {
                        td.text { (parameter.key) }
                        td.text { (parameter.bounds(parameters)) }
                        @for method in [0, 1] { td { (result.tuned.best(method).values[place]) } }
                        @match importance.get(place) {
                            Some(it) => {
                                td { (format!("{:.2}", it.share)) } td { (format!("{:.2}", it.by_chance)) }
                                td { (format!("{:+.2}", it.correlation)) }
                            }
                            None => { td {} td {} td {} }
                        }
                    }
                }
            }
        } }
        p.note {
            "η² is the share of the variance of random search's scores that lies between five equal parts of the parameter's range, by chance that of one "
            "that does not matter; Spearman's ρ says which way: positive, more of it is worse. Both go by one parameter at a time: what two do together "
            "they do not tell."
        }
        @for figure in figures {
            figure {
                (PreEscaped(&figure.svg))
                figcaption { (figure.caption) " " a href=(format!("{}.svg", figure.name)) { (figure.name) ".svg" } }
            }
        }
        @for method in [0, 1] { (test(result, method)) }
    }
}

fn test(result: &Result<'_>, method: usize) -> Markup {
    html! {
        details open[method == result.chosen] {
            summary { "Test seeds, best of " (Method::ALL[method].as_str()) @if method == result.chosen { ": the better one on the selection seeds" } }
            div.wide { table {
                thead { tr {
                    th.text { "condition" } th { "default" } th { "tuned" } th { "difference" } th { "95 %" }
                    th { "by the mean of logarithms" } th { "95 %" } th { "bytes" }
                } }
                tbody { @for verdict in &result.verdicts[method] { (row(verdict)) } }
            } }
        }
    }
}

fn row(verdict: &Verdict) -> Markup {
    let (percent, (from, to)) = verdict.percent;
    html! {
        tr {
            td.text { (verdict.what) }
            @match verdict.means {
                Some((default, tuned)) => { td { (number(default)) } td { (number(tuned)) } }
                None => { td {} td {} }
            }
            @match verdict.difference {
                Some((found, (from, to))) => { td { (number(found)) } td { (number(from)) " to " (number(to)) } }
                None => { td {} td {} }
            }
            td { (format!("{percent:+.1} %")) } td { (format!("{from:+.1} to {to:+.1}")) }
            td { (format!("{:+.1} %", verdict.bytes_percent)) }
        }
    }
}

/// With as many digits as say something.
fn number(value: f64) -> String {
    if value.abs() < 10.0 {
        format!("{value:.3}")
    } else {
        format!("{value:.1}")
    }
}
