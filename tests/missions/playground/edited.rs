//! The editor of the playground in a real browser.

use alliance_tests::harness::{Lab, wait_until};
use serde_json::json;

use super::page::page;
use crate::page::accessible::axe;
use crate::page::browser::{Browser, CONTROL, LAPTOP, PHONE, SHIFT};

const ARROW_RIGHT: char = '\u{e014}';
const DELETE: char = '\u{e017}';
const ENTER: char = '\u{e007}';
const ESCAPE: char = '\u{e00c}';
const PAGE_DOWN: char = '\u{e00f}';

/// A scenario of a person, with comments and two robots at fixed places.
const FILE: &str = "# My room.
name = \"mine\"
limit_s = 40

[[robots]] # the first
name = \"blue\"
side_sensor = true
start = { x_m = 2.0, y_m = 2.0, heading_deg = 0 }

[[robots]]
name = \"gold\"
start = { x_m = 2.0, y_m = 6.0, heading_deg = 0 } # above
";

/// Opens the editor, with a text instead of that of the default mission.
fn open_editor(browser: &Browser, link: &str, text: Option<&str>) {
    browser.open(link);
    browser.wait_for("document.body.dataset.state == 'paused'");
    browser.click("#edit");
    browser.wait_for("document.querySelectorAll('#edit-item option').length > 1");
    if let Some(text) = text {
        browser.input("#edit-text", &json!(text).to_string());
        browser.wait_for("document.querySelector('#edit-item').length == 6");
    }
}

/// Starts a browser with the editor, with a text instead of that of the default mission. Returns `None` without module or
/// browser.
fn editor(lab: &Lab, text: Option<&str>) -> Option<Browser> {
    let link = page(lab)?;
    let browser = Browser::start(LAPTOP)?;
    open_editor(&browser, &link, text);
    Some(browser)
}

fn text(browser: &Browser) -> String {
    let text = browser.eval("document.querySelector('#edit-text').value");
    text.as_str().unwrap().to_owned()
}

/// Waits until the text is this one.
#[track_caller]
fn wait_for_text(browser: &Browser, text: &str) {
    let text = json!(text);
    browser.wait_for(&format!(
        "document.querySelector('#edit-text').value == {text}"
    ));
}

/// Drags the mouse between two points of the room, m.
fn drag(browser: &Browser, from: (f64, f64), to: (f64, f64)) {
    let at = |(x_m, y_m): (f64, f64)| {
        let found = browser.eval(&format!("allianceEditor.toScreen({x_m}, {y_m})"));
        let pixels = |key: &str| found[key].as_f64().unwrap().round() as i64;
        (pixels("x"), pixels("y"))
    };
    browser.drag(at(from), at(to));
}

#[test]
fn the_drawing_shows_the_robots() {
    let lab = Lab::new();
    let Some(browser) = editor(&lab, Some(FILE)) else {
        return;
    };
    let color_at = |x_m: f64, y_m: f64| {
        browser.eval(&format!(
            "(() => {{
                const canvas = document.querySelector('#edit-canvas');
                const box = canvas.getBoundingClientRect();
                const {{ x, y }} = allianceEditor.toScreen({x_m}, {y_m});
                return [...canvas.getContext('2d').getImageData(x - box.x, y - box.y, 1, 1).data];
            }})()"
        ))
    };
    let floor = color_at(5.0, 8.0);
    for y_m in [2.0, 6.0] {
        // Between the edge and the letter of a robot.
        assert_ne!(color_at(1.88, y_m), floor, "robot at {y_m} m");
    }
}

