//! Service in any size: room, team and points grow together (`--robots N --points M`).
//!
//! The room consists of districts of 12 × 9 m, each with at most three robots at its left end and two points of work.
//! Each point is a task of the three robots that start nearest to it, and each robot has its two nearest points. So
//! teammates can take over the work of a lost robot. In teams of more than 20 robots the radio range is limited so that
//! each robot receives from about 20 others.

use glam::Vec2;
use scenario::mission::section::MissionSection;
use scenario::{Robot, Room, Scenario, Start};
use terminal::counted;

use super::{
    CostMeasure, Interval, Kind, KnowledgeSource, Point, SERVICE, ServiceSection, TaskGranularity,
};
use crate::districts::{self, Districts, nearest_both_ways};

const ROBOTS: usize = 3;
const POINTS: usize = 2;
const ROBOTS_PER_TASK: usize = 3;
const POINTS_PER_ROBOT: usize = 2;
/// The approximate number of robots from which a robot receives, and the team size above which the radio range is
/// limited.
const NEIGHBORS: usize = 20;
/// The x position of the points, as a fraction of the district's width.
const POINTS_AT: f32 = 0.6;
/// The distance of the starts from the left end of the district, and between two starts, m.
const STARTS_AT_M: f32 = 0.5;
const STARTS_APART_M: f32 = 1.0;

/// Returns service with the given number of robots and points, 1 to 1,000,000 each.
pub(super) fn family(robots: usize, points: usize) -> Scenario {
    let districts = Districts::new(robots.div_ceil(ROBOTS).max(points.div_ceil(POINTS)));
    let one = Room::default();
    let room = Room::of_size(
        one.width_m * districts.columns as f32,
        one.height_m * districts.rows as f32,
    );
    let corner = |district: usize| {
        let (column, row) = districts.column_and_row(district);
        (column as f32 * one.width_m, row as f32 * one.height_m)
    };
    let points = districts.distribute(points).map(|(district, share)| {
        let (x_m, y_m) = corner(district);
        Point {
            kind: KIND.to_owned(),
            x_m: x_m + POINTS_AT * one.width_m,
            y_m: y_m + share.height(1.0) * one.height_m,
            ..Point::default()
        }
    });
    let points: Vec<Point> = points.collect();
    let team = districts.distribute(robots).zip(1..);
    let team = team.map(|((district, share), number)| {
        let (x_m, y_m) = corner(district);
        let above_middle = (share.height(0.5) - 0.5) * share.count as f32 * STARTS_APART_M;
        Robot {
            name: format!("r{number}"),
            start: Some(Start {
                x_m: x_m + STARTS_AT_M,
                y_m: y_m + one.height_m / 2.0 + above_middle,
                heading_deg: 0.0,
            }),
            ..Robot::default()
        }
    });
    let mut team: Vec<Robot> = team.collect();
    if robots > ROBOTS_PER_TASK {
        assign(&mut team, &points);
    }
    // The time limit grows with the number of points per robot.
    let load = points.len() as f64 / robots as f64;
    Scenario {
        description: format!(
            "{}, {} of work: room, team and work grow together.",
            counted(robots, "robot"),
            counted(points.len(), "point"),
        ),
        name: SERVICE.name().to_owned(),
        limit_s: 600.0 * load.ceil(),
        room,
        radio: districts::radio(NEIGHBORS, robots, &room),
        robots: team,
        mission: MissionSection::new(SERVICE, section(points)),
        ..Scenario::default()
    }
}

const KIND: &str = "work";

fn section(points: Vec<Point>) -> ServiceSection {
    ServiceSection {
        tasks: TaskGranularity::Points,
        known: KnowledgeSource::All,
        reach_m: 0.3,
        sight_m: 3.0,
        spare: 0,
        duration_s: None,
        uncovered: false,
        costs: CostMeasure::Line,
        coalition_wait_s: None,
        reserve: None,
        chargers: Vec::new(),
        kinds: vec![Kind {
            name: KIND.to_owned(),
            work_s: Interval {
                min: 6.0,
                max: 60.0,
            },
            workers: 1,
            kept: true,
            deadline_s: None,
            period_s: None,
        }],
        points,
        random: Vec::new(),
    }
}

fn assign(team: &mut [Robot], points: &[Point]) {
    let places = points.iter().map(|point| Vec2::new(point.x_m, point.y_m));
    let places: Vec<Vec2> = places.collect();
    let assigned = nearest_both_ways(team, POINTS_PER_ROBOT, &places, ROBOTS_PER_TASK);
    for (robot, assigned) in team.iter_mut().zip(assigned) {
        robot.tasks = assigned
            .iter()
            .map(|point| format!("serve(p{point})"))
            .collect();
    }
}
