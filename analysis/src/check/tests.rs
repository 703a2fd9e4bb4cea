//! Forecasts and warnings against values calculated by hand.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use missions::waste::data::{BehaviorKind, default_setup};
use scenario::mission::data::{BehaviorProperties, MissionData, MissionVocabulary};
use scenario::mission::registry::{Mission, read_section};
use scenario::mission::section::Section;
use scenario::{BehaviorSpec, Problem, Scenario, Setup, UntypedTable};

use super::forecast::{Forecast, rise_time_s};
use super::warnings::WarningKind::{self, *};
use super::*;
use crate::testkit;

fn setup(text: &str) -> Setup {
    testkit::setup(testkit::scenario(text))
}

fn of(setup: &Setup, robot: &str, set: &str) -> Forecast {
    let mut forecasts = forecasts(setup).into_iter();
    let wanted = |forecast: &Forecast| forecast.robot == robot && forecast.set == set;
    forecasts.find(wanted).unwrap()
}

#[track_caller]
fn assert_near(actual: f64, expected: f64) {
    assert!(
        (actual - expected).abs() < 1e-9,
        "{actual} instead of {expected}"
    );
}

/// Parameters of the example in docs/ALLIANCE.md §4: θ=100, δ_fast=5, δ_slow=1.
#[test]
fn rise_times_match_the_documented_example() {
    for (slow_s, expected) in [
        (0.0, 20.0),
        (30.0, 44.0),
        (300.0, 100.0),
        (12.0 + 5.0, 33.6),
    ] {
        assert_near(rise_time_s(100.0, 1.0, 5.0, slow_s), expected);
    }
}

const TWO: &str = "
[[robots]]
name = 'blue'
[[robots]]
name = 'gold'
[alliance.defaults]
fast_impatience = 5.0
slow_impatience = 1.0
ceased_after_s = 5.0
";

/// Returns the times of a takeover of gold's move-spill(top) from blue: (silent, failing, working).
fn takeover(parameters: &str, switches: &str) -> (f64, f64, Option<f64>) {
    let setup = setup(&format!(
        "{TWO}{parameters}\n[alliance.switches]\n{switches}"
    ));
    let gold = of(&setup, "gold", "move-spill(top)");
    let [toward] = gold.takeovers.as_slice() else {
        panic!("{gold:?}");
    };
    assert_eq!(
        (toward.teammate.as_str(), toward.set.as_str()),
        ("blue", "move-spill(top)")
    );
    (toward.silent_s, toward.failing_s, toward.working_s)
}

#[test]
fn takeovers_match_hand_calculation() {
    // A unit of work takes 26 s. Silent: slow for τ = 5 s, 5 + 95/5 = 24 s.
    let literal = "waiting = false\nhistory_origin = 'mission-start'";
    let request = "waiting_counts = true\nreset_stops_active = true";
    let (psi, lambda) = (1000.0, 2000.0);
    // φ, ψ, λ, switches, and the times until the takeover.
    let table = [
        // Gold is at θ after 44 s and waits until blue yields.
        (30.0, 80.0, 90.0, "", (24.0, 80.0, None)),
        // Blue has been active for longer than its ψ by then.
        (30.0, 40.0, 90.0, "", (24.0, 44.0, None)),
        // Blue gives up at 50 s, when gold is at 50: 50 + 50/5.
        (300.0, 40.0, 50.0, "", (24.0, 60.0, None)),
        // Without a release message, gold continues slowly for τ: 55 + 45/5.
        (
            300.0,
            40.0,
            50.0,
            "release_message = false",
            (24.0, 64.0, None),
        ),
        // Gold reaches θ at the slow rate. The wait is bounded by its ψ + τ, and blue's ψ is less.
        (300.0, psi, lambda, "", (24.0, 1000.0, None)),
        // Without waiting, gold activates beside blue at 44 s, also if blue is working: the history is literal.
        (30.0, psi, lambda, literal, (24.0, 44.0, Some(44.0))),
        // The request itself deactivates blue.
        (30.0, 80.0, 90.0, request, (24.0, 44.0, None)),
        // Patience ends before a unit of work: φ = 1 s, 1 + 99/5 = 20.8 s.
        (1.0, 15.0, 90.0, "", (20.8, 20.8, Some(20.8))),
    ];
    for (phi, psi, lambda, switches, expected) in table {
        let parameters = format!(
            "willing_to_affect_s = {phi:?}\nbefore_yielding_s = {psi:?}\nbefore_giving_up_s = {lambda:?}"
        );
        let (silent, failing, working) = takeover(&parameters, switches);
        assert_near(silent, expected.0);
        assert_near(failing, expected.1);
        assert_eq!(working.is_some(), expected.2.is_some(), "{parameters}");
        assert_near(working.unwrap_or_default(), expected.2.unwrap_or_default());
    }
}

