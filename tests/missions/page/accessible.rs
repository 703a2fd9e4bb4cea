//! axe-core finds no violation of accessibility on any page, light or dark.

use alliance_tests::harness::Lab;
use alliance_tests::needs::cannot_run;
use alliance_tests::team::Team;
use alliance_tests::testkit::in_repository;
use nix::sys::signal::Signal;

use super::browser::{Browser, LAPTOP};
use super::client::{Page, watch};

/// A plan with two allocators and a crash, for a comparison and a sweep.
const PLAN: &str = "
seeds = 2
limit_s = 60.0

[scenario]
name = 'little'
robots = [{ name = 'blue', side_sensor = true }, { name = 'gold' }]
room = { width_m = 7.0, height_m = 5.0 }
waste = { border_known = true, spills = [{ name = 'only', items = 2 }] }

[grid]
allocator = ['static', 'nearest']

[faults.none]
[faults.gold-dies]
timeline = [{ fault.kill = 'gold', at_s = 4.0 }]

[hypotheses.none-completes]
says = 'No rule completes the mission.'
metric = 'completion'
at_most = 0.9
";

/// Returns the source of axe-core, or `None` if it is not installed and the test may be skipped.
pub fn axe() -> Option<String> {
    let file = in_repository(".ci/node_modules/axe-core/axe.min.js");
    let source = std::fs::read_to_string(file).ok();
    if source.is_none() {
        cannot_run("no axe-core: run `npm ci --prefix .ci`");
    }
    source
}

/// Collects the violations on the pages of one browser.
struct Audit<'b> {
    browser: &'b Browser,
    axe: &'b str,
    found: Vec<String>,
}

impl Audit<'_> {
    fn check(&mut self, page: &str) {
        let found = self.browser.accessibility_violations(self.axe);
        let found = found.into_iter().map(|line| format!("{page}: {line}"));
        self.found.extend(found);
    }

    fn assert_none(self) {
        assert!(self.found.is_empty(), "{}", self.found.join("\n"));
    }
}

