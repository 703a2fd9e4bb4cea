//! The common head of result pages. A page opens from disk and needs no other file.

use maud::{Markup, PreEscaped, html};

/// The common style of pages with figures and tables.
const STYLE: &str = "
:root { color-scheme: light dark; --ink: #222; --paper: #fff; --soft: #444; --line: #ccc; --edge: #555 }
body { font: 16px/1.45 sans-serif; color: var(--ink); background: var(--paper); max-width: 62rem; margin: 2rem auto; padding: 0 1rem }
h1 { font-size: 1.5rem } h2 { font-size: 1.2rem; margin-top: 2.5rem }
table { border-collapse: collapse; margin: .8rem 0; font-size: .9rem }
th, td { padding: .2rem .7rem; border-bottom: 1px solid var(--line); text-align: right; vertical-align: top }
th:first-child, td:first-child, td.text, th.text { text-align: left }
thead th { border-bottom: 2px solid var(--edge) }
dl { font-size: .9rem } dt { font-weight: bold; margin-top: .4rem } dd { margin-left: 1.2rem }
code { overflow-wrap: anywhere }
figure { margin: 1.5rem 0; break-inside: avoid } figure svg { max-width: 100%; height: auto }
figcaption, .note { font-size: .9rem; color: var(--soft) }
@media screen and (max-width: 40rem) { table { display: block; overflow-x: auto } }
@media screen and (prefers-color-scheme: dark) {
  :root { --ink: #ddd; --paper: #17191c; --soft: #aaa; --line: #3a3f45; --edge: #888 }
  figure svg { filter: invert(.91) hue-rotate(180deg) }
}
@media print {
  body { font-size: 10pt; max-width: none; margin: 0; padding: 0 }
  h2 { break-after: avoid } tr { break-inside: avoid } figure svg { max-height: 24cm }
}
";

/// Returns the head of a page with `title`. `further` contains additional style rules.
pub fn head(title: &str, further: &str) -> Markup {
    html! {
        head {
            meta charset="utf-8";
            meta name="viewport" content="width=device-width";
            title { (title) }
            style { (PreEscaped(STYLE)) (PreEscaped(further)) }
        }
    }
}
