//! The result as a self-contained HTML page.

use maud::{Markup, html};
use terminal::counted;

use super::plan::{Budget, HuntPlan};
use super::results::{Shown, command, faults_text, method, sentence};
use crate::page::{LANDSCAPE, document, table};

/// Returns the page of a hunt.
#[must_use]
pub fn html(name: &str, plan: &HuntPlan, results: &[Shown<'_>]) -> String {
    let title = format!("Hunt {name}");
    let question = plan.question.as_deref();
    let violations = plan.conditions.violations.iter();
    let violations: Vec<&str> = violations.map(|kind| kind.as_str()).collect();
    let budget = match plan.budget {
        Budget::Runs(runs) => counted(runs, "run"),
        Budget::Seconds(seconds) => format!("{seconds} s"),
    };
    let body = html! {
        h1 { (title) }
        p.question { (question.unwrap_or("Which faults break an allocator?")) }
        ul.answer { @for shown in results { li { (sentence(plan, shown)) } } }
        p.note {
            @if plan.maximizes_par2 { "Objective: the worst PAR2 time." } @else { "Violations: " (violations.join(", ")) "." }
            " Each search had " (budget) ", on " (counted(plan.seeds.len(), "seed")) ", with " (plan.faults.min) " to "
            (plan.faults.max) " faults of " (counted(plan.faults.names.len(), "kind")) ", begun by " (plan.faults.until_s)
            " s. The uniform search is the control. All numbers: " a href="results.csv" { "results.csv" } "."
        }
        (overview(results))
        @for shown in results { (details(shown)) }
    };
    document(&title, LANDSCAPE, &body)
}

fn overview(results: &[Shown<'_>]) -> Markup {
    let head = html! {
        th.text { "allocator" } th.text { "search" } th { "runs" } th { "states" } th.text { "violation" } th { "in run" }
        th { "faults found" } th { "faults left" } th { "robots left" } th { "runs to shrink" }
    };
    let rows = html! {
        @for shown in results {
            tr {
                td.text { (shown.result.allocator) } td.text { (method(shown.search)) }
                td { (shown.search.runs) } td { (shown.search.states) }
                @match &shown.finding {
                    Some((finding, _)) => {
                        td.text { (finding.kind) } td { (finding.run) } td { (finding.case.faults.len()) }
                        td { (finding.shrunk.case.faults.len()) } td { (finding.shrunk.case.scenario.robots.len()) }
                        td { (finding.shrunk.runs) }
                    },
                    None => { td.text { "–" } td { "–" } td { "–" } td { "–" } td { "–" } td { "–" } },
                }
            }
        }
    };
    table(&head, &rows)
}

fn details(shown: &Shown<'_>) -> Markup {
    let Some((finding, files)) = &shown.finding else {
        return html! {};
    };
    let report = format!("{}/report/report.html", files.run);
    let description = finding.shrunk.judgement.violation.as_ref();
    html! {
        h2 { (shown.result.allocator) ", " (method(shown.search)) ": " (finding.kind) }
        @if let Some(found) = description { p { (found.description) } }
        p { "The least faults: " (faults_text(&finding.shrunk.case.faults)) }
        p { "As found: " (faults_text(&finding.case.faults)) }
        pre { (command(finding, &files.least)) }
        p.note {
            a href=(files.least) { (files.least) } ", " a href=(files.found) { (files.found) } ", "
            a href=(report) { "report of the least run" }
        }
    }
}
