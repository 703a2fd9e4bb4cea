//! The laws of service with task properties, for every allocator on random instances.

#![allow(clippy::unwrap_used)] // Clippy exempts test functions only, not their helpers.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use in_process::Team;
use missions::Registry;
use missions::service::data::{ServiceSection, Terms, points, predecessors, terms};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use run_log::{EventRow, LogLevel, MemoryLog, PoseRow, RunLog};
use scenario::time::SimTime;
use scenario::{Robot, Scenario, Setup};

/// The number of instances of each class, with one allocator each. The environment variable sets another one.
const INSTANCES: u64 = 60;

fn instances() -> u64 {
    let stated = std::env::var("ALLIANCE_LAW_INSTANCES").ok();
    stated.map_or(INSTANCES, |number| number.parse().expect("a whole number"))
}

/// A run of an instance, as the laws see it.
struct Run {
    scenario: Scenario,
    seed: u64,
    events: Vec<EventRow>,
    log: RunLog,
}

/// Runs a scenario to its end, and checks the invariants of the mission after each tick.
fn run(text: &str, seed: u64) -> Run {
    let vocabulary = Registry::built_in().vocabulary();
    let scenario = Scenario::parse("s.toml", text, &vocabulary);
    let scenario = scenario.unwrap_or_else(|error| panic!("{error}\n{text}"));
    let resolved = Setup::resolve(scenario.clone(), seed, None);
    let setup = resolved.unwrap_or_else(|error| panic!("{error}")).setup;
    let team = Team::new(setup, LogLevel::Full, MemoryLog::default()).unwrap();
    let (_, recorder) = team.run().unwrap();
    let log = RunLog::from_memory(&recorder.into_sink(), &vocabulary).unwrap();
    Run {
        scenario,
        seed,
        events: log.rows().unwrap(),
        log,
    }
}

/// Returns the allocator of an instance: all take turns.
fn allocator(number: u64) -> &'static str {
    let all = Registry::built_in().vocabulary().allocators;
    all[number as usize % all.len()].name
}

/// Returns the first lines of a scenario and a team of 2 to 4 robots, up to the keys of `[service]`. Each skill belongs
/// to about two of three robots, and the first robot has all. `more` contains lines before the robots.
fn team(number: u64, chance: &mut ChaCha8Rng, more: &str, service: &str) -> String {
    let mut text = format!(
        "allocator = '{}'\nlimit_s = 200\nstep_ms = 200\nroom = {{ width_m = 8, height_m = 6 }}\n{more}",
        allocator(number)
    );
    for robot in 0..chance.random_range(2..5) {
        write!(text, "[[robots]]\nname = 'r{robot}'\nskills = {{ ").unwrap();
        let skills = ["a", "b", "c", "arm"]
            .into_iter()
            .filter(|skill| *skill != "arm" || service.contains("uncovered"));
        let skills = skills.filter(|_| robot == 0 || chance.random_bool(0.7));
        let mut skills: Vec<String> = skills.map(|skill| format!("{skill} = 1")).collect();
        if skills.is_empty() {
            skills.push("a = 0.5".to_owned());
        }
        writeln!(text, "{} }}", skills.join(", ")).unwrap();
    }
    write!(text, "[service]\n{service}").unwrap();
    for kind in ["a", "b", "c"] {
        writeln!(
            text,
            "[[service.kinds]]\nname = '{kind}'\nwork_s = {{ min = 2, max = 8 }}\nkept = {}",
            chance.random_bool(0.5)
        )
        .unwrap();
    }
    text
}

/// A point of each kind, so that each robot has a task.
const ONE_OF_EACH: &str = "\
    [[service.points]]\nkind = 'a'\nx_m = 4\ny_m = 3\nvalue = 1.5\n\
    [[service.points]]\nkind = 'b'\nx_m = 5\ny_m = 3\n\
    [[service.points]]\nkind = 'c'\nx_m = 4\ny_m = 4\n";

