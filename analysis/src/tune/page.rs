//! The result as a self-contained HTML page that starts with the best values and their improvement.

use maud::{Markup, html};
use terminal::counted;

use super::importance::importance;
use super::search::Method;
use super::task::Task;
use super::verdict::{AllocatorResult, TUNED, TestComparison};
use crate::figures::Figure;
use crate::page::{LANDSCAPE, document, drawing, estimate, number, table};

pub struct Page<'p> {
    pub name: &'p str,
    pub task: &'p Task,
    pub results: &'p [AllocatorResult<'p>],
    pub figures: &'p [Vec<Figure>],
}

/// Returns the result of an allocator in one sentence.
#[must_use]
pub fn sentence(task: &Task, result: &AllocatorResult<'_>) -> String {
    let verdict = &result.verdicts[result.chosen][0];
    let (percent, (from, to)) = verdict.percent;
    let outcome = if result.is_better() {
        "better than the defaults"
    } else {
        "no significant improvement, so the defaults are kept"
    };
    let ratio = if task.metric.more_is_better() {
        "the inverse of "
    } else {
        ""
    };
    let unseen = result.verdicts[result.chosen].get(1);
    let unseen = unseen.filter(|_| task.conditions.iter().any(|condition| condition.is_unseen));
    let unseen = unseen.map_or_else(String::new, |verdict| {
        let (percent, (from, to)) = verdict.percent;
        format!(", under unseen faults by {percent:+.1} % ({from:+.1} to {to:+.1})")
    });
    format!(
        "{}: {outcome}. The values found by {} change, on {} unseen seeds, {ratio}{} by {percent:+.1} % ({from:+.1} to {to:+.1}){unseen}; bytes by {:+.1} %.",
        result.allocator.name,
        Method::ALL[result.chosen].as_str(),
        verdict.n,
        task.metric.name(),
        verdict.bytes_percent,
    )
}

impl Page<'_> {
    #[must_use]
    pub fn html(&self) -> String {
        let tuning = &self.task.tuning;
        let question = self.task.plan.question.as_deref();
        let seen: Vec<&str> = self
            .task
            .seen()
            .map(|place| &self.task.conditions[place].name[..])
            .collect();
        let title = format!("Tuning {}", self.name);
        let body = html! {
            h1 { (title) }
            p.question { (question.unwrap_or("Which parameters are good, and how much better are they than the defaults?")) }
            ul.answer { @for result in self.results { li { (sentence(self.task, result)) } } }
            p.note {
                "Objective: " @if self.task.metric.more_is_better() { "maximize " } @else { "minimize " } (self.task.metric.name())
                ", as the mean logarithm of its ratio to the defaults in the same runs, over " (counted(seen.len(), "condition")) " ("
                (seen.join("; ")) ") of equal weight"
                @if tuning.bytes_weight > 0.0 { ", plus " (tuning.bytes_weight) " times that of the bytes" }
                ". Each method had " (counted(tuning.budget, "run")) " on " (counted(tuning.training.0.len(), "training seed")) ", at most "
                (tuning.seeds_per_candidate) " per candidate. Its best " (counted(tuning.finalists, "candidate")) " competed on " (counted(tuning.selection.0.len(), "selection seed"))
                ", and the winner is judged here on " (counted(tuning.test.0.len(), "test seed"))
                ". These sets of seeds are disjoint. Intervals are 95 % bootstrap intervals over the seeds."
            }
            p.note { "Scenario with the best values: " a href=(TUNED) { (TUNED) } ". All numbers: " a href="test.csv" { "test.csv" } ", " a href="candidates.csv" { "candidates.csv" } "." }
            @for (result, figures) in self.results.iter().zip(self.figures) { (allocator(result, figures)) }
        };
        document(&title, LANDSCAPE, &body)
    }
}

fn allocator(result: &AllocatorResult<'_>, figures: &[Figure]) -> Markup {
    let importance = importance(&result.tuned.candidates);
    let parameters = &result.allocator.parameters;
    html! {
        h2 { (result.allocator.name) }
        (table(&html! {
            th.text { "parameter" } th.text { "searched" }
            @for method in Method::ALL { th { (method.as_str()) } }
            th { "η²" } th { "without effect" } th { "Spearman's ρ" }
        }, &html! {
                @for (place, parameter) in parameters.iter().enumerate() {
                    tr {
                        td.text { (parameter.key) }
                        td.text { (parameter.bounds(parameters)) }
                        @for method in [0, 1] {
                            @let values = &result.tuned.best(method).values;
                            td {
                                (values[place])
                                @if let Some(note) = parameter.bound_reached(values, place) { ", " (note) }
                            }
                        }
                        @match importance.get(place) {
                            Some(found) => {
                                td { (format!("{:.2}", found.share)) } td { (format!("{:.2}", found.by_chance)) }
                                td { (format!("{:+.2}", found.correlation)) }
                            }
                            None => { td {} td {} td {} }
                        }
                    }
                }
        }))
        p.note {
            "η² is the share of the variance of random search's scores between five equal parts of the parameter's range; \"without effect\" is its expected "
            "value for a parameter without effect. Spearman's ρ is the direction: positive if larger values are worse. Both consider one parameter at a "
            "time and ignore interactions."
        }
        @for figure in figures { (drawing(figure)) }
        @for method in [0, 1] { (test(result, method)) }
    }
}

fn test(result: &AllocatorResult<'_>, method: usize) -> Markup {
    html! {
        details open[method == result.chosen] {
            summary { "Test seeds, best of " (Method::ALL[method].as_str()) @if method == result.chosen { " (the winner on the selection seeds)" } }
            (table(&html! {
                th.text { "condition" } th { "default" } th { "tuned" } th { "difference" } th { "95 %" }
                th { "from the mean logarithm" } th { "95 %" } th { "bytes" }
            }, &html! { @for verdict in &result.verdicts[method] { (row(verdict)) } }))
        }
    }
}

fn row(verdict: &TestComparison) -> Markup {
    let change = |percent: f64| format!("{percent:+.1} %");
    html! {
        tr {
            td.text { (verdict.condition) }
            @match verdict.means {
                Some((default, tuned)) => { td { (number(default)) } td { (number(tuned)) } }
                None => { td {} td {} }
            }
            (estimate(verdict.difference, number))
            (estimate(Some(verdict.percent), change))
            td { (change(verdict.bytes_percent)) }
        }
    }
}
