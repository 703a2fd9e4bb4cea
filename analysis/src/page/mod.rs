//! The frame, tables and figures of result pages. A page opens from disk and needs no other file.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::figures::{Figure, files};

/// The style of all pages. Wide tables scroll; figures stay on white in dark mode, so their captions' colors are right; print
/// shows all details.
const STYLE: &str = include_str!("page.css");

/// The additional style of pages with tables that need a landscape sheet.
pub const LANDSCAPE: &str = include_str!("landscape.css");

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
            body { main { (body) } }
        }
    };
    page.into_string()
}

/// Returns the heading of a part, which [`contents`] links.
#[must_use]
pub fn heading(title: &str) -> Markup {
    let letters = title
        .chars()
        .filter(|letter| !letter.is_ascii_punctuation());
    let anchor = letters.collect::<String>().to_lowercase().replace(' ', "-");
    html! { h2 id=(anchor) { (title) } }
}

/// Returns links to all headings in the `parts` of a page, in their order.
#[must_use]
pub fn contents(parts: &Markup) -> Markup {
    let headings = parts.0.split("<h2 id=\"").skip(1).filter_map(|rest| {
        let (anchor, rest) = rest.split_once("\">")?;
        let (title, _) = rest.split_once("</h2>")?;
        Some((anchor, title))
    });
    html! {
        nav aria-label="Contents" {
            @for (anchor, title) in headings { a href={ "#" (anchor) } { (PreEscaped(title)) } " " }
        }
    }
}

/// Returns a figure with its caption and links to its files beside the page.
#[must_use]
pub fn drawing(figure: &Figure) -> Markup {
    html! {
        figure id=(figure.name) data-about=[about(&figure.about)] {
            (scrolled(&figure.svg))
            figcaption {
                (figure.caption) " "
                span.files { @for (format, file) in files::names(figure) { a href=(file) download { (format) } " " } }
            }
        }
    }
}

/// Returns a drawing that scrolls where the page is too narrow for legible letters, also by keys.
#[must_use]
pub fn scrolled(svg: &str) -> Markup {
    let width = svg
        .split_once("width=\"")
        .and_then(|(_, rest)| rest.split_once('"'));
    let width = width.map(|(width, _)| format!("--drawn: {width}px"));
    html! {
        div.drawing style=[width] tabindex="0" role="group" aria-label="Drawing" { (PreEscaped(svg)) }
    }
}

/// Returns the attribute of a part of a page that can be chosen: the mission, the measure and so on that it shows, as JSON.
/// Returns `None` for a part that is always shown.
#[must_use]
pub fn about(keys: &[(&str, String)]) -> Option<String> {
    let keys: serde_json::Map<_, _> = keys
        .iter()
        .map(|(key, value)| ((*key).to_owned(), value.as_str().into()))
        .collect();
    (!keys.is_empty()).then(|| serde_json::Value::from(keys).to_string())
}

/// Returns the place of the controls that choose parts of the page. The script of [`choosing`] fills it.
#[must_use]
pub fn choice() -> Markup {
    html! { form.choice hidden aria-label="Shown parts" {} }
}

/// Returns the script of [`choice`], for the end of the page.
#[must_use]
pub fn choosing() -> Markup {
    html! { script { (PreEscaped(include_str!("choose.js"))) } }
}

/// Returns the script that makes the tables of a page sortable. Without it, tables keep their order.
#[must_use]
pub fn sorting() -> Markup {
    html! { script { (PreEscaped(include_str!("sort.js"))) } }
}

/// Returns the script that shows the hints of figures at once, also by keys. Without it, the browser shows them.
#[must_use]
pub fn hinting() -> Markup {
    html! { script type="module" { (PreEscaped(include_str!("hints.js"))) } }
}

/// Returns a table that scrolls if it is too wide, also by keys.
#[must_use]
pub fn table(head: &Markup, rows: &Markup) -> Markup {
    html! {
        div.wide tabindex="0" role="group" aria-label="Table" { table { thead { tr { (head) } } tbody { (rows) } } }
    }
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

/// Formats a number of any size with about four digits. A number that is shown as 0 has no sign.
#[must_use]
pub fn number(value: f64) -> String {
    let digits = if value.abs() < 10.0 { 3 } else { 1 };
    let text = format!("{value:.digits$}");
    match text.strip_prefix('-') {
        Some(zero) if zero.chars().all(|digit| "0.".contains(digit)) => zero.to_owned(),
        _ => text,
    }
}

/// Formats a share as percent.
#[must_use]
pub fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_a_page_names_what_it_is_about() {
        let keys = [
            ("mission", "a \"b\"".to_owned()),
            ("faults", "none".to_owned()),
        ];
        let attribute = about(&keys).unwrap();
        assert_eq!(attribute, r#"{"faults":"none","mission":"a \"b\""}"#);
        assert_eq!(about(&[]), None);
    }

    #[test]
    fn a_zero_has_no_sign() {
        let shown = [-0.0, -0.0004, -0.0006, -12.34].map(number);
        assert_eq!(shown, ["0.000", "0.000", "-0.001", "-12.3"]);
    }

    #[test]
    fn the_contents_link_the_headings_of_the_parts() {
        let parts = html! { (heading("Events: reported")) p { "none" } (heading("A & B")) };
        let links: Vec<_> = [
            ("#events-reported", "Events: reported"),
            ("#a--b", "A &amp; B"),
        ]
        .map(|(href, title)| format!("<a href=\"{href}\">{title}</a> "))
        .into();
        let nav = format!("<nav aria-label=\"Contents\">{}</nav>", links.concat());
        assert_eq!(contents(&parts).into_string(), nav);
        assert!(
            parts
                .into_string()
                .contains("<h2 id=\"a--b\">A &amp; B</h2>")
        );
    }

    #[test]
    fn a_drawing_is_not_enlarged_beyond_its_size() {
        let markup = scrolled("<svg width=\"350\" height=\"10\"></svg>").into_string();
        assert!(
            markup.contains("style=\"--drawn: 350px\" tabindex=\"0\""),
            "{markup}"
        );
    }

    #[test]
    fn figures_keep_their_colors_in_dark_mode() {
        let page = document("title", LANDSCAPE, &html! {});
        let (_, dark) = page.split_once("(prefers-color-scheme: dark)").unwrap();
        assert!(dark.contains("figure svg { background: #fff;"), "{dark}");
        assert!(!page.contains("invert("), "{page}");
    }
}
