//! Conveniences of the command for observers: real-time speed, and a page that stays.

use alliance_tests::harness::{Lab, Process};
use nix::sys::signal::Signal;

use super::client::Page;

/// An environment in which no browser can be opened.
const NO_BROWSER: [(&str, &str); 1] = [("PATH", "")];

/// Starts a run with `--open`, paused at its beginning.
fn opened(lab: &Lab, arguments: &[&str]) -> (Process, Page) {
    let all = [
        &["run", "--open", "--out", "run", "--limit", "5"],
        arguments,
    ]
    .concat();
    let mut run = lab.start_with(&all, &NO_BROWSER);
    run.wait_for_stderr("/#");
    run.wait_for_stderr("the clock is held");
    let page = Page::from_output(&run.stderr());
    (run, page)
}

#[test]
fn an_opened_page_or_a_paused_start_means_real_time_unless_a_speed_is_stated() {
    for (arguments, speed) in [
        (&["--open"][..], Some(1.0)),
        (&["--paused"], Some(1.0)),
        (&["--paused", "--speed", "max"], None),
        (&["--open", "--speed", "3x"], Some(3.0)),
    ] {
        let lab = Lab::new();
        let all = [&["run", "--out", "run", "--limit", "5"], arguments].concat();
        let mut run = lab.start_with(&all, &NO_BROWSER);
        run.wait_for_stderr("/#");
        let page = Page::from_output(&run.stderr());
        let view = page.live().wait_for_view(|view| !view["clock"].is_null());
        assert_eq!(view["clock"]["speed"].as_f64(), speed, "{arguments:?}");
        assert_eq!(view["clock"]["paused"], true);
        run.signal(Signal::SIGINT);
        // After an interrupt the page does not stay.
        run.wait().expect(130);
    }
}

#[test]
fn an_opened_page_stays_with_the_log() {
    let lab = Lab::new();
    let (mut run, page) = opened(&lab, &["--speed", "max"]);
    assert_eq!(page.get("/api/run")["stays"], true);
    page.control(r#"{"clock": "resume"}"#);
    run.wait_for_stderr("shows the log");
    let about = page.get("/api/run");
    assert_eq!(
        (&about["mode"], &about["log"]["ticks"]),
        (&"log".into(), &100.into())
    );
    // The command continues after a reload, and ends when the page is closed.
    drop(page.open_page());
    let _again = page.open_page();
    assert!(run.is_running());
    run.signal(Signal::SIGINT);
    run.wait().expect(1);

    let lab = Lab::new();
    let (mut run, page) = opened(&lab, &["--speed", "max"]);
    page.control(r#"{"clock": "resume"}"#);
    run.wait_for_stderr("shows the log");
    drop(page.open_page());
    let ended = run.wait().expect(1);
    assert!(
        !ended.stderr.contains("alliance report"),
        "{}",
        ended.stderr
    );
}