#[test]
fn drawing_changes_the_text_and_typing_the_drawing() {
    let lab = Lab::new();
    let Some(browser) = editor(&lab, Some(FILE)) else {
        return;
    };
    // With the mouse: a robot moves, an obstacle is drawn, and a spill is placed, which states the default spills.
    drag(&browser, (2.0, 6.0), (4.0, 7.0));
    let moved = FILE.replace("x_m = 2.0, y_m = 6.0", "x_m = 4.0, y_m = 7.0");
    wait_for_text(&browser, &moved);
    browser.click("[data-new=obstacle]");
    drag(&browser, (6.0, 2.0), (7.0, 2.5));
    browser.wait_for("document.querySelector('#edit-item').value == 'obstacle 0'");
    let with_obstacle = text(&browser);
    let obstacle = "\n[[obstacles]]\nx_m = 6.0\ny_m = 2.0\nwidth_m = 1.0\nheight_m = 0.5\n";
    assert_eq!(with_obstacle, moved.clone() + obstacle);
    // Undo and redo by keys, also while the text has the focus.
    browser.click("#edit-text");
    browser.press_with(&[CONTROL], 'z');
    wait_for_text(&browser, &moved);
    browser.press_with(&[CONTROL], 'z');
    wait_for_text(&browser, FILE);
    browser.press_with(&[CONTROL, SHIFT], 'z');
    browser.press_with(&[CONTROL, SHIFT], 'z');
    wait_for_text(&browser, &with_obstacle);
    // A click selects, and the button deletes.
    drag(&browser, (6.5, 2.25), (6.5, 2.25));
    browser.click("#edit-delete");
    wait_for_text(&browser, &moved);

    // Typing moves the robot in the drawing.
    let typed = FILE.replace("y_m = 6.0", "y_m = 7.5");
    browser.choose("#edit-item", "robot 1");
    browser.input("#edit-text", &json!(typed).to_string());
    browser.wait_for("document.querySelector('[data-number=y_m]').value == '7.5'");
    drag(&browser, (2.0, 7.5), (3.0, 7.5));
    wait_for_text(
        &browser,
        &typed.replace("x_m = 2.0, y_m = 7.5", "x_m = 3.0, y_m = 7.5"),
    );
    // A change that the program refuses changes nothing.
    let before = text(&browser);
    drag(&browser, (3.0, 7.5), (2.0, 2.0));
    browser
        .wait_for("document.querySelector('#edit-state').textContent.startsWith('Not changed: ')");
    assert_eq!(text(&browser), before);

    // A problem is the line of the command line, and the button selects its line of the text.
    for (old, wrong) in [
        ("limit_s = 40", "limit_s = -1"),
        ("side_sensor", "sides"),
        ("x_m = 2.0, y_m = 2.0", "x_m = 0.1, y_m = 2.0"),
        ("x_m = 2.0, y_m = 6.0", "x_m = 2.0, y_m = 2.1"),
        ("]] # the", "] # the"),
    ] {
        let mistake = FILE.replace(old, wrong);
        lab.write("waste-cleanup.toml", &mistake);
        let refusal = lab.refusal("run waste-cleanup.toml --in-process --no-page");
        browser.input("#edit-text", &json!(mistake).to_string());
        browser.wait_for("document.querySelector('#edit-text').ariaInvalid == 'true'");
        let shown = browser.eval("document.querySelector('#edit-state').textContent");
        let shown = shown.as_str().unwrap();
        assert!(refusal.trim_end().ends_with(shown), "{refusal}: {shown}");
        if let Some((_, stated)) = shown.split_once("waste-cleanup.toml:") {
            browser.click("#edit-line");
            let selected = browser.eval(
                "(({ value, selectionStart }) => value.slice(0, selectionStart).split('\\n').length)(document.activeElement)",
            );
            assert!(stated.starts_with(&format!("{selected}: ")), "{shown}");
        }
        browser.input("#edit-text", &json!(FILE).to_string());
        browser.wait_for("document.querySelector('#edit-text').ariaInvalid != 'true'");
    }
    browser.assert_no_console_message();
}

#[test]
fn files_of_the_computer_are_opened() {
    let lab = Lab::new();
    let Some(browser) = editor(&lab, None) else {
        return;
    };
    let builtin = text(&browser);
    lab.write("my room.toml", FILE);
    lab.write("bytes.toml", b"name = \"\xff\"");
    let field = "#edit-file";
    browser.choose_file(field, &lab.path("my room.toml").canonicalize().unwrap());
    wait_for_text(&browser, FILE);
    assert_eq!(browser.text("#editor-title"), "my-room.toml");
    browser.choose_file(field, &lab.path("bytes.toml").canonicalize().unwrap());
    let refusal = lab.refusal("check bytes.toml");
    let refusal = refusal.trim_end().trim_start_matches("alliance check: ");
    let refusal = json!(refusal);
    browser.wait_for(&format!(
        "document.querySelector('#edit-state').textContent == {refusal}"
    ));
    // The scenario before is restored, with its name.
    browser.press_with(&[CONTROL], 'z');
    wait_for_text(&browser, &builtin);
    browser.wait_for("document.querySelector('#editor-title').textContent == 'waste-cleanup.toml'");
    browser.assert_no_console_message();
}

