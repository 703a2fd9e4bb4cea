//! What the command does for whoever looks on: a pace for eyes, a page that stays, a link to the newest run, and the next step.

use nix::sys::signal::Signal;

use super::client::Page;
use crate::harness::{Lab, Process};

/// No program that could open a browser.
const NO_BROWSER: [(&str, &str); 1] = [("PATH", "")];

/// A run whose page would be opened, held at its beginning.
fn opened(lab: &Lab, arguments: &[&str]) -> (Process, Page) {
    let all = [
        &["run", "--open", "--out", "run", "--limit", "5"],
        arguments,
    ]
    .concat();
    let mut run = lab.start_with(&all, &NO_BROWSER);
    run.wait_for_stderr("/#");
    run.wait_for_stderr("the clock is held");
    let page = Page::in_words(&run.stderr());
    (run, page)
}

#[test]
fn who_looks_on_gets_real_time_unless_another_speed_is_asked_for() {
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
        let page = Page::in_words(&run.stderr());
        let view = page.live().wait_for_view(|view| !view["clock"].is_null());
        assert_eq!(view["clock"]["speed"].as_f64(), speed, "{arguments:?}");
        assert_eq!(view["clock"]["paused"], true);
        run.signal(Signal::SIGINT);
        // Whoever ends the run does not want to look at it.
        run.wait().expect(1);
    }
}

#[test]
fn a_page_that_was_opened_stays_with_the_log() {
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
    // Loaded again it is there again; when it is closed the command ends.
    drop(page.accompany());
    let _again = page.accompany();
    assert!(run.is_running());
    run.signal(Signal::SIGINT);
    run.wait().expect(1);

    let lab = Lab::new();
    let (mut run, page) = opened(&lab, &["--speed", "max"]);
    page.control(r#"{"clock": "resume"}"#);
    run.wait_for_stderr("shows the log");
    drop(page.accompany());
    let ended = run.wait().expect(1);
    assert!(
        !ended.stderr.contains("alliance report"),
        "{}",
        ended.stderr
    );
}

#[test]
fn a_run_without_a_page_that_stays_names_the_next_commands() {
    let lab = Lab::new();
    let ended = lab.mission("run", &["--limit", "5"]).expect(1);
    let last: Vec<&str> = ended.stderr.lines().rev().take(2).collect();
    assert_eq!(
        last,
        ["        alliance report run", "next    alliance view run"]
    );
}

#[test]
fn the_link_to_the_newest_run_is_there_while_it_lives_and_after_its_world_was_killed() {
    let lab = Lab::new();
    let leads_to = || std::fs::canonicalize(lab.path("runs/latest")).unwrap();
    lab.mission("elsewhere", &["--limit", "5"]).expect(1);
    assert_eq!(leads_to(), lab.path("elsewhere").canonicalize().unwrap());
    let mut run = lab.start(&["run", "--no-page", "--speed", "1x", "--json"]);
    run.wait_for_stderr("process ids: ");
    let world = run.stderr();
    let world = world.split("process ids: world ").nth(1).unwrap();
    let world: i32 = world.split(',').next().unwrap().parse().unwrap();
    crate::harness::wait_until("another link", || {
        leads_to() != lab.path("elsewhere").canonicalize().unwrap()
    });
    let newest = leads_to();
    assert!(newest.starts_with(lab.path("runs").canonicalize().unwrap()));
    nix::sys::signal::kill(nix::unistd::Pid::from_raw(world), Signal::SIGKILL).unwrap();
    run.wait().expect(3);
    assert_eq!(leads_to(), newest);
    // A world by hand is a run, too.
    let mut by_hand = lab.start(&["world", "--out", "by-hand"]);
    by_hand.wait_for_stderr("waiting for robots");
    assert_eq!(leads_to(), lab.path("by-hand").canonicalize().unwrap());
    by_hand.signal(Signal::SIGTERM);
    by_hand.wait();
}
