//! The phases of points, with robots that execute given actions.

mod loads;
mod properties;

use glam::Vec2;
use proptest::prelude::*;
use proto::mission::{Action as AnyAction, Bytes, MAX_ACTION_BYTES, MAX_READING_BYTES};
use proto::readings::Actuation;
use proto::tick::Outcome;
use scenario::fault::{Fault, MissionFault};
use scenario::ids::RobotId;
use scenario::time::SimTime;
use world_server::mission::{FigureValue, TeamFigures};
use world_server::world::{Impairment, World};

use crate::fixtures::{parse, resolve};
use crate::service::bus::{Action, MAX_SENSED, PointFact, SensorReading};
use crate::service::data::POINT;

const GOLD: RobotId = RobotId(0);
const BLUE: RobotId = RobotId(1);

/// Creates a world with two robots within reach of all points, and steps of 0.5 s. Gold has half of the skill for
/// dust, and none for the floor.
fn world(section: &str) -> World {
    let skills = [("garbage", 1.0), ("dust", 0.5), ("floor", 0.0)].into_iter();
    let own = skills.filter(|(kind, _)| section.contains(&format!("name = '{kind}'")));
    let own: Vec<String> = own
        .map(|(kind, skill)| format!("{kind} = {skill}"))
        .collect();
    let gold = format!("name = 'gold'\nskills = {{ {} }}", own.join(", "));
    world_of(&format!(
        "step_ms = 500\n[service]\nreach_m = 1000\n{section}\n[[robots]]\n{gold}\n[[robots]]\nname = 'blue'\n"
    ))
}

fn world_of(text: &str) -> World {
    World::new(&resolve(parse(text)), crate::service::MISSION.world)
}

fn kind(name: &str, work_s: f64, more: &str) -> String {
    format!(
        "[[service.kinds]]\nname = '{name}'\nwork_s = {{ min = {work_s}, max = {work_s} }}\n{more}\n"
    )
}

fn point(kind: &str, arrival_s: f64) -> String {
    format!("[[service.points]]\nkind = '{kind}'\nx_m = 6\ny_m = 4\narrival_s = {arrival_s}\n")
}

/// Returns a section with a kind of work, garbage, and a point of it.
fn garbage(work_s: f64, more: &str) -> String {
    kind("garbage", work_s, more) + &point("garbage", 0.0)
}

fn works(point: u32) -> Option<Actuation> {
    does(Some(point), None)
}

fn does(work: Option<u32>, read: Option<u32>) -> Option<Actuation> {
    Some(Actuation {
        action: AnyAction::new(&Action { work, read }),
        ..Actuation::default()
    })
}

/// Makes a step in which gold and blue execute the commands. Returns events such as `12.5 done gold p0`.
fn step(world: &mut World, commands: [Option<Actuation>; 2]) -> Vec<String> {
    let now_s = world.now().as_secs_f64();
    let events = world.step(&commands);
    world.mission().check_invariants(world).unwrap();
    let text = |event: &run_log::recorder::Event| {
        let name = |robot: RobotId| ["gold", "blue"][robot.index()];
        let robot = event.robot.map_or("-", name);
        format!("{now_s} {} {robot} {}", event.kind, event.subject)
    };
    events.iter().map(text).collect()
}

/// Returns the events until the given time.
fn until(world: &mut World, end_s: f64, commands: [Option<Actuation>; 2]) -> Vec<String> {
    let mut events = Vec::new();
    while world.now() < SimTime::from_secs_f64(end_s) {
        events.extend(step(world, commands));
    }
    events
}

fn end(world: &World) -> Option<Outcome> {
    world.mission().end(world.now())
}

fn row(world: &World) -> Vec<FigureValue> {
    let mut row = Vec::new();
    world.mission().row(&mut row);
    row
}

fn team_figures(world: &World) -> TeamFigures {
    let mut figures = TeamFigures::new(2);
    world.mission().figures(&mut figures);
    figures
}

fn figure(world: &World, name: &str) -> FigureValue {
    team_figures(world).mission.get(name)
}

/// Returns the numbers of points that are done, expired and open.
fn counts(world: &World) -> [u64; 3] {
    ["done", "expired", "open"].map(|name| figure(world, name).count())
}

fn sensed(world: &World, robot: RobotId) -> SensorReading {
    let readings = world.readings(robot).mission;
    readings.value::<SensorReading>().into_owned()
}

/// Returns the numbers of the points in a robot's reading.
fn numbers(world: &World, robot: RobotId) -> Vec<u32> {
    let points = sensed(world, robot).points.into_iter().flatten();
    points.map(|fact| fact.point).collect()
}

