//! The page of the playground in a real browser, opened from disk.

use std::fs::File;

use alliance_tests::harness::Lab;
use alliance_tests::testkit::in_repository;
use playground::gallery::gallery;
use serde_json::{Value, json};

use super::{DEFAULT_HASH, Run, compare, module, runs};
use crate::page::accessible::axe;
use crate::page::browser::{Browser, DESKTOP, LAPTOP, PHONE};

/// Writes the page. Returns its link, or `None` without the module.
pub fn page(lab: &Lab) -> Option<String> {
    let module = std::fs::read(module()?).unwrap();
    let path = lab.path("index.html");
    launch::page::playground::write(&module, &mut File::create(&path).unwrap()).unwrap();
    Some(format!("file://{}", path.canonicalize().unwrap().display()))
}

#[test]
fn a_person_plays_in_the_browser() {
    let lab = Lab::new();
    let Some(link) = page(&lab) else { return };
    let Some(browser) = Browser::start(LAPTOP) else {
        return;
    };
    let is = |id: &str, text: &str| {
        browser.wait_for(&format!(
            "document.querySelector('#{id}').textContent == '{text}'"
        ));
    };
    // The default mission, as fast as possible.
    browser.open(&link);
    browser.wait_for("document.body.dataset.state == 'paused'");
    browser.press('m');
    browser.press(' ');
    browser.wait_for("document.body.dataset.state == 'ended'");
    is("run-hash", &format!("hash {DEFAULT_HASH}"));

    // The form starts another run in the same page.
    browser.choose("#choose-scenario", "janitorial");
    browser.choose("#choose-allocator", "cbba");
    browser.input("#choose-seed", "7");
    browser.click("#playground button[type=submit]");
    browser.wait_for("document.body.dataset.state == 'paused' && alliance.run.run == 'janitorial'");
    assert_eq!(browser.eval("alliance.run.seed"), 7);
    assert_eq!(browser.eval("alliance.run.scenario.allocator"), "cbba");
    // Steps, and a robot that a person kills.
    browser.press('.');
    browser.wait_for("document.body.dataset.tick == '1'");
    browser.press('>');
    browser.wait_for("document.body.dataset.tick == '11'");
    browser.press('1');
    browser.press('k');
    browser.wait_for("alliance.view.faults[0]?.id == 'f1'");
    browser.press('.');
    browser.wait_for("alliance.view.robots[0].state == 'dead'");
    // The link of this run repeats it with the order, in the same tick.
    browser.click("#share");
    browser.wait_for("location.hash.includes('&orders=')");
    let shared = browser.eval("location.href");
    let play = || {
        browser.press('m');
        browser.press(' ');
        browser.wait_for("document.body.dataset.state == 'ended'");
        browser.eval("document.querySelector('#run-hash').textContent")
    };
    let hash = play();
    browser.open("about:blank");
    browser.open(shared.as_str().unwrap());
    browser.wait_for("document.body.dataset.state == 'paused'");
    assert_eq!(browser.eval("alliance.view.robots[0].state"), "present");
    assert_eq!(play(), hash);
    browser.assert_no_console_message();

    // Links with mistakes say what to do, and the form stays.
    for (hash, why) in [
        (
            "#scenario=nowhere",
            "scenario: no built-in scenario 'nowhere'",
        ),
        (
            "#seed=one",
            "seed: 'one' is no seed; use a whole number from 0 to 18446744073709551615",
        ),
        (
            "#speed=3",
            "This link is damaged at 'speed=3': copy it once more, or choose a run above",
        ),
        (
            "#scenario=%E0%A4%A",
            "This link is damaged at 'scenario=%E0%A4%A': copy it once more, or choose a run above",
        ),
        // The file is the number 5.
        (
            "#file=eJwzBQAANgA2",
            "This link is damaged: invalid type: integer `5`, ",
        ),
    ] {
        browser.open("about:blank");
        browser.open(&format!("{link}{hash}"));
        browser.wait_for("document.body.dataset.state == 'refused'");
        let shown = browser.eval("document.querySelector('#refused-why').textContent");
        assert!(shown.as_str().unwrap().starts_with(why), "{shown}");
        assert_eq!(
            browser.eval("document.querySelector('#playground').checkVisibility()"),
            true
        );
    }
}

