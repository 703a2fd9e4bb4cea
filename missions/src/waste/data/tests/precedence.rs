//! The precedence of several statements about the same parameter.

use scenario::{Alliance, BehaviorParams, HistoryOrigin, ParameterFile, Setup, StepOrder};

use crate::fixtures::{parse, resolve};
use crate::waste::data::default_scenario;

fn resolved(scenario: &str, parameters: &str) -> Alliance {
    let file = ParameterFile::parse("p.properties", parameters.as_bytes()).unwrap();
    let resolved = Setup::resolve(parse(scenario), 1, Some(&file)).unwrap();
    assert_eq!(resolved.skipped, []);
    resolved.setup.alliance
}

fn of<'a>(alliance: &'a Alliance, robot: &str, set: &str) -> &'a BehaviorParams {
    &alliance.robots[robot].sets[set]
}

/// Only a robot with the side sensor has the methodical set. A robot alone has no teammates.
#[test]
fn built_in_values_differ_by_behavior() {
    let alliance = resolved("", "");
    assert_eq!(alliance.threshold, 100.0);
    let fast = |set| of(&alliance, "blue", set).fast_impatience;
    assert_eq!(fast("find-locations-methodical"), 20.0);
    assert_eq!(fast("find-locations-wander"), 5.0);
    assert_eq!(fast("move-spill(top)"), 10.0);
    assert_eq!(fast("report-progress"), 25.0);
    let report = of(&alliance, "gold", "report-progress");
    assert_eq!(
        (report.broadcast_rate_hz, report.ceased_after_s),
        (1.0, 5.0)
    );
    assert_eq!(
        (report.before_yielding_s, report.before_giving_up_s),
        (60.0, 120.0)
    );
    assert_eq!(report.task, "report-progress");
    assert!(report.slow_impatience.keys().eq(["blue", "green"]));
    let [blue, gold] = ["blue", "gold"].map(|robot| &alliance.robots[robot]);
    assert_eq!((blue.sets.len(), gold.sets.len(), gold.rank), (5, 4, 1));
    let alone = resolved("[[robots]]\nname = 'solo'", "");
    assert!(
        of(&alone, "solo", "report-progress")
            .slow_impatience
            .is_empty()
    );
}

/// Each layer states one parameter more than the next stronger layer.
#[test]
fn stronger_layers_win() {
    let alliance = resolved(
        "alliance.threshold = 90
         [alliance.defaults]
         before_yielding_s = 1
         [alliance.sets.report-progress]
         before_yielding_s = 2
         [alliance.robots.blue.defaults]
         before_yielding_s = 3
         [alliance.robots.blue.sets.report-progress]
         before_yielding_s = 4
         [alliance.robots.green.sets.report-progress]
         before_yielding_s = 5",
        "threshold = 80
         timeBeforeYielding.green.move-spill(top) = 7
         timeBeforeYielding.move-spill(top) = 6",
    );
    assert_eq!(alliance.threshold, 80.0);
    let psi = |robot, set| of(&alliance, robot, set).before_yielding_s;
    assert_eq!(psi("gold", "find-locations-wander"), 1.0);
    assert_eq!(psi("gold", "report-progress"), 2.0);
    assert_eq!(psi("blue", "find-locations-wander"), 3.0);
    assert_eq!(psi("blue", "report-progress"), 4.0);
    assert_eq!(psi("green", "report-progress"), 5.0);
    assert_eq!(psi("blue", "move-spill(top)"), 6.0);
    assert_eq!(
        psi("green", "move-spill(top)"),
        7.0,
        "ROBOT.SET overrides SET in any order"
    );
}

#[test]
fn a_value_for_a_teammate_overrides_plain_values_of_its_own_and_weaker_layers() {
    let alliance = resolved(
        "[alliance.defaults]
         slow_impatience = 0.1
         slow_impatience_toward = { gold = 0.2 }
         willing_to_affect_toward_s = { gold = 11 }
         [alliance.sets.report-progress]
         slow_impatience_toward = { green = 0.3 }
         willing_to_affect_s = 12",
        "",
    );
    let slow = |set, teammate| of(&alliance, "blue", set).slow_impatience[teammate];
    assert_eq!(slow("move-spill(top)", "green"), 0.1);
    assert_eq!(slow("move-spill(top)", "gold"), 0.2);
    assert_eq!(slow("report-progress", "green"), 0.3);
    assert_eq!(slow("report-progress", "gold"), 0.2);
    let phi = |set, teammate| of(&alliance, "blue", set).willing_to_affect_s[teammate];
    assert_eq!(phi("move-spill(top)", "gold"), 11.0);
    assert_eq!(phi("move-spill(top)", "green"), 120.0);
    assert_eq!(
        phi("report-progress", "gold"),
        12.0,
        "the plain value of a stronger layer takes precedence"
    );
}