/// Work takes time by skill: for 3 s of dust, gold needs 6 s at skill 0.5, and blue 3 s at skill 1.
#[test]
fn work_takes_its_time_by_skill() {
    let section = kind("dust", 3.0, "") + &point("dust", 1.0) + &point("dust", 1.0);
    let mut world = world(&section);
    assert_eq!(until(&mut world, 1.0, [works(0), works(1)]), [""; 0]);
    assert_eq!(
        until(&mut world, 20.0, [works(0), works(1)]),
        [
            "1 arrived - p0",
            "1 arrived - p1",
            "1 begun gold p0",
            "1 begun blue p1",
            "3.5 done blue p1",
            "6.5 done gold p0",
        ]
    );
    assert_eq!(end(&world), Some(Outcome::Complete));
    let mut expected = [0_u32, 0, 2, 0, 0, 0].map(FigureValue::from);
    expected[4] = FigureValue::Real(0.0);
    assert_eq!(row(&world), expected);
}

/// For 3 s of dust, blue needs 6 s with half of its skill 1. Faults of other skills and robots have no effect.
#[test]
fn an_impaired_skill_takes_less_off() {
    let section = kind("dust", 3.0, "") + &kind("garbage", 3.0, "");
    let section = section + &point("dust", 0.0) + &point("garbage", 0.0);
    let mut world = world(&section);
    let impairments = [(BLUE, 0.5), (GOLD, 0.0)].map(|(robot, share)| Impairment {
        robot,
        skill: "dust".to_owned(),
        share,
        was_used: false,
    });
    let mut events = Vec::new();
    while world.now() < SimTime::from_secs_f64(8.0) {
        world.impair(impairments.clone().into_iter());
        events.extend(step(&mut world, [works(1), works(0)]));
        let was_used = world.impairments().iter().map(|each| each.was_used);
        let works = world.now() <= SimTime::from_secs_f64(6.0);
        assert!(was_used.eq([works, false]), "at {}", world.now());
    }
    let begun = ["0 begun gold p1", "0 begun blue p0"];
    assert_eq!(events[2..4], begun);
    assert_eq!(events[4..], ["2.5 done gold p1", "5.5 done blue p0"]);
}

#[test]
fn no_robot_works_without_the_skill_before_arrival_or_beyond_reach() {
    let kinds = kind("floor", 1.0, "") + &kind("garbage", 1.0, "");
    let mut world = world(&(kinds + &point("floor", 0.0) + &point("garbage", 9.0)));
    let events = until(&mut world, 2.0, [works(0), works(1)]);
    assert_eq!(events, ["0 arrived - p0"]);
    assert_eq!(until(&mut world, 3.0, [works(77), None]), [""; 0]);

    let start = "[[robots]]\nname = 'gold'\nstart = { x_m = 5.4, y_m = 4, heading_deg = 0 }\n";
    let section = garbage(1.0, "");
    let text = format!("step_ms = 500\n[service]\nreach_m = 0.5\n{section}{start}");
    let mut world = world_of(&text);
    assert_eq!(step(&mut world, [works(0), None]), ["0 arrived - p0"]);
    let near = Actuation {
        speed_m_s: 0.5,
        ..works(0).unwrap()
    };
    // The robot is 0.6 m away, and 0.35 m after a step.
    assert_eq!(step(&mut world, [Some(near), None]), [""; 0]);
    assert_eq!(step(&mut world, [works(0), None]), ["1 begun gold p0"]);
}

/// The wait of a point ends with the first work on it. Later attempts from the start, and a second robot in the same
/// step, add no wait.
#[test]
fn a_point_waits_once() {
    let mut world = world(&garbage(4.0, "kept = false\nworkers = 2"));
    until(&mut world, 1.0, [None, None]);
    step(&mut world, [works(0), works(0)]);
    let second = FigureValue::Real(1000.0);
    assert_eq!(figure(&world, "wait.mean_ms"), second);
    let left = step(&mut world, [None, None]);
    assert_eq!(left, ["1.5 left gold p0", "1.5 left blue p0"]);
    step(&mut world, [works(0), None]);
    assert_eq!(figure(&world, "wait.mean_ms"), second);
}

