//! Every kind of mistake in a scenario file. The snapshots contain the error messages.

use glam::Vec2;
use proptest::prelude::*;
use scenario::testkit::{entry, refusals};
use scenario::{Scenario, Setup};

use crate::fixtures::{parse, read};
use crate::waste::data::{WASTE, default_scenario};

/// Compares the errors of texts with the snapshot of this name.
fn refused(name: &str, texts: &[&str]) {
    insta::assert_snapshot!(name, refusals("s.toml", texts, read));
}

#[test]
fn mistakes_have_file_line_and_remedy() {
    refused(
        "not_toml",
        &[
            "[room",
            "x",
            "name = 'a'\nname = 'b'",
            "[room]\n[room]",
            "a = [1, 2",
            "name = 'x\u{1b}[31m'",
        ],
    );
    refused(
        "unknown_keys",
        &[
            "nam = 'a'",
            "\n\n[room]\nwidht_m = 3",
            "a.b.c = 1",
            "\"a\\nb\" = 1",
            "[[obstacles]]\nx_m = 1\ny_m = 1\nwidth_m = 1\nheight_m = 1\ncolor = 'red'",
        ],
    );
    refused(
        "wrong_types",
        &[
            "name = 3",
            "step_ms = 50.5",
            "step_ms = -1",
            "step_ms = 99999999999999999999",
            "limit_s = true",
            "room = 3",
            "robots = 3",
            "[robots]",
            "limit_s = 2020-01-01",
            "[alliance.switches]\nwaiting = 'yes'",
            "[tasks.report-progress]\npriority = 'high'",
            "room.width_m = 5\nroom.height_m = [5]",
            "waste.spills = [{ items = -1 }]",
            "[[room]]\nwidth_m = 3",
            "faults = [[]]",
        ],
    );
    refused(
        "unknown_choices",
        &[
            "[alliance]\npreset = 'teem'",
            "[alliance]\npreset = 3",
            "step_order = 'in-order'\n[alliance.switches]\nstep_order = 'in-order'",
            "[alliance.switches]\nhistory_origin = 'start'",
        ],
    );
    refused(
        "missing_keys",
        &[
            "[[robots]]\nside_sensor = true",
            "[[robots]]\nname = 'blue'\n[robots.start]\nx_m = 2\n",
            "[[obstacles]]\nx_m = 1.5\ny_m = 0.5\nwidth_m = 1",
        ],
    );
    refused(
        "out_of_range",
        &[
            "step_ms = 0",
            "step_ms = 501",
            "limit_s = 0",
            "limit_s = nan",
            "limit_s = inf",
            "limit_s = 1e400",
            "name = 'x'\r\nlimit_s = -1\r\n",
            "[room]\nwidth_m = -1",
            "[room]\nheight_m = 1e300",
            "[body]\nradius_m = 0",
            "[body]\nspeed_m_s = -0.5",
            "[[robots]]\nname = 'a'\nspeed_m_s = 0",
            "[[robots]]\nname = 'a'\npush_m_s = 0",
            "[body]\npush_m_s = nan",
            "devices = ['side-boarder']",
            "[skills]\ndust = 1",
            "[[robots]]\nname = 'a'\nturn_deg_s = -1",
            "[[robots]]\nname = 'a'\ndevices = ['side-boarder']",
            "[[robots]]\nname = 'a'\nskills = { dust = 1 }",
            "[body]\nturn_deg_s = 3601",
            "[body]\nreach_m = 0",
            "[body]\nrobot_penetrability = -0.1",
            "[sensors]\nborder_range_m = 0",
            "[sensors]\navoidance_range_m = nan",
            "[sensors]\nwaste_range_m = 1001",
            "[energy]\ncapacity_j = 0",
            "[energy]\nidle_w = -1",
            "[energy]\ndrive_w = inf",
            "[[waste.spills]]\nname = 'top'\nx_fraction = 1.5",
            "[[waste.spills]]\nname = 'top'\nitems = 1001",
            "[waste]\nspill_radius_m = 0",
            "[waste]\nitem_radius_m = 0.9",
            "[waste.deposit]\ny_fraction = -0.1",
            "[waste.report_site]\ncolor_s = -1",
            "[waste]\nreport_period_s = 0",
            "[[robots]]\nname = 'blue'\nstart = { x_m = 2, y_m = 3, heading_deg = 361 }",
            "[[obstacles]]\nx_m = 1\ny_m = 1\nwidth_m = 0\nheight_m = 1",
            "[[obstacles]]\nx_m = nan\ny_m = 1\nwidth_m = 1\nheight_m = 1",
            "[tasks.report-progress]\nmax_robots = 0",
        ],
    );
    refused(
        "names",
        &[
            "name = 'a b'",
            "\u{feff}name = 'a b'",
            "[[robots]]\nname = 'a/b'",
            "[[robots]]\nname = 'blue'\n[[robots]]\nname = 'blue'",
            "robots = []",
            "[[robots]]\nname = 'a'\ntasks = ['find-locations', 'move-spill(tip)']",
            "radio.range_m = 0.0",
            "radio.walls = 'wood'",
            "radio.fading = { d0_m = 0.0, path_loss_exponent = 3.0 }",
            "radio.fading = { d0_m = 5.0, path_loss_exponent = 5.0 }",
            "radio.fading = { d0_m = 5.0 }",
            "[[faults.timeline]]\nfault.corrupt = { p = 1.5 }",
            "[[waste.further_deposits]]\nx_fraction = 1.5\ny_fraction = 0.5",
            "[[waste.spills]]\nitems = 3",
            "[[waste.spills]]\nname = 'top'\n[[waste.spills]]\nname = 'top'",
            "waste.spills = []",
            "[tasks.\"move-spill(left)\"]\npriority = 1",
            "[tasks.cleaning]\npriority = 1",
            "[alliance.sets.report]\nfast_impatience = 3",
            "[alliance.robots.red.defaults]\nfast_impatience = 3",
            "[alliance.robots.gold.sets.find-locations-methodical]\nfast_impatience = 3",
            "[alliance.defaults.slow_impatience_toward]\nred = 1",
            "[alliance.robots.blue.defaults.willing_to_affect_toward_s]\nblue = 1",
        ],
    );
    refused(
        "places",
        &[
            "[room]\nwidth_m = 0.3",
            "[body]\nradius_m = 4",
            "[[robots]]\nname = 'blue'\nstart = { x_m = 0.1, y_m = 1 }",
            "[[robots]]\nname = 'blue'\n[robots.start]\nx_m = 2\ny_m = 9",
            "[[robots]]\nname = 'blue'\n[robots.start]\nx_m = 2\ny_m = 1\n[[obstacles]]\nx_m = 1.5\ny_m = 0.5\nwidth_m = 1\nheight_m = 1",
            "[[robots]]\nname = 'blue'\n[robots.start]\nx_m = 2.3\ny_m = 1\n[[robots]]\nname = 'gold'\n[robots.start]\nx_m = 2\ny_m = 1",
        ],
    );
    refused(
        "parameters",
        &[
            "[alliance]\nthreshold = 0",
            "[alliance.defaults]\nfast_impatience = -1",
            "[alliance.defaults]\nfast_impatience = 0.4",
            "[alliance.sets.report-progress]\nbroadcast_rate_hz = 0.2",
            "[alliance.robots.blue.sets.report-progress]\nslow_impatience = inf",
            "[alliance.sets.report-progress]\nfast_impatience = 3\n[alliance.robots.blue.sets.report-progress]\nslow_impatience_toward = { gold = 5 }",
        ],
    );
}