#[test]
fn first_robot_of_a_key_is_the_teammate() {
    let alliance = resolved(
        "",
        "slowImpatience.gold.move-spill(top) = 0.1\nslowImpatience.gold.blue.move-spill(top) = 0.2\n",
    );
    let slow = |robot| &of(&alliance, robot, "move-spill(top)").slow_impatience;
    assert_eq!((slow("green")["gold"], slow("green")["blue"]), (0.1, 0.5));
    assert_eq!((slow("blue")["gold"], slow("blue")["green"]), (0.2, 0.5));
    assert_eq!((slow("gold")["blue"], slow("gold")["green"]), (0.5, 0.5));
}

#[test]
fn keys_without_a_use_are_skipped_in_the_order_of_the_file() {
    let text = "fastImpatience.red.report-progress = 1
        fastImpatience.push-box = 1
        fastImpatience.blue.report-progress = 30
        slowImpatience.red.report-progress = 1
        # a robot is no teammate of its own, and gold cannot follow walls
        slowImpatience.blue.blue.report-progress = 1
        timeBeforeYielding.gold.find-locations-methodical = 1";
    let file = ParameterFile::parse("p.properties", text.as_bytes()).unwrap();
    let resolved = Setup::resolve(default_scenario(), 1, Some(&file)).unwrap();
    let skipped: Vec<_> = resolved.skipped.iter().map(ToString::to_string).collect();
    assert_eq!(
        skipped,
        [
            "fastImpatience.red.report-progress (line 1)",
            "fastImpatience.push-box (line 2)",
            "slowImpatience.red.report-progress (line 4)",
            "slowImpatience.blue.blue.report-progress (line 6)",
            "timeBeforeYielding.gold.find-locations-methodical (line 7)",
        ]
    );
    let blue = of(&resolved.setup.alliance, "blue", "report-progress");
    assert_eq!(blue.fast_impatience, 30.0);
}

#[test]
fn switches_override_the_preset_one_by_one() {
    let switches = "switches = { history_origin = 'progress', arbitration = true }";
    let text = format!("[alliance]\npreset = 'thesis'\n{switches}");
    let switches = resolved(&text, "").switches;
    assert_eq!(switches.history_origin, HistoryOrigin::Progress);
    assert!(switches.arbitration && switches.reset_stops_active);
}

#[test]
fn the_step_order_is_the_scenarios_then_that_of_the_switches_then_the_presets() {
    let order = |text: &str| resolve(parse(text)).step_order;
    assert_eq!(order(""), StepOrder::Simultaneous);
    assert_eq!(order("alliance.preset = 'thesis'"), StepOrder::InOrder);
    let switch = "alliance.switches.step_order = 'in-order'";
    assert_eq!(order(switch), StepOrder::InOrder);
    let own = "step_order = 'simultaneous'\nalliance.preset = 'thesis'";
    assert_eq!(order(own), StepOrder::Simultaneous);
    let mut scenario = parse(switch);
    scenario.set_step_order(StepOrder::Simultaneous);
    assert_eq!(resolve(scenario).step_order, StepOrder::Simultaneous);
}

/// The table of docs/ALLIANCE.md.
#[test]
fn presets_match_their_sources() {
    let (start, progress) = ("mission-start", "progress");
    let table = [
        ("waiting", ["yes", "no", "yes"]),
        ("waiting_counts", ["yes", "no", "no"]),
        ("wish_when_suppressed", ["yes", "no", "no"]),
        ("reset_stops_active", ["yes", "no", "no"]),
        ("history_origin", [start, start, progress]),
        ("step_order", ["in-order", "simultaneous", "simultaneous"]),
        ("arbitration", ["no", "no", "yes"]),
        ("release_message", ["yes", "no", "yes"]),
        ("idle_heartbeat", ["no", "no", "yes"]),
    ];
    let columns = ["thesis", "par98", "team"].map(|name| {
        let setup = resolve(parse(&format!("[alliance]\npreset = '{name}'")));
        serde_json::to_value(&setup).unwrap()["alliance"]["switches"].clone()
    });
    for column in &columns {
        assert_eq!(column.as_object().unwrap().len(), table.len());
    }
    for (switch, expected) in table {
        let actual = columns.each_ref().map(|column| match &column[switch] {
            serde_json::Value::Bool(true) => "yes",
            serde_json::Value::Bool(false) => "no",
            other => other.as_str().unwrap(),
        });
        assert_eq!(actual, expected, "{switch}");
    }
}