/// Returns the lines of a point at a random place.
fn point(chance: &mut ChaCha8Rng) -> String {
    let kind = ["a", "b", "c"][chance.random_range(0..3)];
    let (x_m, y_m) = (chance.random_range(1.0..7.0), chance.random_range(1.0..5.0));
    let mut text = format!("[[service.points]]\nkind = '{kind}'\nx_m = {x_m:.2}\ny_m = {y_m:.2}\n");
    if chance.random_bool(0.3) {
        let arrival_s: f64 = chance.random_range(0.0..60.0);
        writeln!(text, "arrival_s = {arrival_s:.1}").unwrap();
    }
    text
}

/// Returns the lines of a random window and value, each with some probability.
fn window(chance: &mut ChaCha8Rng) -> String {
    let mut text = String::new();
    let opens_s: f64 = chance.random_range(0.0..60.0);
    if chance.random_bool(0.6) {
        writeln!(text, "opens_s = {opens_s:.1}").unwrap();
    }
    if chance.random_bool(0.6) {
        let deadline_s = opens_s + chance.random_range(5.0..60.0);
        writeln!(text, "deadline_s = {deadline_s:.1}").unwrap();
    }
    if chance.random_bool(0.6) {
        writeln!(text, "value = {}", chance.random_range(1..20)).unwrap();
    }
    text
}

fn number_of(subject: &str) -> usize {
    subject
        .trim_start_matches('p')
        .parse()
        .expect("the name of a point")
}

/// Checks that the robots at work on a point have its skill, and fill all of its slots.
fn check_crew(run: &Run, number: usize, crew: &BTreeSet<&str>) {
    let section = ServiceSection::of(&run.scenario);
    let robots = run.scenario.robots.iter();
    let robots: Vec<&Robot> = robots
        .filter(|robot| crew.contains(robot.name.as_str()))
        .collect();
    let has = |robot: &Robot, skill: &str| robot.skill(skill).unwrap_or(1.0) > 0.0;
    match section.points.get(number).filter(|point| point.has_needs()) {
        Some(point) if !crew.is_empty() => {
            let slots = point.needs.iter();
            let slots =
                slots.flat_map(|(skill, count)| std::iter::repeat_n(skill, *count as usize));
            let slots: Vec<&String> = slots.collect();
            assert_eq!(crew.len(), slots.len(), "p{number}: {crew:?} for {slots:?}");
            assert!(
                can_fill(&robots, &slots, &has),
                "p{number}: {crew:?} for {slots:?}"
            );
        }
        Some(_) => {}
        None => {
            let kind = section.kinds_of_points().nth(number).unwrap();
            let skill = &section.kinds[kind].name;
            assert!(
                robots.iter().all(|robot| has(robot, skill)),
                "p{number}: {crew:?} without {skill}"
            );
        }
    }
}

/// Returns whether the robots can fill the slots, each robot one.
fn can_fill(robots: &[&Robot], slots: &[&String], has: &impl Fn(&Robot, &str) -> bool) -> bool {
    let Some((slot, rest)) = slots.split_first() else {
        return robots.is_empty();
    };
    (0..robots.len()).any(|index| {
        let others: Vec<&Robot> = robots[..index]
            .iter()
            .chain(&robots[index + 1..])
            .copied()
            .collect();
        has(robots[index], slot) && can_fill(&others, rest, has)
    })
}