#[test]
fn absent_robots() {
    // Absent robots do not block others, but may not start in a wall.
    let team = |x_m| {
        format!(
            "[[robots]]\nname = 'a'\nstart = {{ x_m = 3, y_m = 3 }}\n\
             [[robots]]\nname = 'b'\nabsent = true\nstart = {{ x_m = {x_m}, y_m = 3 }}"
        )
    };
    parse(&team(3.1));
    let texts = [
        "[[robots]]\nname = 'a'\nabsent = true\n[[robots]]\nname = 'b'\nabsent = true",
        "[[robots]]\nname = 'a'\nabsent = 1",
        &team(0.1),
    ];
    refused("absent_robots", &texts);
}

#[test]
fn faults() {
    let timeline = [
        "fault.drop = { p = 1.5 }",
        "[faults.timeline.fault.drop]\nfrom = 'red'\np = 0.5",
        "fault.drop = { from = 'blue' }",
        "fault.drop = { p = 0.5, form = 'blue' }",
        "at_s = 3",
        "fault.mute = 3",
        "fault.kil = 'blue'",
        "at_s = -1\nfault.kill = 'blue'",
        "when = 'blue naps'\nfault.kill = 'blue'",
        "fault.add = 'blue'",
        "fault.sensor = { robot = 'blue', device = 'zone', mode = 'dead' }",
        "fault.actuator = { robot = 'blue', mode = { slowed = 2 } }",
        "id = 'a'\nfault.mute = 'blue'\n[[faults.timeline]]\nid = 'a'\nfault.deaf = 'blue'",
        "id = 'random-1'\nfault.mute = 'blue'\n[faults.random]",
    ]
    .map(|fault| format!("[[faults.timeline]]\n{fault}"));
    let random = [
        "\nmtbf_s = 0",
        "\nmttr_s = -1",
        "\nmtbf_h = 8",
        ".mix]\nkill = -1",
        ".mix]\nkill = 0\npause = 0\nlink = 0\nsensor = 0\nactuator = 0\npower = 0\nbabble = 0",
        "\nmtbf_s = 0.01\nmttr_s = 0.02",
    ]
    .map(|rest| match rest.strip_prefix('.') {
        Some(_) => format!("[faults.random{rest}"),
        None => format!("[faults.random]{rest}"),
    });
    let texts: Vec<&str> = timeline.iter().chain(&random).map(String::as_str).collect();
    refused("faults", &texts);
    parse("[faults.random]");
}

