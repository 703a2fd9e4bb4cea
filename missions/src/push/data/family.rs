//! Push in any size: room, team and bars grow together (`--robots N --bars M`).
//!
//! A lane of 12 × 6 m contains a bar, a way of 7 m to its line, and two robots behind its ends. With more robots, up
//! to four in a lane, the others start between these two. The number of lanes follows from that. The two robots that
//! start nearest to a bar have its tasks, and each robot has the two bars nearest to it, so that others can take over
//! the work of a lost robot. The radio range of teams with more than ten robots covers about ten teammates.

use glam::Vec2;
use scenario::mission::section::MissionSection;
use scenario::{Robot, Room, Scenario, Start};
use terminal::counted;

use super::{BarSection, PUSH, PUSH_PLACES, PushSection};
use crate::districts::{self, Districts, nearest_both_ways};
use crate::push::bar::BarEnd;

const LANE_M: (f32, f32) = (12.0, 6.0);
const ROBOTS: usize = 4;
/// The number of robots per bar, and of bars per robot.
const ROBOTS_PER_BAR: usize = 2;
const BARS_PER_ROBOT: usize = 2;
/// The approximate number of robots in radio range: those of a lane, and those of the lanes beside it.
const ROBOTS_IN_RANGE: usize = 10;
/// The x of the bar, of its goal and of the robots' starts in their lane, m.
const BAR_AT_M: f32 = 2.0;
const GOAL_AT_M: f32 = 9.0;
const STARTS_AT_M: f32 = 1.0;

/// Creates a scenario for 1 to 1,000,000 robots and bars.
#[must_use]
pub fn family(robots: usize, bars: usize) -> Scenario {
    let least = bars.max(robots.div_ceil(ROBOTS));
    // A lane is twice as long as wide, so the room has half as many columns as rows.
    let columns = least.div_ceil(2).isqrt();
    let lanes = Districts {
        columns,
        rows: least.div_ceil(columns),
    };
    let room = Room::of_size(
        LANE_M.0 * lanes.columns as f32,
        LANE_M.1 * lanes.rows as f32,
    );
    let corner = |lane: usize| {
        let (column, row) = lanes.column_and_row(lane);
        (column as f32 * LANE_M.0, (row as f32 + 0.5) * LANE_M.1)
    };
    let bars = lanes.distribute(bars).map(|(lane, _)| {
        let (x_m, y_m) = corner(lane);
        BarSection {
            x_m: x_m + BAR_AT_M,
            y_m,
            goal_x_m: x_m + GOAL_AT_M,
        }
    });
    let section = PushSection {
        length_m: 2.4,
        half_width_m: 0.1,
        stroke_m: 0.4,
        skew_m: 0.8,
        sight_m: 1.5,
        bars: bars.collect(),
    };
    let between_m = (1.0 - 2.0 * PUSH_PLACES[0]) * section.length_m;
    let team = lanes.distribute(robots).zip(1..);
    let team = team.map(|((lane, share), number)| {
        let (x_m, y_m) = corner(lane);
        let height = match share.count {
            1 => 0.5,
            _ => share.height(0.0),
        };
        Robot {
            name: format!("r{number}"),
            start: Some(Start {
                x_m: x_m + STARTS_AT_M,
                y_m: y_m + (height - 0.5) * between_m,
                heading_deg: 0.0,
            }),
            ..Robot::default()
        }
    });
    let mut team: Vec<Robot> = team.collect();
    if robots > ROBOTS_PER_BAR {
        assign(&mut team, &section);
    }
    // Allows each bar the time of a bar with two robots.
    let load = (2 * section.bars.len()).div_ceil(robots);
    Scenario {
        description: format!(
            "{}, {}: room, team and bars grow together.",
            counted(robots, "robot"),
            counted(section.bars.len(), "bar"),
        ),
        name: PUSH.name().to_owned(),
        limit_s: 1200.0 * load as f64,
        room,
        radio: districts::radio(ROBOTS_IN_RANGE, robots, &room),
        robots: team,
        mission: MissionSection::new(PUSH, section),
        ..Scenario::default()
    }
}

fn assign(team: &mut [Robot], section: &PushSection) {
    let places = section.bars.iter().map(|bar| bar.pose().position);
    let places: Vec<Vec2> = places.collect();
    let nearest = nearest_both_ways(team, BARS_PER_ROBOT, &places, ROBOTS_PER_BAR);
    for (robot, bars_of_robot) in team.iter_mut().zip(nearest) {
        let ends = bars_of_robot
            .iter()
            .flat_map(|bar| BarEnd::BOTH.map(|end| (*bar, end)));
        let tasks = ends.map(|(bar, end)| format!("push({})", section.name_of(bar, Some(end))));
        robot.tasks = tasks.collect();
    }
}
