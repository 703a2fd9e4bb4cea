//! A live run in a real browser, watched and controlled like by a user.

use alliance_tests::harness::{Lab, command_line};
use alliance_tests::runs::Events;
use alliance_tests::team::Team;
use alliance_tests::testkit::ROBOTS;
use nix::sys::signal::Signal;
use run_log::PoseRow;
use serde_json::{Value, json};

use super::browser::{Browser, LANDSCAPE, LAPTOP, PHONE, SHIFT};
use super::client::Page;

/// The condition that a notice acknowledges the first fault with its time.
const NOTICE: &str = "/f1: .* from .* s .tick /.test(document.querySelector('#notices').innerText)";

/// Starts a browser with the page of a run that is paused at its beginning.
fn open<'l>(lab: &'l Lab, size: (u32, u32), arguments: &str) -> Option<(Browser, Team<'l>, Page)> {
    let browser = Browser::start(size)?;
    let mut team = Team::start_with_page(lab, format!("{arguments} --paused"));
    let (page, _) = Page::of(&mut team);
    browser.open(&page.link());
    browser.wait_for(
        "document.body.dataset.state == 'paused' && alliance.view.robots.every(r => r.pid != null)",
    );
    Some((browser, team, page))
}

fn resume_at_full_speed(page: &Page) {
    page.control(r#"{"clock": {"speed": null}}"#);
    page.control(r#"{"clock": "resume"}"#);
}

fn tick(browser: &Browser) -> u64 {
    browser.eval("alliance.view.tick").as_u64().unwrap()
}

/// Steps the clock to a tick.
fn run_to(browser: &Browser, page: &Page, target: u64) {
    let left = target - tick(browser);
    page.control(&format!(r#"{{"clock": {{"step": {left}}}}}"#));
    browser.wait_for(&format!(
        "alliance.view.tick == {target} && document.body.dataset.tick == '{target}'"
    ));
}

/// Returns the position of a point of the room, in pixels of the window. Waits until several checks give the same
/// result, because the room moves when elements around it appear.
fn canvas(browser: &Browser, x_m: f32, y_m: f32) -> (i64, i64) {
    browser.eval("window.placed = null");
    let at = browser.wait_for(&format!(
        "(() => {{
            const box = document.querySelector('#room-canvas').getBoundingClientRect();
            const at = alliance.toScreen({x_m}, {y_m});
            const now = [Math.round(box.x + at.x), Math.round(box.y + at.y)];
            if (window.placed?.now.join() != now.join()) window.placed = {{ now, pictures: 0 }};
            const placed = window.placed;
            if (!placed.waiting) {{
                placed.waiting = true;
                setTimeout(() => requestAnimationFrame(() => {{ placed.pictures += 1; placed.waiting = false; }}), 100);
            }}
            return placed.pictures >= 5 ? now : null;
        }})()"
    ));
    (at[0].as_i64().unwrap(), at[1].as_i64().unwrap())
}

#[test]
fn robots_move_and_the_clock_can_be_paused_stepped_and_resumed() {
    let lab = Lab::new();
    let Some((browser, team, _)) = open(&lab, LAPTOP, "--speed 5x --limit 60") else {
        return;
    };
    assert_eq!(browser.eval("document.body.dataset.mode"), "live");
    assert_eq!(tick(&browser), 0);
    // The tools are in one row.
    let tops = "new Set([...document.querySelectorAll('#toolbar button')].filter(each => each.checkVisibility()).map(each => Math.round(each.getBoundingClientRect().top))).size";
    assert_eq!(browser.eval(tops), 1);
    // Keys for one and for ten steps, and the button for pause and resume.
    browser.press('.');
    browser.wait_for("document.body.dataset.tick == '1'");
    browser.press('>');
    browser.wait_for("document.body.dataset.tick == '11'");
    let places = "JSON.stringify(alliance.view.robots.map(r => r.pose))";
    let before = browser.eval(places);
    browser.click("#pause");
    browser.wait_for("document.body.dataset.state == 'running' && alliance.view.tick > 250");
    browser.press(' ');
    browser.wait_for("document.body.dataset.state == 'paused'");
    assert_ne!(browser.eval(places), before);
    // The world is paused, too: its status does not advance.
    let status_tick = || {
        let status = lab.run("status --json").expect(0).json();
        assert_eq!(status["status"]["clock"]["paused"], true);
        status["status"]["tick"].as_u64().unwrap()
    };
    // The current tick may end after the clock reports the pause.
    let paused_tick = status_tick();
    browser.wait_for(&format!("alliance.view.tick == {paused_tick}"));
    assert_eq!(status_tick(), paused_tick);
    browser.click("#step");
    let next = paused_tick + 1;
    browser.wait_for(&format!("alliance.view.tick == {next}"));
    assert_eq!(tick(&browser), next);

    // The page shows texts, numbers and colors of the robots.
    let state = browser.text("[data-robot=blue] [data-field=state]");
    assert_eq!(state, "present");
    let doing = browser.text("[data-robot=blue] [data-field=doing]");
    assert!(doing.starts_with("find-locations-methodical"), "{doing}");
    let charts = "document.querySelectorAll('[data-chart]').length";
    assert_eq!(browser.eval(charts), 3);
    let executes = "document.querySelector('[data-task=find-locations] [data-field=executes]')";
    assert_eq!(browser.eval(&format!("{executes}.dataset.robots")), "blue");
    browser.click("#speed-max");
    browser.press(' ');
    browser.wait_for("document.body.dataset.state == 'ended'");
    let ended = browser.text("#ended");
    assert!(ended.replace('-', " ").contains("time limit"), "{ended}");
    let tool = "document.querySelector('[data-tool-button=obstacle]').disabled";
    assert_eq!(browser.eval(tool), true);
    browser.assert_no_console_message();
    team.wait().expect(1);
}

#[test]
fn an_obstacle_drawn_ahead_of_a_robot_is_avoided_and_can_be_undone() {
    let lab = Lab::new();
    let arguments = "--speed max --limit 60";
    let Some((browser, team, page)) = open(&lab, LAPTOP, arguments) else {
        return;
    };
    // Blue's path in the undisturbed run.
    lab.mission("before", "--limit 60 --in-process").expect(1);
    let mut path = lab.log("before").rows::<PoseRow>().unwrap();
    path.retain(|row| row.robot == "blue");
    let from = 400;
    let (start, mut later) = (&path[from], path[from..].iter());
    let ahead = later.find(|row| (row.x_m - start.x_m).hypot(row.y_m - start.y_m) > 1.5);
    let ahead = ahead.unwrap();
    // Returns whether the body touches the obstacle with this corner and size.
    let inside = |row: &PoseRow, corner: (f32, f32), size: (f32, f32), radius: f32| {
        let beyond = |at: f32, from: f32, size: f32| (from - at).max(at - from - size).max(0.0);
        let dx = beyond(row.x_m, corner.0, size.0);
        dx.hypot(beyond(row.y_m, corner.1, size.1)) < radius
    };

    run_to(&browser, &page, from as u64);
    let canvas = |x, y| canvas(&browser, x, y);
    browser.press('o');
    browser.drag(
        canvas(ahead.x_m - 0.3, ahead.y_m + 0.3),
        canvas(ahead.x_m + 0.3, ahead.y_m - 0.3),
    );
    browser.wait_for("alliance.view.obstacles.length == 1 && alliance.view.faults.length == 1");
    browser.screenshot("page-obstacle");
    let drawn = browser.eval("alliance.view.obstacles[0]");
    let number = |key: &str| drawn[key].as_f64().unwrap() as f32;
    let corner = (number("x_m"), number("y_m"));
    let size = (number("width_m"), number("height_m"));
    let is_as_drawn = (size.0 - 0.6).abs() < 0.1 && (size.1 - 0.6).abs() < 0.1;
    assert!(is_as_drawn, "{drawn}");
    // Without the obstacle blue would go there.
    let mut later = path[from..].iter();
    assert!(later.any(|row| inside(row, corner, size, 0.2)));
    // The page shows the time from which the obstacle exists.
    browser.wait_for(NOTICE);

    run_to(&browser, &page, 1000);
    // The undo button in the list of faults removes the obstacle.
    browser.click("#tab-faults");
    browser.click("#faults [data-undo=f1]");
    browser.wait_for("alliance.view.obstacles.length == 0");
    browser.assert_no_console_message();
    resume_at_full_speed(&page);
    team.wait().expect(1);

    let log = lab.log("run");
    let there = |row: &&PoseRow| row.robot == "blue" && (20_050..=50_000).contains(&row.t_ms.0);
    for row in log.rows::<PoseRow>().unwrap().iter().filter(there) {
        assert!(!inside(row, corner, size, 0.199), "{row:?} in {drawn}");
    }
    for (kind, t_ms) in [("applied", 20_000), ("healed", 50_000)] {
        let mut rows = log.events(kind);
        rows.retain(|row| row.subject == "f1");
        let times: Vec<u64> = rows.iter().map(|row| row.t_ms.0).collect();
        assert_eq!(times, [t_ms], "{kind}");
    }
    lab.assert_repeated("run");
}

#[test]
fn gold_is_killed_on_the_page_and_the_page_shows_the_takeover_of_its_task() {
    let lab = Lab::new();
    let Some((browser, mut team, page)) = open(&lab, LAPTOP, "--speed max --limit 250") else {
        return;
    };
    // The run continues until gold moves items of a spill.
    let task = |robot: &str| {
        format!(
            "[...document.querySelectorAll('[data-task]')].find(row => row.querySelector('[data-field=executes]').dataset.robots.split(' ').includes('{robot}'))?.dataset.task ?? null"
        )
    };
    page.control(r#"{"clock": {"speed": 30}}"#);
    page.control(r#"{"clock": "resume"}"#);
    browser.wait_for("alliance.view.robots[1].sets.some(s => s.motivation.state == 'Active' && s.motivation.set >= 2)");
    browser.press(' ');
    browser.wait_for("document.body.dataset.state == 'paused'");
    let spill = browser.wait_for(&task("gold"));
    let spill = spill.as_str().unwrap();
    let pid = team.pid("gold");
    let shown = browser.text("[data-robot=gold] [data-field=pid]");
    assert_eq!(shown, pid.to_string());
    let height = "document.querySelector('#room').clientHeight";
    let before = browser.eval(height);
    let kill = "document.querySelector('[data-robot=gold] [data-action=kill]')";
    assert_eq!(browser.eval(&format!("{kill}.ariaLabel")), "Kill gold");
    browser.click("[data-robot=gold] [data-action=kill]");
    browser.wait_for(NOTICE);
    // The card shows the fault, and the room keeps its size.
    browser.wait_for("document.querySelector('[data-robot=gold] .faults').innerText.includes('(from the next tick)')");
    assert_eq!(browser.eval(height), before);
    // While the clock is paused, the kill takes effect in the next tick: a real SIGKILL.
    browser.press('.');
    browser.press('.');
    browser.wait_for("document.querySelector('[data-robot=gold]').dataset.state == 'dead'");
    assert!(command_line(pid).is_none());
    assert_eq!(browser.eval(height), before);
    browser.screenshot("page-killed");
    assert_eq!(browser.eval(&task("gold")), Value::Null);

    // Slow enough that the restart comes before the limit on a busy machine.
    page.control(r#"{"clock": {"speed": 5}}"#);
    browser.press(' ');
    let successor = browser.wait_for(&format!(
        "document.querySelector({:?}).dataset.robots || null",
        format!("[data-task={spill:?}] [data-field=executes]")
    ));
    browser.click("#tab-events");
    browser.wait_for("document.querySelector('#event-list').innerText.includes('gold')");
    // The restart button starts a new incarnation.
    browser.click("[data-robot=gold] [data-action=restart]");
    browser.wait_for("document.querySelector('[data-robot=gold]').dataset.state == 'present'");
    let incarnation = browser.text("[data-robot=gold] [data-field=incarnation]");
    assert_eq!(incarnation, "2");
    browser.assert_no_console_message();
    team.wait_for_row("events.csv", &[",joined,gold,", "incarnation 2"]);
    resume_at_full_speed(&page);
    team.wait();

    let log = lab.log("run");
    assert_eq!(log.events("gone")[0].robot, "gold");
    assert_ne!(successor, "gold");
    // If the page is slow, the successor may have begun the task before the kill.
    let taken = log.events_of(successor.as_str().unwrap(), "activated");
    assert!(taken.iter().any(|row| row.subject == spill));
    lab.assert_repeated("run");
}

#[test]
fn a_link_and_a_sensor_are_broken_by_clicks_and_both_faults_are_undone() {
    let lab = Lab::new();
    let Some((browser, team, page)) = open(&lab, LAPTOP, "--speed max --limit 60") else {
        return;
    };
    run_to(&browser, &page, 100);
    browser.click("#tab-links");
    browser.click("[data-link='green>blue']");
    browser.click("#menu [data-action=cut]");
    browser.wait_for("alliance.view.faults.length == 1");
    assert_eq!(
        browser.eval("alliance.view.faults[0].order.fault"),
        json!({"partition": {"groups": [["blue"], ["green"]], "one_way": true}})
    );
    browser
        .wait_for("document.querySelector('#notices').innerText.includes('f1: green → blue cut')");
    browser
        .wait_for("document.querySelector('[data-link=\"green>blue\"]').innerText.includes('cut')");
    browser.click("[data-robot=blue] [data-action=sensors]");
    browser.choose("#menu [data-field=device]", "waste");
    browser.click("#menu [data-action=break]");
    browser.wait_for("alliance.view.faults.length == 2");
    run_to(&browser, &page, 300);
    browser.click("#tab-messages");
    browser.wait_for("document.querySelector('#message-list [data-delivery=lost]') != null");
    browser.screenshot("page-messages");
    browser.press('u');
    browser.wait_for("alliance.view.faults.length == 1");
    browser.press('u');
    browser.wait_for("alliance.view.faults.length == 0");
    // Added waste cannot be undone.
    assert_eq!(browser.eval("alliance.view.items.length"), 24);
    browser.press('w');
    // The options of the tool move the room.
    browser.wait_for("document.querySelector('#room-canvas').dataset.tool == 'fault-waste'");
    let place = canvas(&browser, 6.0, 4.5);
    browser.drag(place, place);
    browser.wait_for("alliance.view.items.length == 25");
    let position = browser.eval("alliance.view.items[24].position");
    let off = |axis: usize, expected: f64| (position[axis].as_f64().unwrap() - expected).abs();
    assert!(off(0, 6.0) < 0.1 && off(1, 4.5) < 0.1, "{position}");
    // The first click selects an item, the second one its new position.
    browser.click("[data-tool-button=fault-move-waste]");
    let place = canvas(&browser, 6.0, 4.5);
    browser.drag(place, place);
    browser.wait_for("document.querySelector('#fault-fields [data-field=item]').value == '24'");
    let place = canvas(&browser, 6.0, 3.0);
    browser.drag(place, place);
    browser.wait_for("alliance.view.items[24].position[1] < 3.1");
    browser.screenshot("page-own-faults");
    browser.assert_no_console_message();
    resume_at_full_speed(&page);
    team.wait().expect(1);
    let faults = lab.log("run").run.faults;
    let shown = faults
        .iter()
        .map(|fault| (fault.order.fault.name(), fault.hits > 0));
    let shown: Vec<(&str, bool)> = shown.collect();
    assert_eq!(
        shown[..3],
        [("partition", true), ("sensor", true), ("waste", true)]
    );
    assert_eq!(
        shown[3..].iter().map(|(name, _)| *name).collect::<String>(),
        "move-waste"
    );
    assert!(faults[..2].iter().all(|fault| fault.healed_ms.is_some()));
}

#[test]
fn the_page_fits_a_laptop_and_a_phone() {
    for (name, size) in [
        ("laptop", LAPTOP),
        ("phone", PHONE),
        ("landscape", LANDSCAPE),
    ] {
        let lab = Lab::new();
        let Some((browser, team, page)) = open(&lab, size, "--speed max --limit 100") else {
            return;
        };
        run_to(&browser, &page, 1500);
        let seen = browser.eval("[innerWidth, innerHeight]");
        assert_eq!(seen, json!([size.0, size.1]), "{name}");
        let overflow = browser.eval("document.documentElement.scrollWidth - innerWidth");
        assert_eq!(overflow, 0, "{name} scrolls sideways");
        let is_whole = browser.eval(
            "document.querySelector('#progress-bar').getBoundingClientRect().right <= innerWidth",
        );
        assert_eq!(is_whole, true, "{name} cuts the progress");
        if size == LAPTOP {
            let lowest = "Math.max(...[...document.querySelectorAll('#top > *')].map((part) => part.offsetTop))";
            let is_row = browser.eval(&format!(
                "{lowest} < document.querySelector('#pause').getBoundingClientRect().bottom"
            ));
            assert_eq!(is_row, true, "the head has several rows");
            let below = browser.eval("document.documentElement.scrollHeight - innerHeight");
            assert_eq!(below, 0, "{name} scrolls");
        }
        let robots = browser.eval("document.querySelector('#robots').clientHeight");
        assert!(robots.as_u64().unwrap() >= 150, "{name}: {robots} px");
        browser.screenshot(&format!("page-{name}"));
        resume_at_full_speed(&page);
        team.wait().expect(1);
    }
}

#[test]
fn a_frozen_or_waiting_run_is_not_shown_as_running() {
    let lab = Lab::new();
    let Some((browser, team, page)) = open(&lab, LAPTOP, "--speed 1x") else {
        return;
    };
    page.control(r#"{"clock": "resume"}"#);
    browser.wait_for("document.body.dataset.state == 'running'");
    team.signal("world", Signal::SIGSTOP);
    browser.wait_for("document.body.dataset.state == 'frozen'");
    let cure = format!("`kill -CONT {}` resumes it", team.pid("world"));
    lab.run("status").expect(3).shows(&cure);
    team.signal("world", Signal::SIGCONT);
    browser.wait_for("document.body.dataset.state == 'running'");

    for robot in ROBOTS {
        team.signal(robot, Signal::SIGSTOP);
    }
    let warning = "document.querySelector('#warning').innerText";
    let blue = format!("blue (process {})", team.pid("blue"));
    browser.wait_for(&format!("{warning}.includes('waits for {blue}')"));
    for robot in ROBOTS {
        team.signal(robot, Signal::SIGCONT);
    }
    browser.wait_for("document.body.dataset.state == 'running'");
    team.signal("world", Signal::SIGTERM);
    team.wait();
}

#[test]
fn room_matrix_and_charts_need_no_mouse() {
    const ENTER: char = '\u{e007}';
    const ESCAPE: char = '\u{e00c}';
    const LEFT: char = '\u{e012}';
    const UP: char = '\u{e013}';
    const RIGHT: char = '\u{e014}';
    const DOWN: char = '\u{e015}';
    let lab = Lab::new();
    let Some((browser, team, page)) = open(&lab, LAPTOP, "--speed max --limit 60") else {
        return;
    };
    // An obstacle between two corners, whose menu removes it.
    browser.press('o');
    browser.wait_for("document.activeElement.id == 'room-canvas'");
    browser.press(ENTER);
    browser.press_with(&[SHIFT], RIGHT);
    browser.press_with(&[SHIFT], UP);
    browser.press(ENTER);
    browser.wait_for("alliance.view.faults[0]?.order.fault.obstacle.width_m > 0");
    run_to(&browser, &page, 20);
    assert_eq!(browser.eval("alliance.view.obstacles.length"), 1);
    browser.press(ESCAPE);
    browser.press(LEFT);
    browser.press(DOWN);
    browser.press(ENTER);
    browser.wait_for("document.activeElement.matches('#menu [data-action=remove]')");
    browser.press(ENTER);
    run_to(&browser, &page, 40);
    assert_eq!(browser.eval("alliance.view.obstacles.length"), 0);
    // A robot that the matrix selects.
    browser.choose("#chart-kind", "matrix");
    browser.focus("#matrix-canvas");
    browser.press(DOWN);
    browser.press(DOWN);
    browser.wait_for("document.querySelector('#matrix-cell').innerText.startsWith('gold × ')");
    browser.press(ENTER);
    browser.wait_for("document.querySelector('[data-robot=gold]').dataset.selected == 'yes'");
    // The values of an earlier time.
    browser.choose("#chart-kind", "curves");
    browser.focus("#chart-list");
    browser.press(LEFT);
    browser.wait_for("document.querySelector('#chart-list [data-at=pointer]') != null");
    resume_at_full_speed(&page);
    team.wait().expect(1);
}