#[test]
fn a_robot_waits_at_most_psi_plus_tau_for_a_persistent_teammate() {
    // Gold's ψ + τ is 65 s after θ at 44 s; blue's ψ is 1000 s.
    let (_, failing, _) = takeover(
        "willing_to_affect_s = 30.0
         before_yielding_s = 60.0
         before_giving_up_s = 2000.0
         [alliance.robots.blue.defaults]
         before_yielding_s = 1000.0",
        "",
    );
    assert_near(failing, 44.0 + 65.0);
}

#[test]
fn a_fast_robot_waits_until_a_silent_teammate_is_considered_lost() {
    let (silent, ..) = takeover(
        "[alliance.robots.gold.defaults]\nfast_impatience = 100.0",
        "",
    );
    // 5 s slowly, then 0.95 s.
    assert_near(silent, 5.95);
    let fast =
        "[alliance.robots.gold.defaults]\nfast_impatience = 100.0\nwilling_to_affect_s = 0.5";
    // Gold reaches θ at 0.5 + 0.995 s, but blue is considered lost only after τ.
    assert_near(takeover(fast, "").0, 5.0);
    assert_near(takeover(fast, "waiting = false").0, 1.495);
}

#[test]
fn each_method_of_finding_has_a_takeover() {
    let setup = default_setup(1);
    let wander = of(&setup, "gold", "find-locations-wander");
    let from: Vec<(&str, &str)> = wander
        .takeovers
        .iter()
        .map(|takeover| (takeover.teammate.as_str(), takeover.set.as_str()))
        .collect();
    assert_eq!(
        from,
        [
            ("blue", "find-locations-methodical"),
            ("blue", "find-locations-wander"),
            ("green", "find-locations-wander"),
        ]
    );
    assert_near(wander.activates_s, 20.0);
    assert_near(
        of(&setup, "blue", "find-locations-methodical").activates_s,
        5.0,
    );
}

#[test]
fn units_of_work_of_the_default_room() {
    let Setup {
        scenario, catalog, ..
    } = default_setup(1);
    let unit = |kind| {
        let mut sets = catalog.sets.iter();
        let set = sets
            .find(|set| BehaviorKind::from_spec(set) == kind)
            .unwrap();
        catalog.mission.work_unit_s(&scenario)(&scenario.body, 1.0, set)
    };
    // 12 m at 0.5 m/s, 90° at 90°/s.
    assert!((unit(BehaviorKind::FindLocationsMethodical) - 25.0).abs() < 1e-4);
    // From (9.6, 4.5) to (4, 6): √(5.6² + 1.5²) = 5.797 m, less 0.2 m for the radii of deposit and spill.
    assert!((unit(BehaviorKind::MoveSpill(0)) - (2.0 * 5.597_411 / 0.5 + 4.0)).abs() < 1e-3);
    // From x = 9.6 m to 0.6 m, and 180°.
    assert!((unit(BehaviorKind::ReportProgress) - 20.0).abs() < 1e-4);
}

/// Returns the warnings of a scenario file: (kind, set, number of robots).
fn broken(text: &str) -> Vec<(WarningKind, String, usize)> {
    let warnings = Check::new(&setup(text), &[]).warnings.into_iter();
    warnings
        .map(|warning| (warning.kind, warning.set, warning.robots.len()))
        .collect()
}

#[test]
fn the_default_mission_has_no_warnings() {
    assert_eq!(broken(""), []);
}