/// Checks the laws of all classes.
fn check(run: &Run) {
    let section = ServiceSection::of(&run.scenario);
    let terms = terms(section);
    let of_point = |number: usize| terms.get(number).copied().unwrap_or(Terms::NONE);
    let specs = points(&run.scenario, run.seed);
    let before = predecessors(section);
    let mut outcomes: BTreeMap<usize, &str> = BTreeMap::new();
    let mut crews: BTreeMap<usize, BTreeSet<&str>> = BTreeMap::new();
    let mut now = SimTime::ZERO;
    let (mut collected, mut lost) = (0.0, 0.0);
    for event in &run.events {
        let kind = event.kind.as_str();
        if !["begun", "left", "load-lost", "done", "expired"].contains(&kind) {
            continue;
        }
        if event.t_ms > now {
            now = event.t_ms;
            crews
                .iter()
                .for_each(|(point, crew)| check_crew(run, *point, crew));
        }
        let number = number_of(&event.subject);
        let crew = crews.entry(number).or_default();
        match kind {
            "begun" => assert!(crew.insert(&event.robot), "{event:?} twice"),
            // A robot that carries the load of a point does not leave it.
            "load-lost" => assert!(crew.remove(event.robot.as_str()), "{event:?} without work"),
            "left" => assert!(crew.remove(event.robot.as_str()), "{event:?} without work"),
            "done" => {
                // The event names the robots of the last step.
                let by = event.detail.split_once(", by ");
                let by = by.map(|(_, names)| names.split(", ").collect());
                check_crew(run, number, &by.unwrap_or_else(|| std::mem::take(crew)));
                crew.clear();
            }
            _ => crew.clear(),
        }
        let (opens, closes) = of_point(number).window(0);
        match kind {
            "begun" | "done" => {
                for before in before.get(number).into_iter().flatten() {
                    let outcome = outcomes.get(&usize::from(*before));
                    assert_eq!(outcome, Some(&"done"), "{event:?} before p{before}");
                }
                assert!(event.t_ms >= opens, "{event:?} before {opens}");
                assert!(
                    closes.is_none_or(|closes| event.t_ms < closes),
                    "{event:?} after {closes:?}"
                );
                assert_eq!(
                    outcomes.get(&number),
                    None,
                    "{event:?} of a point that is over"
                );
            }
            "expired" => {
                let is_late = closes.is_some_and(|closes| event.t_ms >= closes);
                let mut before = before.get(number).into_iter().flatten();
                let has_expired =
                    |before: &u16| outcomes.get(&usize::from(*before)) == Some(&"expired");
                assert!(is_late || before.any(has_expired), "{event:?}");
            }
            _ => {}
        }
        if kind == "done" || kind == "expired" {
            assert_eq!(outcomes.insert(number, kind), None, "{event:?} twice");
            *(if kind == "done" {
                &mut collected
            } else {
                &mut lost
            }) += specs[number].value;
        }
    }
    let figure = |name: &str| {
        run.log
            .run
            .result
            .mission
            .get(name)
            .number()
            .unwrap_or(-1.0)
    };
    let sum = ["done", "expired", "unreachable", "uncovered", "open"].map(figure);
    assert_eq!(sum.iter().sum::<f64>(), specs.len() as f64, "{sum:?}");
    assert_eq!(figure("total"), specs.len() as f64);
    let count = |kind: &str| {
        outcomes
            .values()
            .filter(|outcome| **outcome == kind)
            .count() as f64
    };
    assert_eq!(
        (figure("done"), figure("expired")),
        (count("done"), count("expired"))
    );
    assert_eq!(
        (figure("value_collected"), figure("value_lost")),
        (collected, lost)
    );
}

/// Checks that the energy of each robot is between 0 and the capacity, and that a robot without energy has no task.
fn check_energy(run: &Run) {
    let Some(energy) = &run.scenario.energy else {
        return;
    };
    let rows: Vec<PoseRow> = run.log.rows().unwrap();
    for robot in &run.scenario.robots {
        let own = rows.iter().filter(|row| row.robot == robot.name);
        let mut was_empty = false;
        for row in own {
            let left_j = row.energy.unwrap();
            let capacity_j = energy.capacity_j;
            assert!(
                (0.0..=f64::from(capacity_j)).contains(&f64::from(left_j)),
                "{row:?}"
            );
            assert!(
                !(was_empty && left_j == 0.0) || row.behavior_set.is_empty(),
                "{row:?}"
            );
            was_empty = left_j == 0.0;
        }
    }
    let used_j = run.log.run.result.mission.get("energy_used_j").number();
    assert!(used_j > Some(0.0), "{used_j:?}");
}

/// Checks the laws on random instances of a class, and that every third repeats its hash.
fn check_class(name: &str, instance: impl Fn(u64, &mut ChaCha8Rng) -> String) {
    let mut done = 0;
    for number in 0..instances() {
        let text = instance(number, &mut ChaCha8Rng::seed_from_u64(number));
        let first = std::panic::catch_unwind(|| {
            let first = run(&text, number);
            check(&first);
            check_energy(&first);
            first
        });
        let first = first.unwrap_or_else(|_| panic!("{name} {number}:\n{text}"));
        done += first.log.run.result.mission.get("done").count();
        if number % 3 == 0 {
            let again = run(&text, number);
            assert_eq!(
                first.log.run.hash, again.log.run.hash,
                "{name} {number}:\n{text}"
            );
        }
    }
    eprintln!(
        "{name}: {} instances, {done} points done, 0 violations",
        instances()
    );
    assert!(done > 0, "{name}: some points are done");
}