#[test]
fn every_function_has_keys() {
    let lab = Lab::new();
    let Some(browser) = editor(&lab, Some(FILE)) else {
        return;
    };
    // A new robot, beside the middle of the room: an arrow moves by two fields of the grid of 0.05 m.
    browser.focus("[data-new=robot]");
    browser.press(ENTER);
    browser.wait_for("document.activeElement.id == 'edit-canvas'");
    browser.press(ARROW_RIGHT);
    browser.press_with(&[SHIFT], ARROW_RIGHT);
    browser.press(ENTER);
    browser.wait_for("document.querySelector('#edit-item').value == 'robot 2'");
    let with_robot = text(&browser);
    assert!(
        with_robot.ends_with("name = \"r1\"\nstart = { x_m = 7.1, y_m = 4.5 }\n"),
        "{with_robot}"
    );
    // The selected robot moves. Without a selection, the first item is the deposit.
    browser.press(ARROW_RIGHT);
    wait_for_text(&browser, &with_robot.replace("7.1,", "7.2,"));
    browser.press(DELETE);
    wait_for_text(&browser, FILE);
    browser.press(PAGE_DOWN);
    browser.wait_for("document.querySelector('#edit-item').value == 'deposit 0'");
    browser.press(ARROW_RIGHT);
    browser.wait_for("document.querySelector('#edit-text').value.includes('[waste.deposit]')");
    // Escape leaves the selection first, then the editor.
    browser.press(ESCAPE);
    browser.wait_for("document.querySelector('#edit-item').value == ''");
    browser.press(ESCAPE);
    browser.wait_for("!document.querySelector('#editor').open");
    assert_eq!(browser.eval("document.body.dataset.state"), "paused");
    browser.assert_no_console_message();
}

#[test]
fn an_edited_scenario_runs_as_in_the_native_program() {
    let lab = Lab::new();
    let Some(link) = page(&lab) else { return };
    let Some(browser) = Browser::start(LAPTOP) else {
        return;
    };
    browser.open(&link);
    browser.wait_for("document.body.dataset.state == 'paused'");
    browser.choose("#choose-allocator", "nearest");
    browser.input("#choose-seed", "7");
    browser.click("#edit");
    browser.wait_for("document.querySelectorAll('#edit-item option').length > 1");
    browser.input("#edit-text", &json!(FILE).to_string());
    browser.wait_for("document.querySelector('#edit-item').length == 6");
    drag(&browser, (2.0, 6.0), (4.0, 7.0));
    browser.wait_for("document.querySelector('#edit-text').value.includes('x_m = 4.0')");
    let text = text(&browser);
    browser.click("#edit-download");
    let saved = browser.downloads().join("waste-cleanup.toml");
    wait_until("the download", || {
        std::fs::read_to_string(&saved).is_ok_and(|saved| saved == text)
    });

    browser.click("#edit-run");
    browser.wait_for("document.body.dataset.state == 'paused' && alliance.run.run == 'mine'");
    let play = || {
        browser.press('m');
        browser.press(' ');
        browser.wait_for("document.body.dataset.state == 'ended'");
        browser.eval("document.querySelector('#run-hash').textContent")
    };
    let hash = play();
    std::fs::copy(&saved, lab.path("saved.toml")).unwrap();
    let options = "saved.toml --allocator nearest --seed 7 --in-process";
    lab.mission("native", options).expect(1);
    let native = lab.log("native").run.hash.unwrap();
    assert_eq!(hash, format!("hash {native}"));
    // The link repeats the run, and the editor has its text.
    let shared = browser.eval("location.href");
    let shared = shared.as_str().unwrap();
    browser.open("about:blank");
    browser.open(shared);
    browser.wait_for("document.body.dataset.state == 'paused'");
    assert_eq!(play(), hash);
    browser.click("#edit");
    wait_for_text(&browser, &text);
    browser.assert_no_console_message();

    // Links that are damaged or of another version say what to do.
    let version = env!("CARGO_PKG_VERSION");
    let own = format!("#version={version}&");
    assert!(shared.contains(&own), "{shared}");
    let place = shared.find("file=").unwrap() + 60;
    let damaged = format!("{}AAAA{}", &shared[..place], &shared[place + 4..]);
    for (link, why) in [
        (damaged, "This link is damaged at 'file=".to_owned()),
        (
            shared.replace(&own, "#version=99.0.0&"),
            format!(
                "This link is of version 99.0.0 and this page is of version {version}: open it in a page of version \
                 99.0.0, or choose a run above"
            ),
        ),
    ] {
        browser.open("about:blank");
        browser.open(&link);
        browser.wait_for("document.body.dataset.state == 'refused'");
        let shown = browser.eval("document.querySelector('#refused-why').textContent");
        assert!(shown.as_str().unwrap().starts_with(&why), "{shown}");
    }
}