#[test]
fn each_rule_gives_its_warning() {
    let top = |line: &str| format!("[alliance.sets.'move-spill(top)']\n{line}");
    let of = |robot: &str, line: &str| {
        format!("[alliance.robots.{robot}.sets.'move-spill(top)']\n{line}")
    };
    let brief = "before_giving_up_s = 20.0\nwilling_to_affect_s = 10.0";
    let two = "[[robots]]\nname = 'blue'\n[[robots]]\nname = 'gold'";
    let (spill, report) = ("move-spill(top)", "report-progress");
    let table = [
        (top("before_yielding_s = 20.0"), (YieldsTooEarly, spill, 3)),
        (top(brief), (GivesUpTooEarly, spill, 3)),
        (
            top("before_giving_up_s = 100.0"),
            (PatienceUnused, spill, 3),
        ),
        // Blue's λ against the others' φ toward it.
        (
            of("blue", "before_giving_up_s = 100.0"),
            (PatienceUnused, spill, 1),
        ),
        (top("ceased_after_s = 1.9"), (SilenceTooShort, spill, 3)),
        // Green sends heartbeats less often than blue and gold expect them.
        (
            of("green", "broadcast_rate_hz = 0.21"),
            (SilenceTooShort, spill, 2),
        ),
        (
            "[waste]\nreport_period_s = 23.0".to_owned(),
            (ReportsLate, report, 3),
        ),
        (two.to_owned(), (ReportsLate, report, 2)),
    ];
    for (text, (kind, set, robots)) in table {
        assert_eq!(broken(&text), [(kind, set.to_owned(), robots)], "{text}");
    }
}

#[test]
fn a_heartbeat_period_is_rounded_up_to_steps() {
    // 1/ρ = 0.9 s is two steps of 0.5 s: τ = 1.9 s is less than two periods, 2 s is not.
    let text = |tau| {
        format!(
            "step_ms = 500\n[alliance.defaults]\nbroadcast_rate_hz = 1.1112\nceased_after_s = {tau}"
        )
    };
    let short = broken(&text("1.9"));
    assert!(!short.is_empty() && short.iter().all(|warning| warning.0 == SilenceTooShort));
    assert_eq!(broken(&text("2.0")), []);
}

#[test]
fn a_single_robot_has_no_takeovers() {
    let setup = setup("[[robots]]\nname = 'solo'");
    let check = Check::new(&setup, &[]);
    let mut forecasts = check.forecasts.iter();
    assert!(forecasts.all(|forecast| forecast.takeovers.is_empty()));
    assert!(show::text(&setup, &check).contains('-'));
}

/// A mission of recurring tasks that counts the calls for properties.
#[derive(Debug)]
struct Counted(AtomicUsize);

static COUNTED: Counted = Counted(AtomicUsize::new(0));

impl MissionData for Counted {
    fn section(&self, text: UntypedTable<'_>) -> Result<Box<dyn Section>, Problem> {
        read_section::<()>(text)
    }

    fn vocabulary(&self) -> MissionVocabulary {
        MissionVocabulary::NONE
    }

    fn catalog(&self, _: &Scenario) -> (Vec<String>, Vec<BehaviorSpec>) {
        (Vec::new(), Vec::new())
    }

    fn behavior_properties(&self, _: &Scenario, _: &BehaviorSpec) -> BehaviorProperties {
        self.0.fetch_add(1, Ordering::Relaxed);
        BehaviorProperties {
            recurrence_s: Some(1e6),
            ..BehaviorProperties::default()
        }
    }
}

/// The work of a check grows with the number of recurring tasks, not with its square.
#[test]
fn each_set_is_compared_with_continuing_tasks_once() {
    let mut setup = setup(
        "limit_s = 100000.0\n[service]\n[[service.kinds]]\nname = 'k'\n\
         work_s = { min = 1.0, max = 2.0 }\n[[service.random]]\nn = 100\nkind = 'k'\n",
    );
    Arc::make_mut(&mut setup.catalog).mission =
        Mission::new("counted", "tasks that count calls", &COUNTED);
    let forecasts = forecasts(&setup);
    let sets = setup.catalog.sets.len();
    assert_eq!(sets, 100);
    let _ = warnings(&setup, &forecasts);
    let calls = COUNTED.0.load(Ordering::Relaxed);
    assert_eq!(calls, sets + forecasts.len());
}