#[test]
fn windows_and_values() {
    check_class("windows", |number, chance| {
        let mut text = team(number, chance, "", "");
        for _ in 0..chance.random_range(3..9) {
            text += &point(chance);
            text += &window(chance);
        }
        text + ONE_OF_EACH + "[[service.random]]\nn = 2\n"
    });
}

#[test]
fn precedence() {
    check_class("precedence", |number, chance| {
        let mut text = team(number, chance, "", "");
        for index in 0..chance.random_range(3..10) {
            text += &point(chance);
            if chance.random_bool(0.3) {
                text += &window(chance);
            }
            let before = (0..index).filter(|_| chance.random_bool(0.4));
            let before: Vec<String> = before.map(|point| format!("'p{point}'")).collect();
            writeln!(text, "after = [{}]", before.join(", ")).unwrap();
        }
        text + ONE_OF_EACH
    });
}

#[test]
fn coalitions() {
    check_class("coalitions", |number, chance| {
        let service = "uncovered = true\nreach_m = 0.6\ncoalition_wait_s = 12\n";
        let mut text = team(number, chance, "", service);
        for index in 0..chance.random_range(3..8) {
            text += &point(chance);
            if chance.random_bool(0.3) {
                text += &window(chance);
            }
            if index > 0 && chance.random_bool(0.2) {
                writeln!(text, "after = ['p{}']", index - 1).unwrap();
            }
            if chance.random_bool(0.7) {
                let skills = ["a", "b", "c", "arm"].into_iter();
                let needs = skills.filter(|_| chance.random_bool(0.35));
                let mut needs: Vec<String> = needs.map(|skill| format!("{skill} = 1")).collect();
                if needs.is_empty() {
                    needs.push("a = 2".to_owned());
                }
                writeln!(text, "needs = {{ {} }}", needs.join(", ")).unwrap();
            }
        }
        text + ONE_OF_EACH
            + "[[service.points]]\nkind = 'a'\nx_m = 3\ny_m = 4\nneeds = { a = 1, arm = 1 }\n"
    });
}

/// Batteries last for about 40 s of driving, so that most robots have to charge.
#[test]
fn endurance() {
    check_class("endurance", |number, chance| {
        let capacity_j = 800.0;
        let energy =
            format!("energy = {{ capacity_j = {capacity_j}, idle_w = 4, drive_w = 16 }}\n");
        let reserve = format!("reserve = {:.2}\n", chance.random_range(0.2..0.5));
        let mut text = team(number, chance, &energy, &reserve);
        for _ in 0..chance.random_range(4..10) {
            text += &point(chance);
            if chance.random_bool(0.3) {
                text += &window(chance);
            }
        }
        for _ in 0..chance.random_range(1..3) {
            let (x_m, y_m) = (chance.random_range(1.0..7.0), chance.random_range(1.0..5.0));
            let rate_w = chance.random_range(20.0..100.0);
            write!(
                text,
                "[[service.chargers]]\nx_m = {x_m:.2}\ny_m = {y_m:.2}\nrate_w = {rate_w:.1}\n"
            )
            .unwrap();
        }
        text + ONE_OF_EACH
    });
}

#[test]
fn deliveries() {
    check_class("deliveries", |number, chance| {
        let mut text = team(number, chance, "", "");
        for _ in 0..chance.random_range(3..9) {
            text += &point(chance);
            if chance.random_bool(0.4) {
                text += &window(chance);
            }
            if chance.random_bool(0.7) {
                let (x_m, y_m) = (chance.random_range(1.0..7.0), chance.random_range(1.0..5.0));
                writeln!(text, "deliver_to = [{x_m:.2}, {y_m:.2}]").unwrap();
            }
        }
        text + ONE_OF_EACH
    });
}
