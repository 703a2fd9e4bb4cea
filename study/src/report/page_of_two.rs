//! The page of two runs: what differs first, and all of both side by side.

use maud::{DOCTYPE, Markup, html};

use super::page::{Frames, Part, definitions, facts, tables};
use crate::page_head::head;

/// Folders of the figures beside the page.
pub const SIDES: [&str; 2] = ["a", "b"];

/// Two columns, or one below the other where there is no room for both.
const STYLE: &str = "
body { max-width: 126rem }
.two { display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 0 2rem; align-items: start }
.two table { display: block; overflow-x: auto }
tr.differs td { font-weight: bold }
@media (max-width: 50rem) { .two { grid-template-columns: minmax(0, 1fr) } }
";

/// The page, and how many figures had no room in it; `difference` says in words what differs first.
#[must_use]
pub fn page_of_two(
    names: &[String; 2],
    parts: &[Part<'_>; 2],
    difference: &str,
) -> (String, usize) {
    let [a, b] = parts;
    let mut frames = Frames::new();
    let pairs: Vec<Markup> = figure_names(parts)
        .into_iter()
        .map(|name| {
            let [left, right] = [0, 1].map(|side| {
                let mut figures = parts[side].figures.iter();
                match figures.find(|figure| figure.name == name) {
                    Some(figure) => frames.put(figure, &format!("{}/", SIDES[side])),
                    None => html! { p.note { "There is no " (name) " of this run." } },
                }
            });
            beside(&left, &right)
        })
        .collect();
    let (first, rest) = pairs.split_at(pairs.len().min(1));
    let title = format!("{} and {}", names[0], names[1]);
    let [left, right] = [0, 1].map(|side| html! { h2 { (["A", "B"][side]) ": " (names[side]) } });
    let text = html! {
        (DOCTYPE)
        html lang="en" {
            (head(&title, STYLE))
            body {
                h1 { "Two runs" }
                p { @for line in difference.lines() { (line) br; } }
                @if let Some(window) = &a.made.window { p.note { "Figures show the runs " (window) ", tables all of them." } }
                (beside(&left, &right))
                @for pair in first { (pair) }
                (both(a, b))
                @for ((title, left), (_, right)) in tables(a).iter().zip(&tables(b)) {
                    h2 { (title) }
                    (beside(left, right))
                }
                h2 { "Figures" }
                @for pair in rest { (pair) }
                h2 { "What is counted" }
                (definitions())
            }
        }
    };
    (text.into_string(), frames.left_out)
}

fn beside(left: &Markup, right: &Markup) -> Markup {
    html! { div.two { div { (left) } div { (right) } } }
}

/// Names of the figures of either run, in the order of the first one's page.
fn figure_names<'p>(parts: &'p [Part<'_>; 2]) -> Vec<&'p str> {
    let mut names: Vec<&str> = Vec::new();
    for figure in parts.iter().flat_map(|part| &part.figures) {
        if !names.contains(&figure.name.as_str()) {
            names.push(&figure.name);
        }
    }
    names
}

/// What both were and what came of them; what is not the same stands out.
fn both(a: &Part<'_>, b: &Part<'_>) -> Markup {
    let (of_a, of_b) = (facts(a), facts(b));
    let value = |facts: &[(String, Markup)], name: &str| {
        let mut found = facts.iter().filter(|(other, _)| other == name);
        found
            .next()
            .map_or_else(|| "–".to_owned(), |(_, value)| value.0.clone())
    };
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in of_a.iter().chain(&of_b) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    html! {
        table {
            thead { tr { th { } th.text { "A" } th.text { "B" } } }
            tbody {
                @for name in names {
                    @let (left, right) = (value(&of_a, name), value(&of_b, name));
                    tr.differs[left != right] {
                        td { (name) }
                        td.text { (maud::PreEscaped(&left)) }
                        td.text { (maud::PreEscaped(&right)) }
                    }
                }
            }
        }
    }
}