#[test]
fn a_damaged_page_and_an_old_browser_get_a_sentence() {
    let lab = Lab::new();
    let Some(link) = page(&lab) else { return };
    let why = |browser: &Browser, link: &str| {
        browser.open(link);
        browser.wait_for("document.body.dataset.state == 'refused'");
        let why = browser.eval("document.querySelector('#refused-why').textContent");
        why.as_str().unwrap().to_owned()
    };
    let text = lab.text("index.html");
    let data = text.find("id=\"embedded-engine\"").unwrap();
    let Some(browser) = Browser::start(LAPTOP) else {
        return;
    };
    for end in [data.midpoint(text.len()), data] {
        lab.write("index.html", &text[..end]);
        for hash in ["", "#scenario=janitorial"] {
            browser.open("about:blank");
            let found = why(&browser, &format!("{link}{hash}"));
            assert!(found.starts_with("This file is damaged"), "{found}");
        }
    }

    lab.write("index.html", text);
    let Some(browser) = Browser::start_without_webassembly(LAPTOP) else {
        return;
    };
    let found = why(&browser, &link);
    assert!(
        found.starts_with("This browser cannot run the simulator: "),
        "{found}"
    );
}

#[test]
fn a_page_without_a_run_has_the_colors_of_the_system() {
    let lab = Lab::new();
    let Some(link) = page(&lab) else { return };
    let Some(browser) = Browser::start_dark(LAPTOP) else {
        return;
    };
    browser.open(&format!("{link}#speed=3"));
    browser.wait_for("document.body.dataset.state == 'refused'");
    let theme = browser.eval("document.documentElement.dataset.theme");
    assert_eq!(theme, "dark");
}

/// The options of a tool take no space from the room.
#[test]
fn a_tool_does_not_move_the_room() {
    let lab = Lab::new();
    let Some(link) = page(&lab) else { return };
    for size in [PHONE, LAPTOP, DESKTOP] {
        let Some(browser) = Browser::start(size) else {
            return;
        };
        for scenario in ["waste-cleanup", "janitorial"] {
            browser.open("about:blank");
            browser.open(&format!("{link}#scenario={scenario}"));
            browser.wait_for("document.body.dataset.state == 'paused'");
            // The cards are drawn after the first picture, and take space from the room.
            browser.wait_for("document.querySelector('#robot-cards > *')");
            let room = || {
                browser.eval("(({ top, height }) => [top, height])(document.querySelector('#room').getBoundingClientRect())")
            };
            let before = room();
            let tools = browser.eval("document.querySelectorAll('[data-tool-button]').length");
            for tool in 0..tools.as_u64().unwrap() {
                browser.eval(&format!(
                    "document.querySelectorAll('[data-tool-button]')[{tool}].click()"
                ));
                browser.wait_for("!document.querySelector('#tool-options').hidden");
                assert_eq!(room(), before, "{size:?} {scenario} {tool}");
            }
        }
    }
}

/// The same comparison as in Node.js, in the page's own module.
#[test]
fn the_browser_has_the_hashes_of_the_native_program() {
    let lab = Lab::new();
    let Some(link) = page(&lab) else { return };
    let Some(browser) = Browser::start(LAPTOP) else {
        return;
    };
    browser.open(&link);
    browser.wait_for("document.body.dataset.state == 'paused'");
    let text = |path: &str| std::fs::read_to_string(in_repository(path)).unwrap();
    let runs = runs();
    let plan: Vec<Value> = runs.iter().map(Run::plan).collect();
    // The rules of the page allow modules only as data.
    let start = format!(
        "(async () => {{
            const load = (source) => import(`data:text/javascript,${{encodeURIComponent(source)}}`);
            const {{ Program }} = await load({worker});
            const {{ results }} = await load({hashes});
            const {{ unpack }} = await import('alliance/source/part.js');
            const bytes = await (await unpack(document, 'engine')).arrayBuffer();
            return results(bytes, Program, {plan});
        }})().then((results) => (window.found = {{ results }}), (error) => (window.found = {{ error: String(error) }})) && true",
        worker = json!(text("launch/page/source/worker.js")),
        hashes = json!(text("tests/missions/playground/hashes.mjs")),
        plan = json!(plan),
    );
    browser.eval(&start);
    browser.wait_for("window.found");
    let found = browser.eval("window.found");
    assert_eq!(found.get("error"), None, "{found}");
    compare(&runs, &found["results"]);
}

