//! Conveniences of the command for observers: real-time speed, and a page that stays.

use alliance_tests::harness::{Lab, Process};
use nix::sys::signal::Signal;

use super::client::Page;

/// Starts a run with these options, paused at its beginning, in an environment in which no browser can be opened.
fn start(lab: &Lab, options: &str) -> (Process, Page) {
    let run = format!("run --out run --limit 5 {options}");
    let mut run = lab.start_with(run, &[("PATH", "")]);
    run.wait_for_stderr("/#");
    let page = Page::from_output(&run.stderr());
    (run, page)
}

#[test]
fn an_opened_page_or_a_paused_start_means_real_time_unless_a_speed_is_stated() {
    for (options, speed) in [
        ("--open", Some(1.0)),
        ("--paused", Some(1.0)),
        ("--paused --speed max", None),
        ("--open --speed 3x", Some(3.0)),
    ] {
        let lab = Lab::new();
        let (run, page) = start(&lab, options);
        let view = page.live().wait_for_view(|view| !view["clock"].is_null());
        assert_eq!(view["clock"]["speed"].as_f64(), speed, "{options}");
        assert_eq!(view["clock"]["paused"], true);
        run.signal(Signal::SIGINT);
        // After an interrupt the page does not stay.
        run.wait().expect(130);
    }
}

#[test]
fn an_opened_page_stays_with_the_log_until_it_is_closed() {
    for is_interrupted in [true, false] {
        let lab = Lab::new();
        let (mut run, page) = start(&lab, "--open --speed max");
        run.wait_for_stderr("the clock is held");
        assert_eq!(page.get("/api/run")["stays"], true);
        page.control(r#"{"clock": "resume"}"#);
        run.wait_for_stderr("shows the log");
        if is_interrupted {
            let about = page.get("/api/run");
            assert_eq!(about["mode"], "log");
            assert_eq!(about["log"]["ticks"], 100);
            // The command continues after a reload.
            drop(page.open_page());
            let _again = page.open_page();
            assert!(run.is_running());
            run.signal(Signal::SIGINT);
            run.wait().expect(1);
        } else {
            drop(page.open_page());
            let stderr = run.wait().expect(1).stderr;
            assert!(!stderr.contains("alliance report"), "{stderr}");
        }
    }
}