/// A second robot at a point for one worker takes no work off, and its time counts as wasted.
#[test]
fn surplus_workers_take_no_work_off() {
    let mut one = world(&garbage(4.0, "workers = 1"));
    let events = until(&mut one, 10.0, [works(0), works(0)]);
    assert_eq!(
        events,
        ["0 arrived - p0", "0 begun gold p0", "3.5 done gold p0"]
    );
    assert_eq!(figure(&one, "wasted_robot_s"), FigureValue::Real(3.5));
    assert_eq!(figure(&one, "makespan_ms"), FigureValue::Count(3500));
    assert_eq!(figure(&one, "wait.mean_ms"), FigureValue::Real(0.0));
    assert_eq!(figure(&one, "response.p95_ms"), FigureValue::Count(3500));
    let mut both = world(&garbage(4.0, "workers = 2"));
    let events = until(&mut both, 10.0, [works(0), works(0)]);
    assert_eq!(events[3], "1.5 done blue p0");
}

/// Unfinished work is kept or lost, depending on the kind.
#[test]
fn unfinished_work_is_kept_or_lost_by_kind() {
    for (kept, done) in [(true, "6 done blue p0"), (false, "8.5 done blue p0")] {
        let mut world = world(&garbage(4.0, &format!("kept = {kept}")));
        until(&mut world, 2.5, [works(0), None]);
        let left = until(&mut world, 5.0, [None, None]);
        assert_eq!(left, ["2.5 left gold p0"]);
        let events = until(&mut world, 20.0, [None, works(0)]);
        assert_eq!(events, ["5 begun blue p0", done], "kept = {kept}");
    }
}

/// If unfinished work is lost, each robot makes its own attempt. A later robot does not help the first one, and its
/// time counts as wasted. When the first robot leaves, the attempt of the other remains.
#[test]
fn each_robot_makes_its_own_attempt() {
    let section = garbage(4.0, "kept = false");
    let mut alone = world(&section);
    until(&mut alone, 2.0, [None, works(0)]);
    let events = until(&mut alone, 20.0, [works(0), works(0)]);
    assert_eq!(events, ["2 begun gold p0", "3.5 done blue p0"]);

    let mut left = world(&section);
    until(&mut left, 2.0, [None, works(0)]);
    until(&mut left, 3.0, [works(0), works(0)]);
    assert_eq!(
        row(&left)[4],
        FigureValue::Real(1.0),
        "two quarters of blue's"
    );
    let events = until(&mut left, 20.0, [works(0), None]);
    assert_eq!(events, ["3 left blue p0", "5.5 done gold p0"]);
    assert_eq!(figure(&left, "wasted_robot_s"), FigureValue::Real(1.0));
    let robots = team_figures(&left).robots;
    // The time of the lower rank counts as useful.
    assert_eq!(robots[0].get("work_s"), FigureValue::Real(4.0));
    assert_eq!(robots[1].get("surplus_s"), FigureValue::Real(1.0));
}

/// A lost robot leaves its point, which stays open for others.
#[test]
fn a_lost_robot_leaves_its_point() {
    let mut world = world(&garbage(4.0, ""));
    until(&mut world, 1.0, [works(0), None]);
    world.release_load(GOLD);
    assert_eq!(step(&mut world, [None, None]), ["1 left gold p0"]);
    let events = until(&mut world, 20.0, [None, works(0)]);
    assert_eq!(events, ["1.5 begun blue p0", "4 done blue p0"]);
}

/// A run in which a point expires is not complete and has no makespan.
#[test]
fn points_expire() {
    let deadline = "deadline_s = { min = 3, max = 3 }";
    let section = kind("garbage", 4.0, deadline) + &point("garbage", 1.0) + &point("garbage", 2.0);
    let mut both = world(&section);
    assert_eq!(
        until(&mut both, 20.0, [None, works(1)]),
        [
            "1 arrived - p0",
            "2 arrived - p1",
            "2 begun blue p1",
            "4 expired - p0",
            "5 expired - p1",
        ]
    );
    assert_eq!(end(&both), Some(Outcome::Expired));
    assert_eq!(row(&both)[3], FigureValue::Count(2));

    let mut one = world(&(garbage(2.0, deadline) + &point("garbage", 0.0)));
    let events = until(&mut one, 4.0, [works(0), None]);
    let [.., done, expired] = &events[..] else {
        panic!("{events:?}");
    };
    assert_eq!([done, expired], ["1.5 done gold p0", "3 expired - p1"]);
    assert_eq!(end(&one), Some(Outcome::Expired));
    assert_eq!(counts(&one), [1, 1, 0]);
    assert_eq!(figure(&one, "makespan_ms"), FigureValue::None);
}

