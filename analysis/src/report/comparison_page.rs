//! The page of two runs: the verdicts and the first difference, then both runs side by side.

use maud::{Markup, html};

use super::page::{InlineFigures, RunSection, definitions, facts, tables, undrawn};
use super::verdict::verdict;
use crate::distinct;
use crate::page::{document, table};

/// The folders of both runs' figures, relative to the page.
pub const SIDES: [&str; 2] = ["a", "b"];

/// The style for two columns, which are stacked on narrow screens.
const STYLE: &str = include_str!("comparison_page.css");

/// Returns the page and the number of figures left out. `difference` describes the first difference.
#[must_use]
pub fn page_of_two(
    names: &[String; 2],
    parts: &[RunSection<'_>; 2],
    difference: &str,
) -> (String, usize) {
    let [a, b] = parts;
    let mut frames = InlineFigures::new();
    let pairs: Vec<Markup> = figure_names(parts)
        .into_iter()
        .map(|name| {
            let [left, right] = [0, 1].map(|side| {
                let mut figures = parts[side].figures.iter();
                match figures.find(|figure| figure.name == name) {
                    Some(figure) => frames.put(figure, &format!("{}/", SIDES[side])),
                    None => html! { p.note { "This run has no figure " (name) "." } },
                }
            });
            beside(&left, &right)
        })
        .collect();
    let (first, rest) = pairs.split_at(pairs.len().min(1));
    let title = format!("{} and {}", names[0], names[1]);
    let [left, right] = [0, 1].map(|side| {
        let part = &parts[side];
        html! {
            h2 { (["A", "B"][side]) ": " (names[side]) }
            ul.answer { @for sentence in verdict(part.run, part.history, part.metrics) { li { (sentence) } } }
        }
    });
    let body = html! {
        h1 { "Two runs" }
        @if let Some(window) = &a.made.window { p.note { "Figures show the runs " (window) "; tables show the whole runs." } }
        (beside(&left, &right))
        h2 { "First difference" }
        p { @for line in difference.lines() { (line) br; } }
        @for pair in first { (pair) }
        (both(a, b))
        @for ((title, left), (_, right)) in tables(a).iter().zip(&tables(b)) {
            h2 { (title) }
            (beside(left, right))
        }
        h2 { "Figures" }
        @for pair in rest { (pair) }
        (beside(&undrawn(&a.undrawn), &undrawn(&b.undrawn)))
        (definitions())
    };
    (document(&title, STYLE, &body), frames.left_out)
}

fn beside(left: &Markup, right: &Markup) -> Markup {
    html! { div.two { div { (left) } div { (right) } } }
}

/// Returns the names of the figures of either run, in the order of the first page.
fn figure_names<'p>(parts: &'p [RunSection<'_>; 2]) -> Vec<&'p str> {
    let figures = parts.iter().flat_map(|part| &part.figures);
    distinct(figures.map(|figure| figure.name.as_str()))
}

/// Returns the facts of both runs. Differing values are highlighted.
fn both(a: &RunSection<'_>, b: &RunSection<'_>) -> Markup {
    let (of_a, of_b) = (facts(a), facts(b));
    let value = |facts: &[(String, Markup)], name: &str| {
        let mut found = facts.iter().filter(|(other, _)| other == name);
        found
            .next()
            .map_or_else(|| "–".to_owned(), |(_, value)| value.0.clone())
    };
    let names = distinct(of_a.iter().chain(&of_b).map(|(name, _)| name.as_str()));
    html! {
        (table(&html! { th { "fact" } th.text { "A" } th.text { "B" } }, &html! {
            @for name in names {
                @let (left, right) = (value(&of_a, name), value(&of_b, name));
                tr.differs[left != right] {
                    td { (name) }
                    td.text { (maud::PreEscaped(&left)) }
                    td.text { (maud::PreEscaped(&right)) }
                }
            }
        }))
    }
}
