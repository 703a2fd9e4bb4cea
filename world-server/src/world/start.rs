//! Start poses of the robots.

use std::f32::consts::PI;

use glam::Vec2;
use proto::readings::Pose;
use scenario::Scenario;
use scenario::ids::RobotId;

use super::motion::wrap_angle;
use super::space::{ROUNDING_M, Space};
use super::{Bar, Grid, Penetrability, SKIN_M};

/// The largest number of places to try for robots without a given start.
const MOST_CANDIDATES: usize = 1_000_000;

/// The reason why a robot cannot be placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StartError {
    /// The given start overlaps something.
    #[error("the start of {0} is outside the border, on a solid obstacle or on another robot")]
    Taken(RobotId),
    /// No place is left for a robot without a given start.
    #[error("no room is left for {0} to start in")]
    NoRoom(RobotId),
}

impl StartError {
    /// Returns the message with the robot's key and name in the scenario, and a remedy.
    #[must_use]
    pub fn describe(self, scenario: &Scenario) -> String {
        let (rank, what, remedy) = match self {
            Self::Taken(robot) => (
                robot.index(),
                "starts outside the border, on a solid obstacle or on another robot",
                "move its start",
            ),
            Self::NoRoom(robot) => (
                robot.index(),
                "has no free place to start",
                "enlarge the room, or take obstacles away",
            ),
        };
        let name = scenario.robots.get(rank).map_or("", |robot| &robot.name);
        format!("robots[{rank}]: '{name}' {what}; {remedy}")
    }
}

/// Returns the start poses of the robots, by rank. Starts of the scenario come first, then the free places of `starts` if
/// they suffice. Otherwise robots use the start area, given by its lower left and upper right corner, m. They face the left
/// wall, from its top to its bottom at even distances. If they do not fit, they fill columns from the middle outwards and
/// then to the right, in small rooms at the full height and closer together. Absent robots get places as a separate team.
///
/// # Errors
/// If a robot has no place clear of the border, the solids and the other robots. Starts of robots that are not solid to each
/// other may overlap, and absent robots block no place.
pub fn start_poses(
    scenario: &Scenario,
    area: [Vec2; 2],
    starts: &[Vec2],
    bars: &[Bar],
) -> Result<Vec<Pose>, StartError> {
    let space = Space::new(scenario, bars.to_vec());
    let radius_m = scenario.body.radius_m;
    let solid = Penetrability(scenario.body.robot_penetrability).is_solid();
    let mut poses = vec![None; scenario.robots.len()];
    let mut taken = Bodies::new(&space, radius_m, scenario.robots.len());
    let nobody = taken.clone();
    for (rank, robot) in scenario.robots.iter().enumerate() {
        let Some(start) = robot.start else { continue };
        let position = Vec2::new(start.x_m, start.y_m);
        let others = if solid && !robot.absent {
            &taken
        } else {
            &nobody
        };
        if !is_free(&space, others, radius_m, position, -ROUNDING_M) {
            return Err(StartError::Taken(RobotId(rank as u32)));
        }
        if !robot.absent {
            taken.push(position);
        }
        poses[rank] = Some(Pose {
            position,
            heading_rad: wrap_angle(start.heading_deg.to_radians()),
        });
    }

    for (absent, taken) in [(false, &taken), (true, &nobody)] {
        let is_unplaced = |rank: &usize| {
            scenario.robots[*rank].absent == absent && scenario.robots[*rank].start.is_none()
        };
        let unplaced: Vec<usize> = (0..poses.len()).filter(is_unplaced).collect();
        let candidates = starts.iter().copied();
        let preferred = choose(&space, taken, radius_m, candidates, unplaced.len());
        let places = if preferred.len() == unplaced.len() {
            preferred
        } else {
            default_places(scenario, area, &space, taken, unplaced.len())
        };
        let mut places = places.into_iter();
        for rank in unplaced {
            let position = places
                .next()
                .ok_or(StartError::NoRoom(RobotId(rank as u32)))?;
            poses[rank] = Some(Pose {
                position,
                heading_rad: PI,
            });
        }
    }
    Ok(poses.into_iter().flatten().collect())
}

