//! A finished run as one file in a real browser: without a server it shows the same as the page of the server.

use std::path::Path;

use alliance_tests::harness::Lab;
use nix::sys::signal::Signal;
use serde_json::Value;

use super::browser::{Browser, LAPTOP};
use super::client::watch;

fn url(path: &Path) -> String {
    format!("file://{}", path.canonicalize().unwrap().display())
}

/// Turns all numbers into decimals. JavaScript has no others.
fn as_decimals(value: &mut Value) {
    match value {
        Value::Number(number) => *value = number.as_f64().unwrap().into(),
        Value::Array(all) => all.iter_mut().for_each(as_decimals),
        Value::Object(all) => all.values_mut().for_each(as_decimals),
        _ => {}
    }
}

#[test]
fn a_file_shows_what_the_page_of_the_server_shows() {
    let Some(browser) = Browser::start(LAPTOP) else {
        return;
    };
    let lab = Lab::new();
    let kill = "[[faults.timeline]]\nfault.kill = 'gold'\nat_s = 75.0\n";
    lab.write("day.toml", kill);
    lab.mission("run", "day.toml --limit 120 --in-process")
        .expect(1);
    let exported = lab.run("export run --html=run.html").expect(0);
    assert!(
        exported.stderr.starts_with("html    run.html ("),
        "{}",
        exported.stderr
    );
    let again = lab.refusal("export run --html=run.html");
    let reason =
        "alliance export: run.html exists; delete it, or name another file with --html=FILE";
    assert_eq!(again.trim_end(), reason);

    let (process, page) = watch(&lab, "run");
    let events = page.get("/api/events");
    let takeovers = events.as_array().unwrap().iter();
    let takeovers = takeovers.filter(|event| event["kind"] == "took-over");
    assert_eq!(takeovers.count(), 1);

    // The link opens a moment.
    browser.open(&format!("{}#t=75", url(&lab.path("run.html"))));
    browser.wait_for("document.body.dataset.tick == '1500'");
    for tick in [2400, 0, 1733, 1499, 1501] {
        browser.input("#time-slider", &tick.to_string());
        browser.wait_for(&format!("document.body.dataset.tick == '{tick}'"));
        // Poses, tasks, marks, mission columns and messages are in the view.
        let mut expected = page.get(&format!("/api/views?from={tick}&count=1"));
        as_decimals(&mut expected);
        let mut shown = browser.eval("alliance.view");
        as_decimals(&mut shown);
        assert_eq!(shown, expected[0], "tick {tick}");
        let so_far = events.as_array().unwrap().iter();
        let so_far = so_far.filter(|event| event["t_ms"].as_u64().unwrap() <= 50 * tick);
        let count = so_far.count() + usize::from(tick == 2400);
        browser.click("#tab-events");
        browser.wait_for(&format!(
            "document.querySelector('#event-count').textContent == '{count} event{}'",
            if count == 1 { "" } else { "s" }
        ));
    }
    // Another moment in the same tab needs no reload.
    browser.eval("(location.hash = '#t=100', window.isSame = true)");
    browser.wait_for("document.body.dataset.tick == '2000' && window.isSame");
    assert_eq!(
        browser.eval("[...document.querySelectorAll('[data-interfere], .live-only')].filter(e => e.checkVisibility()).length"),
        0
    );
    // Curves arrive for every robot, and nothing is requested.
    browser.wait_for("document.querySelector('[data-chart=green] .values').childElementCount >= 4");
    assert_eq!(
        browser.eval("performance.getEntriesByType('resource').length"),
        0
    );
    browser.assert_no_console_message();
    process.signal(Signal::SIGINT);
    process.wait().expect(0);

    // A file whose data was cut off says what to do.
    let text = lab.text("run.html");
    let data = text.find("id=\"embedded-run\"").unwrap();
    lab.write("short.html", &text[..data.midpoint(text.len())]);
    browser.open(&url(&lab.path("short.html")));
    browser.wait_for("document.body.dataset.state == 'refused'");
    let why = browser.eval("document.querySelector('#refused-why').textContent");
    let why = why.as_str().unwrap();
    assert!(why.starts_with("This file is damaged: "), "{why}");
}