/// GRAPE beside CBBA in the default mission. The native hashes are those of runs with each allocator alone.
#[test]
fn two_allocators_run_beside_each_other() {
    let lab = Lab::new();
    let Some(link) = page(&lab) else { return };
    let Some(browser) = Browser::start(LAPTOP) else {
        return;
    };
    let mut run = Run {
        choice: json!({"allocator": "grape", "beside": "cbba"}),
        orders: Vec::new(),
    };
    browser.open(&link);
    browser.wait_for("document.body.dataset.state == 'paused'");
    browser.choose("#choose-allocator", "grape");
    browser.choose("#choose-beside", "cbba");
    browser.click("#playground button[type=submit]");
    browser.wait_for(
        "document.querySelector('#comparison caption')?.textContent == 'Neither run is ahead'",
    );
    // A robot that a person kills in both runs, in the same tick.
    browser.press('>');
    browser.wait_for("document.body.dataset.tick == '10'");
    browser.press('2');
    browser.press('k');
    browser.wait_for("alliance.view.faults[0]?.id == 'f1'");
    let kill = json!({"fault": {"fault": {"kill": "gold"}}});
    run.orders.push((10, serde_json::from_value(kill).unwrap()));
    browser.press('m');
    browser.press(' ');
    browser.wait_for("document.body.dataset.state == 'ended'");
    let figures = browser.eval(
        "[...document.querySelectorAll('#comparison tbody tr')].map(row => Object.fromEntries([...row.cells].map(cell => [cell.dataset.figure ?? 'allocator', cell.textContent])))",
    );
    let expected = run.result();
    assert_eq!(figures[0]["allocator"], "grape");
    assert_eq!(figures[0]["hash"], expected["hash"]);
    assert_eq!(figures[1]["allocator"], "cbba");
    assert_eq!(figures[1]["hash"], expected["beside"]);
    assert_ne!(expected["hash"], expected["beside"]);
    assert_eq!([&figures[0]["done"], &figures[1]["done"]], ["24", "24"]);
    // The two robots of the second room deliver all items, too, and gold is dead there.
    let room = browser.eval("document.querySelector('#beside-canvas').ariaLabel");
    let room = room.as_str().unwrap();
    assert!(
        room.contains("gold dead") && room.contains("24 of 24"),
        "{room}"
    );
    // The link repeats both runs.
    browser.click("#share");
    browser.wait_for("location.hash.includes('&allocator=grape&beside=cbba&seed=1&orders=')");
    browser.assert_no_console_message();
}

#[test]
fn the_gallery_opens_each_run() {
    let lab = Lab::new();
    let Some(link) = page(&lab) else { return };
    let Some(browser) = Browser::start(LAPTOP) else {
        return;
    };
    browser.open(&link);
    browser.wait_for(
        "document.body.dataset.state == 'paused' && document.querySelector('#open-gallery')",
    );
    for (index, entry) in gallery().iter().enumerate() {
        browser.click("#open-gallery");
        browser.wait_for("document.querySelector('#gallery').open");
        let nth = index + 1;
        browser.click(&format!("#gallery li:nth-child({nth}) a"));
        let sentence = json!(entry.see);
        browser.wait_for(&format!(
            "document.body.dataset.state == 'paused' && document.querySelector('#gallery-entry')?.textContent.includes({sentence})"
        ));
        let is_pair = browser.eval("document.querySelector('#comparison') != null");
        assert_eq!(is_pair, entry.choice.beside.is_some(), "{}", entry.title);
    }
    browser.assert_no_console_message();
}

#[test]
fn axe_core_finds_no_violation() {
    let lab = Lab::new();
    let (Some(link), Some(axe)) = (page(&lab), axe()) else {
        return;
    };
    let pair = "#allocator=grape&beside=cbba";
    for (size, hash) in [
        (LAPTOP, ""),
        (PHONE, ""),
        (LAPTOP, "#speed=3"),
        // A robot is absent at first.
        (LAPTOP, "#scenario=parker-box"),
        (LAPTOP, pair),
        (PHONE, pair),
    ] {
        let Some(browser) = Browser::start(size) else {
            return;
        };
        browser.open(&format!("{link}{hash}"));
        browser.wait_for(
            "document.body.dataset.state == 'refused' || document.querySelector('#robot-cards > *')",
        );
        let check = |part: &str| {
            let found = browser.accessibility_violations(&axe);
            let found = found.join("\n");
            assert!(found.is_empty(), "{size:?} {hash} {part}: {found}");
        };
        check("page");
        browser.click("#open-gallery");
        browser.wait_for("document.querySelector('#gallery').open");
        check("gallery");
    }
}
