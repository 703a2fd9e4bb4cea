//! A finished run in a real browser: seeking and playing.

use alliance_tests::harness::Lab;
use nix::sys::signal::Signal;

use super::browser::{Browser, LAPTOP};
use super::client::watch;

#[test]
fn a_finished_run_can_be_played_and_sought() {
    let Some(browser) = Browser::start(LAPTOP) else {
        return;
    };
    let lab = Lab::new();
    let kill = "[[faults.timeline]]\nfault.kill = 'gold'\nat_s = 100.0\nfor_s = 30.0\n";
    lab.write("day.toml", kill);
    lab.mission("run", "day.toml --limit 150").expect(1);
    let (view, page) = watch(&lab, "run");
    browser.open(&page.link());
    browser.wait_for("document.body.dataset.mode == 'log' && alliance.view != null");
    // The controls for faults are hidden.
    assert_eq!(
        browser.eval("[...document.querySelectorAll('[data-interfere], .live-only')].filter(e => e.checkVisibility()).length"),
        0
    );
    let seek = |tick: u64| {
        browser.input("#time-slider", &tick.to_string());
        browser.wait_for(&format!(
            "alliance.view.tick == {tick} && document.body.dataset.tick == '{tick}'"
        ));
    };
    let gold = "document.querySelector('[data-robot=gold]')?.dataset.state ?? null";
    // Seek forward, backward and forward again.
    for (tick, state) in [
        (2200, "dead"),
        (1000, "present"),
        (2700, "present"),
        (2001, "dead"),
    ] {
        seek(tick);
        browser.wait_for(&format!("({gold}) == '{state}'"));
        // A crashed robot shows its earlier curves.
        browser
            .wait_for("document.querySelector('[data-chart=gold] .values').childElementCount >= 4");
    }
    browser.screenshot("page-replay");
    // The next event is gold's crash.
    seek(1990);
    browser.press('n');
    browser.wait_for("alliance.view.tick >= 2000 && alliance.view.tick <= 2001");
    browser.press('p');
    browser.wait_for("alliance.view.tick < 2000");
    // The pointer shows the events of a mark on the time line, and a click seeks them.
    let at_kill = |kind: &str| {
        let event = "{ clientX: box.left + 8 + (100 / 150) * (box.width - 16), clientY: box.top + 5, bubbles: true }";
        browser.eval(&format!(
            "(() => {{
                const marks = document.querySelector('#marks');
                const box = marks.getBoundingClientRect();
                marks.dispatchEvent(new PointerEvent('{kind}', {event}));
                return marks.title;
            }})()"
        ))
    };
    let shown = at_kill("pointermove");
    let is_named = shown.as_str().unwrap().contains(": gold is dead");
    assert!(is_named, "{shown}");
    at_kill("click");
    browser.wait_for("alliance.view.tick >= 2000 && alliance.view.tick <= 2001");
    // The clock plays, and pauses.
    seek(100);
    browser.press(' ');
    browser.wait_for("alliance.view.tick > 120");
    browser.press(' ');
    browser.wait_for("document.body.dataset.state == 'paused'");
    let held = browser.eval("alliance.view.tick").as_u64().unwrap();
    browser.press('.');
    browser.wait_for(&format!("alliance.view.tick == {}", held + 1));
    browser.press('\u{e010}');
    browser.wait_for("alliance.view.tick == 3000 && document.body.dataset.state == 'ended'");
    browser.assert_no_console_message();
    view.signal(Signal::SIGINT);
    view.wait().expect(0);
}

#[test]
fn the_page_shows_the_command_of_a_branch_which_starts_it() {
    let Some(browser) = Browser::start(LAPTOP) else {
        return;
    };
    let lab = Lab::new();
    lab.mission("run", ["--limit", "20", "--speed", "max"])
        .expect(1);
    let (view, page) = watch(&lab, "run");
    browser.open(&page.link());
    browser.wait_for("document.body.dataset.tick == '0'");
    browser.press('>');
    browser.wait_for("document.body.dataset.tick == '10'");
    // The key opens the menu with the focus on the choice.
    browser.press('b');
    let command = || browser.eval("document.querySelector('[data-field=command]').value");
    let folder = lab.path("run").canonicalize().unwrap();
    let start = format!("alliance run --from {} --at 0.5s", folder.display());
    assert_eq!(command(), format!("{start} --faults none"));
    assert_eq!(
        browser.eval("document.activeElement.dataset.field"),
        "continuation"
    );
    browser.screenshot("page-branch");
    browser.choose("[data-field=continuation]", "");
    assert_eq!(command(), start);
    let words = start.split(' ').skip(1);
    let words: Vec<&str> = words.chain(["--in-process", "--out", "again"]).collect();
    lab.run(&words).expect(1);
    lab.assert_same_bytes("run", "again");
    // The end of the run has no branch.
    browser.eval("document.querySelector('#menu').hidePopover()");
    // The browser takes the focus from a hidden field before its next picture. Keys in a field do not move the time.
    browser.wait_for("document.activeElement == document.body");
    browser.press('\u{e010}');
    browser.wait_for("document.body.dataset.tick == '400'");
    browser.click("#branch");
    let notice = browser.text("[data-notice=refused]");
    assert!(notice.contains("The run has ended here"), "{notice}");
    browser.assert_no_console_message();
    view.signal(Signal::SIGINT);
    view.wait().expect(0);
}