#[test]
fn deep_nesting() {
    let dots = "a.".repeat(100_000);
    for text in [
        format!("{dots}x = 1"),
        format!("[{dots}x]"),
        format!("x = {}", "[".repeat(100_000)),
    ] {
        let refusal = read(&text).unwrap_err().to_string();
        assert!(
            refusal.starts_with("s.toml:1: ") && refusal.contains("recurs"),
            "{refusal}"
        );
    }
}

#[test]
fn too_much() {
    let spills: String = (0..10_001)
        .map(|number| format!("[[waste.spills]]\nname = 's{number}'\nitems = 1000\n"))
        .collect();
    let waste = |items: u32| {
        format!(
            "[faults]\ntimeline = [{{ every_s = 0.3, fault = {{ waste = {{ x_m = 1, y_m = 1, items = {items} }} }} }}]\n"
        )
    };
    parse(&waste(50));
    let refusal = |text: &str| read(text).unwrap_err().to_string();
    let answers =
        entry("10,001,000 items", &refusal(&spills)) + &entry(&waste(1000), &refusal(&waste(1000)));
    insta::assert_snapshot!(answers);
}

#[test]
fn without_a_file_the_error_starts_with_the_key() {
    let scenario = Scenario {
        step_ms: 0,
        ..default_scenario()
    };
    let error = Setup::resolve(scenario, 1, None).unwrap_err();
    assert!(error.to_string().starts_with("step_ms: "), "{error}");
}

#[test]
fn only_foraging_has_a_duration() {
    let texts = ["[waste]\nduration_s = 60", "[waste]\nrespawn = 1"];
    refused("only_foraging_has_a_duration", &texts);
    let scenario = parse("[waste]\nrespawn = true\nduration_s = 60");
    assert!(!scenario.mission().expected_properties(&scenario).ends);
}

/// Draws fragments of scenario files, similar enough to real ones to reach every check.
fn scraps() -> impl Strategy<Value = String> {
    let scrap = prop::sample::select(vec![
        "[room]",
        "[[robots]]",
        "[[waste.spills]]",
        "[alliance.defaults]",
        "[alliance.robots.blue.defaults]",
        "[energy]",
        "[[obstacles]]",
        "name = 'a'",
        "name = 'blue'",
        "name = 'blue",
        "start = { x_m = 1, y_m = 1 }",
        "start = {}",
        "width_m = 1e-30",
        "width_m = nan",
        "height_m = -inf",
        "x_m = 9223372036854775807",
        "y_m = 0x7fffffffffffffff",
        "slow_impatience = 5",
        "fast_impatience = 5.0",
        "slow_impatience_toward = { gold = 1 }",
        "items = 4294967296",
        "step_ms = 1979-05-27",
        "= =",
        "]",
        "\u{0}",
        "\"\\u0000\" = 1",
    ]);
    prop::collection::vec(scrap, 0..12).prop_map(|scraps| scraps.join("\n"))
}

proptest! {
    #[test]
    fn any_text_is_read_or_refused_in_one_line(text in prop_oneof![any::<String>(), scraps()]) {
        if let Err(error) = read(&text) {
            let line = error.to_string();
            prop_assert!(line.starts_with("s.toml") && !line.contains(char::is_control), "{}", line);
        }
    }
}

