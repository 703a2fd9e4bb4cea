//! Teams of the mission service with 6 points for each robot, by class of properties.

use alliance_tests::runs::{self, vocabulary};
use missions::service::data::{Charger, CostMeasure, Point, ServiceSection};
use scenario::{Energy, Obstacle, Room, Scenario, Setup};

/// The robots and the points of a team.
pub const ROBOTS: usize = 100;
const POINTS: usize = 600;
/// The obstacles of the classes with walls.
const WALLS: usize = 40;

/// A change of a plain point; the number is that of the point.
type Change = fn(&mut Point, usize);

/// The classes of points. `all` has every property, batteries, chargers and costs by path.
pub const CLASSES: [(&str, Change); 9] = [
    ("plain", |_, _| {}),
    ("windows", windows),
    ("values", values),
    ("needs", needs),
    ("precedence", precedence),
    ("delivery", delivery),
    ("chargers", |_, _| {}),
    ("walls", |_, _| {}),
    ("all", |point, number| {
        windows(point, number);
        values(point, number);
        precedence(point, number);
        if number % 2 == 0 {
            needs(point, number);
        } else {
            delivery(point, number);
        }
    }),
];

/// Windows open after up to half a minute, and close after the end of the measurement.
fn windows(point: &mut Point, number: usize) {
    point.opens_s = Some((number % 30) as f64);
    point.deadline_s = Some(2000.0);
}

fn values(point: &mut Point, number: usize) {
    point.value = Some(1.0 + (number % 9) as f64);
}

fn needs(point: &mut Point, _: usize) {
    point.needs = [(point.kind.clone(), 2)].into();
}

/// A chain of three points.
fn precedence(point: &mut Point, number: usize) {
    if !number.is_multiple_of(3) {
        point.after = vec![format!("p{}", number - 1)];
    }
}

fn delivery(point: &mut Point, _: usize) {
    point.deliver_to = Some([point.x_m - 2.0, point.y_m]);
    point.demand = Some(1.0);
}

/// Returns a team whose points have the properties of a class.
pub fn setup(class: &str, change: Change, costs: CostMeasure) -> Setup {
    let missions = vocabulary().missions;
    let service = missions.iter().find(|mission| mission.name() == "service");
    let family = service.and_then(|mission| mission.family(ROBOTS, POINTS));
    let mut scenario = family.expect("the mission has a family");
    // Nothing ends before the measurement.
    scenario.limit_s = 5000.0;
    if ["chargers", "all"].contains(&class) {
        scenario.energy = Some(Energy {
            capacity_j: 900.0,
            idle_w: 4.0,
            drive_w: 16.0,
        });
    }
    if ["walls", "all"].contains(&class) {
        scenario.obstacles = corners(&scenario).take(WALLS).map(wall).collect();
    }
    let chargers: Vec<Charger> = corners(&scenario).map(charger).collect();
    let has_energy = scenario.energy.is_some();
    let section = scenario.mission.values_mut::<ServiceSection>();
    let section = section.expect("a scenario of service");
    section.costs = costs;
    if has_energy {
        section.reserve = Some(0.3);
        section.chargers = chargers;
    }
    for (number, point) in section.points.iter_mut().enumerate() {
        change(point, number);
    }
    let points = section.points.clone();
    for robot in &mut scenario.robots {
        let tasks = robot.tasks.iter();
        robot.tasks = tasks.flat_map(|task| slots(task, &points)).collect();
    }
    runs::setup(scenario, 1)
}

/// Returns the tasks for the slots of a point, in place of the one for the whole point.
fn slots(task: &str, points: &[Point]) -> Vec<String> {
    let number = task.trim_start_matches("serve(p").trim_end_matches(')');
    let point = &points[number.parse::<usize>().expect("a task of a point")];
    if point.needs.is_empty() {
        return vec![task.to_owned()];
    }
    let kind = &point.kind;
    (1..=2)
        .map(|slot| format!("serve(p{number}-{kind}-{slot})"))
        .collect()
}

/// Returns the lower left corners of the districts, which have the size of the default room.
fn corners(scenario: &Scenario) -> impl Iterator<Item = (f32, f32)> + use<> {
    let (room, one) = (scenario.room, Room::default());
    let columns = (room.width_m / one.width_m).round() as usize;
    let rows = (room.height_m / one.height_m).round() as usize;
    (0..columns * rows).map(move |district| {
        let (column, row) = (district % columns, district / columns);
        (column as f32 * one.width_m, row as f32 * one.height_m)
    })
}

/// Returns a wall between the starts and the points of a district.
fn wall((x_m, y_m): (f32, f32)) -> Obstacle {
    Obstacle {
        x_m: x_m + 3.0,
        y_m: y_m + 2.5,
        width_m: 0.1,
        height_m: 4.0,
        penetrability: 0.0,
    }
}

fn charger((x_m, y_m): (f32, f32)) -> Charger {
    Charger {
        x_m: x_m + 10.0,
        y_m: y_m + 4.5,
        rate_w: 80.0,
        slots: 2,
    }
}