#[test]
fn the_live_page_and_the_page_of_a_finished_run_are_accessible() {
    let Some(axe) = axe() else { return };
    let Some(browser) = Browser::start(LAPTOP) else {
        return;
    };
    let mut audit = Audit {
        browser: &browser,
        axe: &axe,
        found: Vec::new(),
    };
    let lab = Lab::new();
    let faults = "timeline = [{ fault.kill = 'gold', at_s = 20.0 }, { fault.drop = { p = 0.3 } }]";
    lab.write("day.toml", format!("[faults]\n{faults}"));
    let arguments = "day.toml --speed max --limit 60 --paused";
    let mut team = Team::start_with_page(&lab, arguments);
    let (page, _) = Page::of(&mut team);
    browser.open(&page.link());
    browser.wait_for(
        "document.body.dataset.state == 'paused' && alliance.view.robots.every(r => r.pid != null)",
    );
    page.control(r#"{"clock": {"step": 800}}"#);
    browser.wait_for("document.body.dataset.tick == '800'");
    for theme in ["light", "dark"] {
        for tab in ["tasks", "events", "messages", "links", "faults"] {
            browser.click(&format!("#tab-{tab}"));
            audit.check(&format!("live page, {theme}, {tab}"));
        }
        browser.click("#new-fault");
        browser.wait_for("document.querySelector('#menu:popover-open') != null");
        audit.check(&format!("live page, {theme}, new fault"));
        // The last button of the menu is followed by its first one.
        browser.eval("[...document.querySelectorAll('#menu button')].at(-1).focus()");
        browser.press('\u{e004}'); // Tab
        browser.wait_for("document.activeElement.matches('#menu [aria-label=Close]')");
        browser.press('\u{e00c}'); // Escape
        browser.choose("#chart-kind", "matrix");
        audit.check(&format!("live page, {theme}, matrix"));
        browser.choose("#chart-kind", "curves");
        browser.click("#help");
        browser.wait_for("document.querySelector('#help-window').open");
        audit.check(&format!("live page, {theme}, help"));
        browser.press('\u{e00c}');
        browser.click("#theme");
    }
    // The options of a tool cover no part of the room.
    let bottom = "document.querySelector('#tool-options').getBoundingClientRect().bottom";
    let top = "document.querySelector('#room').getBoundingClientRect().top";
    for tool in ["obstacle", "fault-waste", "fault-move-waste"] {
        browser.click(&format!("[data-tool-button={tool}]"));
        browser.wait_for("!document.querySelector('#tool-options').hidden");
        assert_eq!(browser.eval(&format!("{bottom} <= {top}")), true, "{tool}");
    }
    page.control(r#"{"clock": {"speed": null}}"#);
    page.control(r#"{"clock": "resume"}"#);
    browser.wait_for("document.body.dataset.state == 'ended'");
    audit.check("live page, ended");
    team.wait().expect(1);

    // A large team has cards with long names of items.
    let large = "--robots 30 --spills 20 --limit 40 --in-process";
    lab.mission("large", large).expect(1);
    for run in ["run", "large"] {
        let (process, page) = watch(&lab, run);
        browser.open(&page.link());
        browser.wait_for("document.body.dataset.mode == 'log' && alliance.view != null");
        browser.focus(".skip");
        browser.press('\u{e007}'); // Enter
        browser.wait_for("document.activeElement.id == 'charts'");
        assert_eq!(browser.eval("document.body.dataset.mode"), "log");
        browser.press('\u{e010}'); // End
        for tab in ["tasks", "events", "messages", "links", "faults"] {
            browser.click(&format!("#tab-{tab}"));
            audit.check(&format!("finished run {run}, {tab}"));
        }
        process.signal(Signal::SIGINT);
        process.wait().expect(0);
    }
    audit.assert_none();
}

#[test]
fn the_pages_of_results_are_accessible() {
    let Some(axe) = axe() else { return };
    let lab = Lab::new();
    lab.write("plan.toml", PLAN);
    let pages = [
        ("report", "one/report/report.html"),
        ("report of two runs", "two/report.html"),
        ("sweep", "sweep/summary.html"),
        ("comparison", "comparison/comparison.html"),
    ];
    lab.mission("one", "--in-process --limit 60").expect(1);
    lab.mission("other", "--in-process --limit 60 --seed 2")
        .expect(1);
    lab.run("report one").expect(0);
    lab.run("report one other --out two").expect(0);
    lab.run("sweep plan.toml --out sweep").expect(0);
    lab.run("compare plan.toml --out comparison").expect(0);
    for start in [Browser::start, Browser::start_dark] {
        let Some(browser) = start(LAPTOP) else {
            return;
        };
        let mut audit = Audit {
            browser: &browser,
            axe: &axe,
            found: Vec::new(),
        };
        let is_dark = browser.eval("matchMedia('(prefers-color-scheme: dark)').matches");
        let theme = if is_dark == true { "dark" } else { "light" };
        for (name, file) in pages {
            browser.open(&format!("file://{}", lab.path(file).display()));
            audit.check(&format!("{name}, {theme}"));
            let overflow = browser.eval(
                "document.documentElement.scrollWidth - document.documentElement.clientWidth",
            );
            assert_eq!(overflow, 0, "{name} scrolls sideways");
            browser.eval(
                "document.querySelectorAll('details').forEach(part => { part.open = true; })",
            );
            audit.check(&format!("{name}, {theme}, opened"));
            if name == "comparison" || name == "sweep" {
                choose_parts(&browser, name == "sweep");
                audit.check(&format!("{name}, {theme}, chosen parts"));
            }
        }
        audit.assert_none();
    }
}

/// Chooses a class of faults and a measure, and checks which parts the page shows. A key shows the first value of a figure.
fn choose_parts(browser: &Browser, is_sweep: bool) {
    let rows = if is_sweep { "tr" } else { "details" };
    let of_choice = |chosen: &str| {
        let script = format!(
            "[...document.querySelectorAll('{rows}[data-about]')].filter(part => {chosen}).length"
        );
        browser.eval(&script)
    };
    let all = of_choice("true");
    assert_eq!(of_choice("!part.hidden"), all);
    let hint = "(() => {
        const drawings = [...document.querySelectorAll('.drawing')];
        const drawing = drawings.find(drawing => drawing.querySelector('rect[aria-label]'));
        drawing.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowRight' }));
        return document.querySelector('output.hint:not([hidden])').value.includes('95 %');
    })()";
    assert_eq!(browser.eval(hint), true, "the hint of a figure");
    browser.focus("th button");
    browser.press('\u{e004}'); // Tab
    let focused = "document.activeElement.matches('th button') && getComputedStyle(document.activeElement).outlineStyle";
    assert_eq!(browser.eval(focused), "solid", "a heading with the focus");
    let first = "document.querySelector('.drawing svg').viewBox.baseVal.height";
    let whole = browser.eval(first).as_f64();
    for (key, value) in [("faults", "gold-dies"), ("measure", "comple")] {
        // A label contains its select. The values of measures differ between the pages.
        let choose = format!(
            "(() => {{
                const label = [...document.querySelectorAll('form.choice label')].find(label => label.textContent.startsWith('{key}'));
                const select = label.querySelector('select');
                select.value = [...select.options].find(option => option.value.startsWith('={value}')).value;
                select.dispatchEvent(new Event('change'));
                return true;
            }})()"
        );
        assert_eq!(browser.eval(&choose), true);
    }
    let is_shown = "JSON.parse(part.dataset.about).faults == 'gold-dies'";
    assert_eq!(of_choice("!part.hidden"), of_choice(is_shown));
    assert_eq!(of_choice(&format!("!part.hidden && !({is_shown})")), 0);
    assert!(of_choice("part.hidden").as_u64() > Some(0));
    if is_sweep {
        let chosen = browser.eval(first).as_f64();
        assert!(chosen < whole, "{chosen:?} of {whole:?}");
    }
    let hidden = "[...document.querySelectorAll('th[data-about]')].some(head => head.hidden)";
    assert_eq!(browser.eval(hidden), true, "a column of another measure");
}
