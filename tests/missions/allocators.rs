//! Every allocator in whole missions: under faults, alone, in large teams and in each mission. `parity.rs` compares
//! processes with one process.

use std::collections::BTreeMap;

use alliance_tests::harness::Lab;
use alliance_tests::runs::{Events, allocators, builtin, checked, parse, play, run};
use alliance_tests::runs::{setup, without_allocators};
use alliance_tests::testkit::{KILL, PARTITION, RESTART, loss, loss_and_kill};
use missions::waste::data::family;
use proto::tick::Outcome;
use run_log::{
    AllocationMessageRow, AllocationRow, LogLevel, MessageRow, MotivationRow, RunLog, Table,
};
use scenario::Scenario;
use scenario::testkit::entry;
use scenario::time::SimTime;

/// A step of the default mission.
const STEP: SimTime = SimTime(50);

/// The allocators whose robots do not work on a claimed task.
const CLAIMANTS: &str = "first-come cbaa cbba acbba grape ble murdoch ssi dhba pi hipc";

/// A mission of service in which another robot can always take over.
const SERVICE: &str = include_str!("../../analysis/sweeps/allocators-service.toml");

/// Returns the default mission with additional lines.
pub fn scenario(allocator: &str, rest: &str) -> Scenario {
    parse(&format!(
        "allocator = \"{allocator}\"\nlimit_s = 1800.0\n{rest}"
    ))
}

/// Returns the mission of service with additional lines.
pub fn service(allocator: &str, rest: &str) -> Scenario {
    let plan: toml::Table = toml::from_str(SERVICE).unwrap();
    let mission = toml::to_string(&plan["scenario"]).unwrap();
    parse(&format!("allocator = \"{allocator}\"\n{rest}{mission}"))
}

/// Returns the outcome of a mission in which another robot can take over. With `static` no robot takes over from a
/// lost robot, and a robot does only its own assigned and known tasks and does not search.
fn expected(allocator: &str, is_alone: bool) -> Outcome {
    match allocator {
        "static" if is_alone => Outcome::TimeLimit,
        _ => Outcome::Complete,
    }
}

/// The invariants hold in each tick, and all items are delivered. Law G5: a robot with all skills completes alone, with
/// all links cut.
#[test]
fn missions_complete_under_every_fault_and_with_all_links_cut() {
    let (some_lost, all_lost) = (loss(0.6), loss(1.0));
    for allocator in allocators() {
        for (faults, is_alone) in [
            (KILL, true),
            (RESTART, false),
            (&*some_lost, false),
            (PARTITION, false),
            (&*all_lost, true),
        ] {
            let mut scenario = scenario(allocator, faults);
            let is_checked = faults != all_lost;
            scenario.limit_s = if is_checked { 1800.0 } else { 3600.0 };
            let (outcome, _, violation) = checked(scenario, LogLevel::Off);
            assert!(
                !is_checked || violation.is_none(),
                "{allocator}: {violation:?}"
            );
            let expected = expected(allocator, is_alone);
            assert_eq!(outcome, expected, "{allocator}: {faults}");
        }
    }
}

/// Returns the time of the last message that is received from gold, of any kind or of one kind.
fn last_received(log: &RunLog, kind: &str) -> SimTime {
    let rows = log.each_row::<MessageRow>().map(|row| row.unwrap());
    let is_received = |row: &MessageRow| row.sender == "gold" && row.delivery == "received";
    let of_kind = |row: &MessageRow| kind.is_empty() || row.kind == kind;
    let times = rows.filter(|row| is_received(row) && of_kind(row));
    times.map(|row| row.t_ms).max().unwrap()
}

/// Returns the time of gold's last consensus table.
fn last_table(log: &RunLog) -> SimTime {
    let rows = log.each_row::<AllocationMessageRow>();
    let rows = rows.map(|row| row.unwrap());
    let tables = rows.filter(|row| row.sender == "gold" && row.kind == "belief");
    tables.map(|row| row.t_ms).max().unwrap()
}