#[test]
fn obstacles_on_stated_places() {
    let block = |x_m: f32, y_m: f32, width_m: f32, height_m: f32| {
        format!(
            "[[obstacles]]\nx_m = {x_m}\ny_m = {y_m}\nwidth_m = {width_m}\nheight_m = {height_m}\n"
        )
    };
    // The spills are discs of 0.8 m at (4, 6) and (4, 3), the deposit is one of 1 m at (9.6, 4.5), and the report site
    // reaches 0.6 m from the left wall between 3 and 6 m.
    let robot = "[[robots]]\nname = 'a'\nstart = { x_m = 6, y_m = 1 }\n[waste]\n";
    let texts = [
        block(3.0, 5.0, 2.0, 2.0),
        block(8.5, 3.4, 2.2, 2.2),
        block(0.1, 2.5, 0.9, 4.0),
    ]
    .map(|block| block + robot);
    refused(
        "obstacles_on_stated_places",
        &texts.each_ref().map(String::as_str),
    );
    // A part of a place is enough, and soft ground covers nothing.
    parse(&block(3.0, 5.0, 1.0, 2.0));
    parse(&(block(3.0, 5.0, 2.0, 2.0) + "penetrability = 0.5"));
}

#[test]
fn a_spill_without_a_way_gives_a_warning() {
    let warned = |walls: &[f32], starts: &[f32]| -> Vec<String> {
        let mut text = String::new();
        for x_m in walls {
            text += &format!("[[obstacles]]\nx_m = {x_m}\ny_m = 0\nwidth_m = 0.2\nheight_m = 9\n");
        }
        text += "[[robots]]\nname = 'a'\n[[robots]]\nname = 'b'\n";
        let starts: Vec<Vec2> = starts.iter().map(|x_m| Vec2::new(*x_m, 1.0)).collect();
        let warnings = WASTE.warnings(&parse(&text), &starts);
        warnings.iter().map(ToString::to_string).collect()
    };
    // The spills are at x = 4 m, the deposit at 9.6 m.
    let to = |index: usize, name: &str| {
        format!(
            "waste.spills[{index}]: obstacles leave no way to spill '{name}'; move it or the obstacles"
        )
    };
    let from = |text: String| {
        let text = text.replace("no way to spill", "no way from spill");
        text.replace("'; ", "' into the nearest deposit; ")
    };
    let (top, bottom) = (to(0, "top"), to(1, "bottom"));
    let site = "waste.report_site: obstacles leave no way to the report site; \
         move the obstacles, or let a robot start there";
    assert_eq!(warned(&[], &[1.0, 1.0]), [""; 0]);
    assert_eq!(warned(&[2.0], &[1.0, 1.0]), [top.clone(), bottom.clone()]);
    assert_eq!(warned(&[2.0], &[1.0, 3.0]), [""; 0], "one robot suffices");
    assert_eq!(warned(&[2.0], &[3.0, 3.0]), [site]);
    assert_eq!(warned(&[6.0], &[1.0, 11.0]), [from(top), from(bottom)]);
}

/// Robots drive into a deposit by more than 0.1 m. Waste goes to the deposit nearest to its spill, also if another one
/// has a way.
#[test]
fn a_deposit_that_no_robot_can_enter_gives_a_warning() {
    let warned = |text: &str| {
        let warnings = WASTE.warnings(&parse(text), &[Vec2::new(1.0, 1.0)]);
        let warnings = warnings.iter().map(ToString::to_string);
        warnings.collect::<Vec<_>>().join("\n")
    };
    let block = |x_m: f32, y_m: f32, width_m: f32, height_m: f32| {
        format!(
            "[[obstacles]]\nx_m = {x_m}\ny_m = {y_m}\nwidth_m = {width_m}\nheight_m = {height_m}\n"
        )
    };
    let expected = |name: &str, index: usize| {
        format!(
            "waste.spills[{index}]: obstacles leave no way from spill '{name}' into the nearest deposit; \
             move it or the obstacles"
        )
    };
    let both = [expected("top", 0), expected("bottom", 1)].join("\n");
    // The deposit has a radius of 1 m round (9.6, 4.5). A robot at its left side stands 0.2 m beside the block.
    assert_eq!(warned(&block(8.75, 3.5, 2.0, 2.0)), both);
    assert_eq!(warned(&block(8.95, 3.5, 2.0, 2.0)), "");
    let further = "[[waste.further_deposits]]\nx_fraction = 0.4\ny_fraction = 0.75\n";
    let covered = block(3.95, 5.9, 1.7, 1.7);
    assert_eq!(warned(&(covered + further)), both);
}