/// Points that have yet to arrive are open, so that the total does not change during a run. Only drawn points that would
/// arrive after `duration_s` do not exist.
#[test]
fn points_that_have_yet_to_arrive_count_as_open() {
    let section = "duration_s = 50\n".to_owned() + &garbage(2.0, "");
    let mut world =
        world(&(section + &point("garbage", 60.0) + "[[service.random]]\nn = 1\nat_s = 50\n"));
    let [two, one] = [2, 1].map(FigureValue::Count);
    assert_eq!([row(&world)[0], row(&world)[5]], [two; 2]);
    until(&mut world, 4.0, [works(0), None]);
    let row = row(&world);
    assert_eq!([row[0], row[2], row[5]], [one; 3]);
    assert_eq!(counts(&world), [1, 0, 1]);
    assert_eq!(figure(&world, "makespan_ms"), FigureValue::None);
    assert_eq!(end(&world), None);
}

/// A point with a period comes back, done or not, until `duration_s`. Points that are open then can still be done.
#[test]
fn points_come_back() {
    let section = "duration_s = 11\n".to_owned() + &garbage(1.0, "period_s = 5");
    let mut world = world(&section);
    let mut events = until(&mut world, 1.0, [works(0), None]);
    events.extend(until(&mut world, 30.0, [None, None]));
    assert_eq!(
        events,
        [
            "0 arrived - p0",
            "0 begun gold p0",
            "0.5 done gold p0",
            "5 arrived - p0",
            "10 expired - p0",
            "10 arrived - p0",
        ]
    );
    assert_eq!(end(&world), None);
    assert_eq!(step(&mut world, [works(0), None]), ["30 begun gold p0"]);
    assert_eq!(step(&mut world, [works(0), None]), ["30.5 done gold p0"]);
    assert!(end(&world).is_some());
}

/// The board repeats its lines until the robot acknowledges them.
#[test]
fn the_board_is_read_in_parts_and_repeated() {
    let mut world = world(&(garbage(4.0, "") + &point("garbage", 0.0).repeat(9)));
    step(&mut world, [None, None]);
    let first = sensed(&world, GOLD);
    assert_eq!(numbers(&world, GOLD), [0, 1, 2, 3, 4, 5, 6]);
    assert_eq!(first.board_line, Some(7));
    // The step does not count, so nothing is acknowledged.
    step(&mut world, [None, None]);
    assert_eq!(sensed(&world, GOLD), first);
    step(&mut world, [does(None, Some(7)), None]);
    assert_eq!(numbers(&world, GOLD), [7, 8, 9]);
    assert_eq!(sensed(&world, GOLD).board_line, Some(10));
    step(&mut world, [does(None, Some(10)), None]);
    assert_eq!(numbers(&world, GOLD), [0; 0]);
    assert_eq!(sensed(&world, GOLD).board_line, None);
    // Blue has read nothing, nor has a new incarnation of gold. A robot cannot acknowledge lines that do not exist yet.
    assert_eq!(sensed(&world, BLUE), first);
    world.release_load(GOLD);
    assert_eq!(sensed(&world, GOLD), first);
    step(&mut world, [does(None, Some(u32::MAX)), works(3)]);
    assert_eq!(sensed(&world, GOLD).board_line, None);
    // A done point moves to the end of the board.
    until(&mut world, 10.0, [None, works(3)]);
    let news = sensed(&world, GOLD);
    let news = news.points.iter().flatten().next().unwrap();
    assert_eq!((news.point, news.left_s), (3, 0.0));
}

#[test]
fn a_robot_reads_only_points_of_its_own_tasks() {
    let section = garbage(4.0, "") + &kind("floor", 4.0, "");
    let mut world = world(&(section + &point("floor", 0.0) + &point("garbage", 0.0)));
    step(&mut world, [None, None]);
    assert_eq!(numbers(&world, GOLD), [0, 2]);
    assert_eq!(numbers(&world, BLUE), [0, 1, 2]);
}

/// Orders another point at y = 3 m. Returns its place or the reason for a refusal.
fn add_point(world: &mut World, x_m: f64, kind: &str) -> Result<String, String> {
    let fault = MissionFault::new(POINT, &[("x_m", x_m), ("y_m", 3.0)]);
    let fault = Fault::Mission(fault.with_name("kind", kind));
    let answer = world.change(&fault).unwrap();
    answer.map_err(|error| error.to_string())
}

