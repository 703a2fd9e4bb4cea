//! The frame, tables and figures of result pages. A page opens from disk and needs no other file.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::figures::Figure;

/// The style of all pages. Wide tables scroll; figures stay on white in dark mode, so their captions' colors are right; print
/// shows all details.
const STYLE: &str = "
:root { color-scheme: light dark; --ink: #222; --paper: #fff; --soft: #444; --line: #ccc; --edge: #555; --good: #1a6e3c; --bad: #a32020; --open: #6a5400 }
body { font: 16px/1.45 sans-serif; color: var(--ink); background: var(--paper); max-width: 62rem; margin: 2rem auto; padding: 0 1rem }
h1 { font-size: 1.5rem } h2 { font-size: 1.2rem; margin-top: 2.5rem }
table { border-collapse: collapse; margin: .8rem 0; font-size: .9rem }
th, td { padding: .2rem .7rem; border-bottom: 1px solid var(--line); text-align: right; vertical-align: top }
th:first-child, td:first-child, td.text, th.text { text-align: left }
thead th { border-bottom: 2px solid var(--edge) }
.wide { overflow-x: auto } .wide td:not(.text) { white-space: nowrap }
dl { font-size: .9rem } dt { font-weight: bold; margin-top: .4rem } dd { margin-left: 1.2rem }
code { font-size: .85rem; overflow-wrap: anywhere } summary { cursor: pointer; margin: .4rem 0; font-weight: bold }
figure { margin: 1.5rem 0; break-inside: avoid; overflow-x: auto } figure svg { max-width: 100%; height: auto }
figcaption, .note { font-size: .9rem; color: var(--soft) }
.question { font-size: 1.15rem; font-style: italic } .answer li { margin: .4rem 0 }
.held { color: var(--good) } .failed { color: var(--bad) } .undecided { color: var(--open) } .held, .failed, .undecided { font-weight: bold }
@media screen and (max-width: 40rem) { table { display: block; overflow-x: auto } }
@media screen and (prefers-color-scheme: dark) {
  :root { --ink: #ddd; --paper: #17191c; --soft: #aaa; --line: #3a3f45; --edge: #888; --good: #6fcf97; --bad: #ff8a80; --open: #e6c65c }
  figure svg { background: #fff; border-radius: .3rem }
}
@media print {
  body { font-size: 10pt; max-width: none; margin: 0; padding: 0 }
  h2 { break-after: avoid } tr { break-inside: avoid } figure svg { max-height: 24cm }
  .wide, figure { overflow: visible } details::details-content { content-visibility: visible; height: auto }
}
";

/// The additional style of pages with tables that need a landscape sheet.
pub const LANDSCAPE: &str = "
figure svg { min-width: 34rem }
@page { size: landscape; margin: 12mm }
@media print { figure svg { min-width: 0 } table { font-size: 7pt } th, td { padding: .1rem .2rem } }
";

/// Returns a page. `style` contains additional rules.
#[must_use]
pub fn document(title: &str, style: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width";
                title { (title) }
                style { (PreEscaped(STYLE)) (PreEscaped(style)) }
            }
            body { (body) }
        }
    };
    page.into_string()
}

/// Returns a figure with its caption and a link to its file beside the page.
#[must_use]
pub fn drawing(figure: &Figure) -> Markup {
    let file = format!("{}.svg", figure.name);
    html! {
        figure {
            (PreEscaped(&figure.svg))
            figcaption { (figure.caption) " " a href=(file) { (file) } }
        }
    }
}

/// Returns a table that scrolls if it is too wide.
#[must_use]
pub fn table(head: &Markup, rows: &Markup) -> Markup {
    html! { div.wide { table { thead { tr { (head) } } tbody { (rows) } } } }
}

/// Returns two cells: a value and its interval.
#[must_use]
pub fn estimate(found: Option<(f64, (f64, f64))>, shown: impl Fn(f64) -> String) -> Markup {
    html! {
        @match found {
            Some((value, (from, to))) => { td { (shown(value)) } td { (shown(from)) " – " (shown(to)) } },
            None => { td { "–" } td { "–" } },
        }
    }
}

/// Formats a number of any size with about four digits.
#[must_use]
pub fn number(value: f64) -> String {
    let digits = if value.abs() < 10.0 { 3 } else { 1 };
    format!("{value:.digits$}")
}

/// Formats a share as percent.
#[must_use]
pub fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// Returns definitions of terms.
#[must_use]
pub fn definitions(terms: &[(&str, &str)]) -> Markup {
    html! {
        h2 { "Definitions" }
        dl { @for (term, meaning) in terms { dt { (term) } dd { (meaning) } } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_keep_their_colors_in_dark_mode() {
        let page = document("title", LANDSCAPE, &html! {});
        let (_, dark) = page.split_once("(prefers-color-scheme: dark)").unwrap();
        assert!(dark.contains("figure svg { background: #fff;"), "{dark}");
        assert!(!page.contains("invert("), "{page}");
    }
}
