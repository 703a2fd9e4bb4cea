//! A team of hundreds of robots in a real browser: the page builds only visible elements.

use alliance_tests::harness::{Lab, Process};
use serde_json::json;

use super::browser::{Browser, LAPTOP};
use super::client::watch;

const ROBOTS: usize = 300;

/// Opens the log of two seconds with 300 robots, at its end. Returns the process that serves it.
#[must_use]
fn open(lab: &Lab, browser: &Browser) -> Process {
    let mission = "--robots 300 --spills 200 --limit 2 --log summary --in-process";
    let told = lab.mission("run", mission).expect(1).stderr;
    assert!(told.contains("\nand 200 more robots; run.json"), "{told}");
    assert!(
        told.contains("\nr100 ") && !told.contains("\nr101 "),
        "{told}"
    );
    let (view, page) = watch(lab, "run");
    browser.open(&page.link());
    browser.wait_for("window.alliance?.view");
    browser.press('\u{e010}');
    browser.wait_for("document.body.dataset.tick == '40'");
    view
}

fn count(browser: &Browser, selector: &str) -> u64 {
    let counted = browser.eval(&format!("document.querySelectorAll({selector:?}).length"));
    counted.as_u64().unwrap()
}

#[test]
fn a_page_of_hundreds_builds_only_visible_elements() {
    let Some(browser) = Browser::start(LAPTOP) else {
        return;
    };
    let lab = Lab::new();
    let _view = open(&lab, &browser);
    // The limit excludes an invisible table of all links.
    let nodes = count(&browser, "*");
    assert!(nodes < 4_000, "{nodes} nodes");
    assert_eq!(count(&browser, "[data-link]"), 0);
    assert_eq!(count(&browser, "#robot-cards [data-robot]"), 40);

    // The task matrix is one picture. A click on it selects.
    assert_eq!(count(&browser, "[data-chart]"), 0);
    let label = browser.wait_for("document.querySelector('#matrix-canvas').ariaLabel");
    let label = label.as_str().unwrap();
    assert!(label.starts_with("300 robots by 202 tasks: "), "{label}");
    let fits = "(({ scrollWidth, clientWidth, offsetHeight, clientHeight }) => scrollWidth <= clientWidth && clientHeight == offsetHeight)(document.querySelector('#matrix'))";
    browser.wait_for(fits);
    browser.click("#matrix-canvas");
    browser.wait_for("document.querySelectorAll('[data-selected=yes]').length == 1");
    assert!(count(&browser, "#robot-cards [data-robot]") <= 41);

    // Routine events share rows, until they are searched.
    browser.click("#tab-events");
    browser.wait_for("document.querySelectorAll('[data-event=routine]').length > 0");
    assert_eq!(count(&browser, "[data-event=joined]"), 0);
    browser.input("#event-search", "'R257 joins'");
    browser.wait_for("document.querySelectorAll('[data-event=joined]').length == 1");

    // The table of links has only those of the selected robot.
    browser.click("#tab-links");
    browser.wait_for("document.querySelectorAll('[data-link]').length > 0");
    assert_eq!(count(&browser, "[data-link]"), 2 * (ROBOTS as u64 - 1));
    browser.press('\u{e00c}');
    browser.wait_for("document.querySelectorAll('[data-link]').length == 0");
    let is_hidden = browser.eval("document.querySelector('#links-whose').hidden");
    assert_eq!(is_hidden, json!(false));

    // A few robots have curves, for the behavior sets with the largest motivations.
    browser.choose("#chart-kind", "curves");
    browser.wait_for("document.querySelectorAll('[data-chart] canvas').length == 6");
    assert!(count(&browser, "#legend .chip") <= 48);
    browser.assert_no_console_message();
    browser.screenshot("hundreds");
}

#[test]
fn a_robot_among_hundreds_can_be_found_selected_and_followed() {
    let Some(browser) = Browser::start(LAPTOP) else {
        return;
    };
    let lab = Lab::new();
    let _view = open(&lab, &browser);
    browser.input("[data-search=robots]", "'R257'");
    browser.wait_for("document.querySelectorAll('#robot-cards [data-robot]').length == 1");
    browser.click("#robot-cards [data-action=select]");
    browser.wait_for("!document.querySelector('#follow').disabled");

    // The robot is in the middle, at four times the size.
    let scale = "alliance.toScreen(1, 0).x - alliance.toScreen(0, 0).x";
    let before = browser.eval(scale).as_f64().unwrap();
    browser.press('f');
    browser.wait_for("document.querySelector('#room-canvas').dataset.zoom == '4.00'");
    let after = browser.eval(scale).as_f64().unwrap();
    assert!((after / before - 4.0).abs() < 1e-6, "{before} {after}");
    let off = "(() => { const at = alliance.toScreen(...alliance.view.robots[256].pose.position); const room = document.querySelector('#room'); return Math.hypot(at.x - room.clientWidth / 2, at.y - room.clientHeight / 2); })()";
    browser.wait_for(&format!("{off} < 1"));
    browser.press('0');
    browser.wait_for("document.querySelector('#room-canvas').dataset.zoom == '1.00'");
    assert!((browser.eval(scale).as_f64().unwrap() - before).abs() < 1e-6);
}