#[test]
fn a_fault_adds_a_point_while_there_are_tasks_for_it() {
    let mut world = world(&("spare = 1\n".to_owned() + &garbage(4.0, "")));
    step(&mut world, [None, None]);
    for (x_m, kind, expected) in [
        (3.0, "dust", Err("there is no such kind of work")),
        (-1.0, "garbage", Err("no robot can work at (-1, 3)")),
        (3.0, "garbage", Ok("p1 3 3")),
        (
            3.0,
            "garbage",
            Err("all 1 tasks of service.spare are in use"),
        ),
    ] {
        let answer = add_point(&mut world, x_m, kind);
        assert_eq!(answer.as_deref().map_err(String::as_str), expected);
    }
    let events = step(&mut world, [None, works(1)]);
    assert_eq!(events, ["0.5 arrived - p1", "0.5 begun blue p1"]);
}

#[test]
fn a_mission_without_any_point_is_not_complete_and_waits_for_an_added_one() {
    let mut world = world(&("spare = 1\n".to_owned() + &kind("garbage", 1.0, "")));
    assert_eq!(end(&world), None);
    add_point(&mut world, 3.0, "garbage").unwrap();
    while end(&world).is_none() {
        step(&mut world, [None, works(0)]);
        assert!(world.now() < SimTime::from_secs_f64(10.0));
    }
    assert_eq!(end(&world), Some(Outcome::Complete));
}

/// Robots see the points within sight in their own frames, nearest first.
#[test]
fn sight_is_limited_and_relative() {
    let points = [(5.0, 5.5), (4.0, 4.0), (5.0, 6.1)].map(|(x_m, y_m)| {
        format!("[[service.points]]\nkind = 'garbage'\nx_m = {x_m}\ny_m = {y_m}\n")
    });
    let robots = [
        ("gold", "x_m = 5, y_m = 4, heading_deg = 90"),
        ("blue", "x_m = 1, y_m = 8"),
    ]
    .map(|(name, start)| format!("[[robots]]\nname = '{name}'\nstart = {{ {start} }}\n"));
    let mut world = world_of(&format!(
        "[service]\nknown = 'sight'\nsight_m = 2\n{}{}{}",
        kind("garbage", 4.0, ""),
        points.concat(),
        robots.concat(),
    ));
    step(&mut world, [None, None]);
    let seen = sensed(&world, GOLD).points.unwrap();
    assert_eq!(numbers(&world, GOLD), [1, 0]);
    // The points are to the left of the robot and ahead of it.
    for (fact, at) in seen.iter().zip([Vec2::Y, 1.5 * Vec2::X]) {
        assert!(fact.at.distance(at) < 1e-5, "{fact:?}");
    }
    assert_eq!(numbers(&world, BLUE), [0; 0]);
}

#[test]
fn the_largest_reading_and_action_fit_in_a_message() {
    let fact = PointFact {
        point: u32::MAX,
        kind: 10_000,
        round: u32::MAX,
        at: Vec2::MAX,
        left_s: f32::MAX,
    };
    let largest = SensorReading {
        points: Some([fact; MAX_SENSED].into()),
        board_line: Some(u32::MAX),
        effect: Some(u32::MAX),
    };
    Bytes::<MAX_READING_BYTES>::encode(&largest).unwrap();
    let most = Action {
        work: Some(u32::MAX),
        read: Some(u32::MAX),
    };
    Bytes::<MAX_ACTION_BYTES>::encode(&most).unwrap();
}

proptest! {
    /// No point is lost: each is waiting, open or over, and the counts match the events.
    #[test]
    fn all_points_are_accounted_for(
        tasks in proptest::collection::vec((0..3_u32, 0..3_u32), 1..120),
        period in proptest::bool::ANY,
    ) {
        let more = if period { "kept = false\nperiod_s = 7" } else { "deadline_s = { min = 2, max = 30 }" };
        let section = "duration_s = 40\n".to_owned()
            + &kind("garbage", 3.0, more)
            + &kind("dust", 2.0, "workers = 2")
            + &point("garbage", 0.0)
            + &point("dust", 4.0);
        let mut world = world(&section);
        let mut events = Vec::new();
        for (gold, blue) in tasks {
            events.extend(step(&mut world, [works(gold), works(blue)]));
        }
        let count = |kind: &str| events.iter().filter(|event| event.contains(kind)).count() as u64;
        let row = row(&world);
        let [FigureValue::Count(open), _, FigureValue::Count(done), FigureValue::Count(expired), _, FigureValue::Count(pending)] = row[..]
        else {
            panic!("{row:?}");
        };
        prop_assert_eq!(done, count(" done "));
        prop_assert_eq!(expired, count(" expired "));
        prop_assert_eq!(count(" arrived ") + pending, open + done + expired);
    }
}