/// Returns up to `count` free places in and around the start area.
fn default_places(
    scenario: &Scenario,
    [min, max]: [Vec2; 2],
    space: &Space,
    taken: &Bodies,
    count: usize,
) -> Vec<Vec2> {
    let radius_m = scenario.body.radius_m;
    let room = &space.room;
    let first_x = ((min.x + max.x) / 2.0).max(room.x_m + (radius_m + 2.0 * SKIN_M));
    let (area_y, area_height_m) = ((min.y + max.y) / 2.0, max.y - min.y);

    let even = (0..count).map(|index| max.y - area_height_m * (index as f32 + 0.5) / count as f32);
    let places = choose(
        space,
        taken,
        radius_m,
        even.map(|y| Vec2::new(first_x, y)),
        count,
    );
    if places.len() == count {
        return places;
    }

    let mut most = places;
    for (middle_y, height_m, pitch_radii) in [
        (area_y, area_height_m, 2.5),
        (room.middle().y, room.height_m, 2.5),
        (room.middle().y, room.height_m, 2.05),
    ] {
        let pitch_m = pitch_radii * radius_m;
        let columns = ((room.high().x - first_x) / pitch_m) as i32;
        let rows = ((height_m - 2.0 * radius_m) / pitch_m) as i32 + 1;
        let grid = (0..=columns).flat_map(|column| {
            let x = first_x + column as f32 * pitch_m;
            (0..rows).map(move |row| {
                let rows_from_middle = if row % 2 == 0 {
                    row / 2
                } else {
                    -(row + 1) / 2
                };
                // An even number of rows has no middle row.
                let shift = if rows % 2 == 0 { 0.5 } else { 0.0 };
                Vec2::new(x, middle_y + (rows_from_middle as f32 + shift) * pitch_m)
            })
        });
        most = choose(space, taken, radius_m, grid, count);
        if most.len() == count {
            break;
        }
    }
    most
}

/// Returns the first `count` candidates that are clear of everything, including each other.
fn choose(
    space: &Space,
    taken: &Bodies,
    radius_m: f32,
    candidates: impl Iterator<Item = Vec2>,
    count: usize,
) -> Vec<Vec2> {
    if count == 0 {
        return Vec::new();
    }
    let (mut bodies, mut chosen) = (taken.clone(), Vec::new());
    // Tiny robots have too many candidates to try. If all tried places are taken, a free one is unlikely.
    for place in candidates.take(MOST_CANDIDATES) {
        if chosen.len() == count {
            break;
        }
        if is_free(space, &bodies, radius_m, place, SKIN_M) {
            bodies.push(place);
            chosen.push(place);
        }
    }
    chosen
}

fn is_free(space: &Space, bodies: &Bodies, radius_m: f32, center: Vec2, clearance_m: f32) -> bool {
    space.fits(center, radius_m, clearance_m) && bodies.keep(center, 2.0 * radius_m + clearance_m)
}

/// Placed bodies, in a grid so that placing a team takes time linear in its size.
#[derive(Clone)]
struct Bodies {
    centers: Grid,
    count: usize,
}

impl Bodies {
    fn new(space: &Space, radius_m: f32, most: usize) -> Self {
        Self {
            centers: Grid::new(&space.room, 2.0 * radius_m + SKIN_M, most),
            count: 0,
        }
    }

    fn push(&mut self, center: Vec2) {
        self.centers.insert(self.count, center);
        self.count += 1;
    }

    /// Checks whether all bodies keep this distance from a point.
    fn keep(&self, point: Vec2, distance_m: f32) -> bool {
        let near = self.centers.near(point, distance_m + ROUNDING_M);
        near.fold(true, |keep, (_, center)| {
            keep & (center.distance(point) >= distance_m)
        })
    }
}