/// A clicked button loses the focus to the page. The keys are still those of the open window.
#[test]
fn a_click_leaves_the_keys_to_the_editor() {
    let lab = Lab::new();
    let Some(browser) = editor(&lab, None) else {
        return;
    };
    let builtin = text(&browser);
    browser.input("#edit-text", &json!(FILE).to_string());
    browser.wait_for("document.querySelector('#edit-item').length == 6");
    browser.click("#edit-undo");
    wait_for_text(&browser, &builtin);
    // Neither starts the run behind the window nor kills its second robot.
    for key in [' ', '2', 'k'] {
        browser.press(key);
    }
    browser.press_with(&[CONTROL, SHIFT], 'z');
    wait_for_text(&browser, FILE);
    assert_eq!(browser.eval("document.body.dataset.state"), "paused");
    assert_eq!(browser.eval("alliance.view.faults.length"), 0);
    browser.assert_no_console_message();
}

/// A run starts the page again. The versions of the text stay, also those that were undone.
#[test]
fn undo_and_redo_survive_runs() {
    let lab = Lab::new();
    let Some(browser) = editor(&lab, None) else {
        return;
    };
    let builtin = text(&browser);
    browser.input("#edit-text", &json!(FILE).to_string());
    browser.wait_for("document.querySelector('#edit-item').length == 6");
    drag(&browser, (2.0, 6.0), (4.0, 7.0));
    let moved = FILE.replace("x_m = 2.0, y_m = 6.0", "x_m = 4.0, y_m = 7.0");
    wait_for_text(&browser, &moved);
    drag(&browser, (2.0, 2.0), (3.0, 3.0));
    let both = moved.replace("x_m = 2.0, y_m = 2.0", "x_m = 3.0, y_m = 3.0");
    wait_for_text(&browser, &both);
    browser.press_with(&[CONTROL], 'z');
    wait_for_text(&browser, &moved);
    // The second run is the first one again, with the same link.
    for mark in ["first", "second"] {
        browser.eval(&format!("window.before = '{mark}'"));
        browser.click("#edit-run");
        browser.wait_for(
            "!window.before && document.body.dataset.state == 'paused' && alliance.run.run == 'mine'",
        );
        browser.press('.');
        browser.wait_for("document.body.dataset.tick == '1'");
        browser.click("#edit");
        browser.wait_for("document.querySelector('#editor').open");
        assert_eq!(text(&browser), moved);
    }
    browser.press_with(&[CONTROL, SHIFT], 'z');
    wait_for_text(&browser, &both);
    for earlier in [moved.as_str(), FILE, builtin.as_str()] {
        browser.press_with(&[CONTROL], 'z');
        wait_for_text(&browser, earlier);
    }
    browser.wait_for("document.querySelector('#edit-undo').disabled");
    browser.assert_no_console_message();
}

#[test]
fn axe_core_finds_no_violation_in_the_editor() {
    let lab = Lab::new();
    let (Some(link), Some(axe)) = (page(&lab), axe()) else {
        return;
    };
    for size in [LAPTOP, PHONE] {
        let Some(browser) = Browser::start(size) else {
            return;
        };
        for theme in ["light", "dark"] {
            open_editor(&browser, &link, None);
            browser.eval(&format!(
                "document.documentElement.dataset.theme = '{theme}'"
            ));
            let check = |state: &str| {
                let found = browser.accessibility_violations(&axe);
                assert!(
                    found.is_empty(),
                    "{size:?} {theme} {state}: {}",
                    found.join("\n")
                );
            };
            check("open");
            browser.choose("#edit-item", "robot 0");
            check("selected");
            browser.input("#edit-text", "'limit_s = -1'");
            browser.wait_for("document.querySelector('#edit-line').checkVisibility()");
            check("problem");
        }
    }
}