/// Another robot takes the task of a killed robot in the step that the rule of the allocator states.
#[test]
fn the_task_of_a_killed_robot_is_taken_over_in_the_stated_step() {
    let tau = SimTime(5000);
    for allocator in CLAIMANTS.split(' ') {
        let (outcome, log) = play(scenario(allocator, KILL), 1);
        assert_eq!(outcome, Outcome::Complete, "{allocator}");
        let activations = log.events("activated");
        let (before, after): (Vec<_>, Vec<_>) =
            activations.iter().partition(|row| row.t_ms.0 <= 100_000);
        let task = before.iter().rfind(|row| row.robot == "gold").unwrap();
        let mut after = after.into_iter();
        let next = after.find(|row| row.detail == task.detail && row.robot != "gold");
        let next = next.unwrap();
        let last = |kind: &str| last_received(&log, kind);
        let (due, reason) = match allocator {
            "first-come" => (last("heartbeat") + tau, "claimed"),
            // A table row is valid for τ after its receipt.
            "ble" => (last("allocation") + tau, "claimed"),
            // A claim is valid for τ after it was sent, one step before its receipt.
            "cbaa" | "cbba" | "pi" => (last("allocation").since(STEP) + tau, "claimed"),
            // Broadcasts of costs are not news of a claim.
            "hipc" => (last_table(&log) + tau, "claimed"),
            // Any message is a sign of life.
            "acbba" | "grape" | "dhba" => (last("").since(STEP) + tau, "claimed"),
            // All robots bid in the same step, and receive the bids in the next.
            "ssi" => (last("").since(STEP) + tau + STEP, "awarded"),
            // One step until the lease ends, half a second of bids, one step until the award is received.
            _ => {
                let auction = SimTime(6000 + 500) + STEP + STEP;
                (last("allocation") + auction, "awarded")
            }
        };
        // Robots that wait for the end of a unit of work take over later.
        let may_wait = ["first-come", "grape", "ssi", "pi"].contains(&allocator);
        let is_in_time = next.t_ms == due || (may_wait && next.t_ms > due);
        assert!(is_in_time, "{allocator}: {next:?}, due at {due}");
        assert_eq!(next.reason, reason, "{allocator}");
    }
}

/// Both sides of a partition do all tasks. After it has healed, one robot keeps each task, as soon as it has put down
/// its load.
#[test]
fn a_healed_partition_has_no_duplicate_tasks() {
    for allocator in CLAIMANTS.split(' ') {
        let (_, log) = play(scenario(allocator, PARTITION), 1);
        let mut at: BTreeMap<(SimTime, String), u32> = BTreeMap::new();
        for row in log.each_row::<AllocationRow>().map(|row| row.unwrap()) {
            if row.state == "active" {
                *at.entry((row.t_ms, row.task)).or_default() += 1;
            }
        }
        let duplicate_s = |from_s: f64, to_s: f64| {
            let is_within = |t_ms: &SimTime| (from_s..to_s).contains(&t_ms.as_secs_f64());
            let within = at.iter().filter(|((t_ms, _), _)| is_within(t_ms));
            let surplus: u32 = within.map(|(_, count)| count - 1).sum();
            f64::from(surplus) * STEP.as_secs_f64()
        };
        let (during, after) = (duplicate_s(60.0, 120.0), duplicate_s(121.5, 3600.0));
        assert!(during > 10.0, "{allocator}: {during} s");
        let load_s = if allocator == "murdoch" { 20.0 } else { 0.0 };
        assert!(after <= 1.0 + load_s, "{allocator}: {after} s");
    }
}

#[test]
fn static_never_takes_over() {
    let (_, log) = play(scenario("static", KILL), 1);
    let of_gold = log.events_of("gold", "activated");
    assert!(!of_gold.is_empty());
    let mut later = log.events("activated");
    later.retain(|row| row.t_ms.0 > 100_000);
    let is_taken = |task: &String| of_gold.iter().any(|row| row.detail == *task);
    assert!(!later.iter().any(|row| is_taken(&row.detail)));
}

#[test]
fn a_robot_without_radio_acts_the_same_with_all_links_cut() {
    let is_alike = |allocator: &str| {
        let [open, cut] = ["", loss(1.0).as_str()].map(|faults| {
            let scenario = scenario(allocator, faults);
            run(setup(scenario, 1), LogLevel::Full).1.into_sink()
        });
        open.tables[&Table::Poses] == cut.tables[&Table::Poses]
    };
    assert!(is_alike("nearest-silent"));
    assert!(!is_alike("nearest"));
}

/// The oracle counts a robot out in the step in which it can no longer work, and counts it in when it can work again.
#[test]
fn the_oracle_counts_only_robots_that_can_work() {
    for (fault, counts_once_more) in [("kill", true), ("babble", false), ("power", false)] {
        let faults =
            format!("[[faults.timeline]]\nat_s = 100.0\nfor_s = 60.0\nfault.{fault} = \"gold\"\n");
        let (outcome, log) = play(scenario("oracle", &faults), 1);
        assert_eq!(outcome, Outcome::Complete, "{fault}");
        let rows = log.rows::<AllocationRow>().unwrap();
        let held = |from_ms: u64, to_ms: u64| {
            let is_within = |row: &&AllocationRow| (from_ms..to_ms).contains(&row.t_ms.0);
            let within = rows.iter().filter(is_within);
            within.filter(|row| row.holder == "gold").count()
        };
        let since_ms = 100_000 + if counts_once_more { STEP.0 } else { 0 };
        assert!(held(99_000, since_ms) > 0, "{fault}");
        assert_eq!(held(since_ms, 160_000), 0, "{fault}");
        assert!(held(160_000, u64::MAX) > 0, "{fault}");
    }
}

/// The invariants hold in each tick of a large team and of other missions, with a crash and message loss, and some work
/// is done.
#[test]
fn thirty_robots_clean_and_small_teams_push_and_observe() {
    for allocator in allocators() {
        for (mission, victim, at_s, figure) in [
            ("", "r1", 100.0, "items.delivered"),
            ("parker-box", "blue", 30.0, "strokes"),
            ("cmommt-crowded", "gold", 30.0, "a"),
        ] {
            let (mut scenario, limit_s) = match mission {
                "" => (family(30, 20), 200.0),
                name => (builtin(name), 120.0),
            };
            scenario.allocator = Some(allocator.to_owned());
            scenario.limit_s = scenario.limit_s.min(limit_s);
            scenario.faults.timeline = loss_and_kill(victim, at_s);
            let (_, log, violation) = checked(scenario, LogLevel::Off);
            assert_eq!(violation, None, "{mission} by {allocator}");
            let figure = log.run.result.mission.get(figure).number().unwrap();
            assert!(figure > 0.0, "{mission} by {allocator}");
        }
    }
}

#[test]
fn the_service_work_of_a_crashed_robot_is_done() {
    let kill = "faults.timeline = [{ fault.kill = \"gold\", when = \"gold finishes\" }]\n";
    // `threshold` leaves its tasks so often that the test would take long.
    for allocator in allocators().filter(|name| *name != "threshold") {
        let (outcome, log, violation) = checked(service(allocator, kill), LogLevel::Off);
        assert_eq!(violation, None, "{allocator}");
        assert_eq!(outcome, expected(allocator, true), "{allocator}");
        let done = log.run.result.mission.get("done").count();
        assert_eq!(done == 24, allocator != "static", "{allocator}: {done}");
    }
}

#[test]
fn a_team_can_mix_allocators_and_the_command_line_overrides_them() {
    let lab = Lab::new();
    let mixed = "limit_s = 60\n[[robots]]\nname = \"blue\"\nside_sensor = true\n\
                 [[robots]]\nname = \"gold\"\nallocator = \"nearest\"\n";
    lab.write("mixed.toml", mixed);
    lab.mission("mixed", "mixed.toml").expect(1);
    let log = lab.log("mixed");
    let weighed = log.rows::<AllocationRow>().unwrap();
    assert!(!weighed.is_empty() && weighed.iter().all(|row| row.robot == "gold"));
    let motivated = log.rows::<MotivationRow>().unwrap();
    assert!(!motivated.is_empty() && motivated.iter().all(|row| row.robot == "blue"));

    let all = "mixed.toml --allocator static";
    lab.mission("all", all).expect(1);
    assert!(lab.log("all").rows::<MotivationRow>().unwrap().is_empty());
}

#[test]
fn bad_allocator_input_gives_one_line_with_its_place() {
    let lab = Lab::new();
    let texts = [
        "allocator = \"nearst\"\n",
        "\n[allocators.random]\nredraws = 1.0\n",
        "[allocators.nearest]\nredraw_s = 1.0\n",
        "[allocators.random]\nredraw_s = -1.0\n",
    ];
    let answers = texts.map(|text| {
        lab.write("s.toml", text);
        entry(text, &lab.refusal("run s.toml --out none"))
    });
    let unknown = "run --out none --allocator telepathy";
    let unknown = entry(unknown, &lab.refusal(unknown));
    insta::assert_snapshot!(without_allocators(&(answers.concat() + &unknown)));
    assert!(!lab.exists("none"));
}

#[test]
fn allocators_are_listed_with_their_parameters() {
    let lab = Lab::new();
    let listed = |name: &str| lab.run(format!("list allocators {name}")).expect(0).stdout;
    let all = listed("");
    for name in allocators() {
        assert!(all.lines().any(|line| line.starts_with(name)), "{all}");
    }
    assert!(listed("random").contains("redraw_s = 30 s"));
    assert!(listed("threshold").contains("theta_max = 1000"));
    lab.run("list allocators telepathy").expect(2);
}
