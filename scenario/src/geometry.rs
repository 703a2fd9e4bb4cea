//! Checks that the robots fit into the room and can stand at their starts. The world chooses places for robots without
//! a stated start, and rejects a team that does not fit.

use super::error::Problem;
use super::path::KeyPath;
use super::{Obstacle, Scenario};

/// The tolerance for overlaps from rounding, m. Bodies may touch.
const TOUCH_M: f64 = 1e-6;

/// Rejects the first robot with an impossible start. Ranges must be valid.
pub(super) fn check_places(scenario: &Scenario) -> Result<(), Problem> {
    let radius = f64::from(scenario.body.radius_m);
    let diameter = 2.0 * radius;
    let (low, high) = (scenario.room.low(), scenario.room.high());
    let (width, height) = (
        f64::from(scenario.room.width_m),
        f64::from(scenario.room.height_m),
    );
    let touch_m = TOUCH_M.max(scenario.room.resolution_m().into());
    let solid = scenario.body.robot_penetrability <= Obstacle::SOLID;
    // Absent robots do not occupy space and join when there is room.
    let count = scenario.robots.iter().filter(|robot| !robot.absent).count();
    let side_by_side = if solid { count as f64 } else { 1.0 };
    if diameter >= width.min(height) || side_by_side * diameter * diameter > width * height {
        let room = &scenario.room;
        let robots = if count == 1 { "robot" } else { "robots" };
        let what = format!(
            "{} x {} m is too small for {count} {robots} of diameter {} m",
            room.width_m,
            room.height_m,
            2.0 * scenario.body.radius_m
        );
        let remedy = "enlarge the room, or make body.radius_m smaller";
        // The error names the first of the three conflicting values that differs from the default.
        let default = Scenario::default();
        let at = if scenario.room != default.room {
            KeyPath::new(["room"])
        } else if scenario.body.radius_m != default.body.radius_m {
            KeyPath::new(["body", "radius_m"])
        } else {
            KeyPath::new(["robots"])
        };
        return Err(Problem::at(at, what, remedy));
    }

    let mut starts = Vec::new();
    for (index, robot) in scenario.robots.iter().enumerate() {
        let Some(start) = &robot.start else { continue };
        let at = KeyPath::new(["robots"]).index(index).key("start");
        let (x, y) = (f64::from(start.x_m), f64::from(start.y_m));
        for (key, given, low, high) in [
            ("x_m", start.x_m, low.x, high.x),
            ("y_m", start.y_m, low.y, high.y),
        ] {
            let (place, low, high) = (f64::from(given), f64::from(low), f64::from(high));
            if place - radius < low - touch_m || place + radius > high + touch_m {
                let radius = scenario.body.radius_m;
                let what = format!("{given} puts '{}' into a wall", robot.name);
                let remedy = format!("keep body.radius_m, {radius} m, away from both walls");
                return Err(Problem::at(at.key(key), what, remedy));
            }
        }
        let solids = scenario.obstacles.iter().enumerate();
        for (number, obstacle) in solids.filter(|(_, each)| each.is_solid()) {
            if overlaps(x, y, radius - TOUCH_M, obstacle) {
                let what = format!("covers the start of '{}'", robot.name);
                let remedy = "move it or the robot's start until they are apart";
                return Err(Problem::at(
                    KeyPath::new(["obstacles"]).index(number),
                    what,
                    remedy,
                ));
            }
        }
        if !robot.absent {
            starts.push((x, y, index));
        }
    }
    if solid {
        apart(scenario, starts, diameter)?;
    }
    scenario.mission().check_places(scenario)
}

/// Rejects two solid robots whose starts overlap. The order by x limits comparisons to near robots.
fn apart(
    scenario: &Scenario,
    mut starts: Vec<(f64, f64, usize)>,
    diameter: f64,
) -> Result<(), Problem> {
    let least = diameter - TOUCH_M;
    starts.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
    for (number, (x, y, index)) in starts.iter().enumerate() {
        for (other_x, other_y, other) in &starts[number + 1..] {
            if other_x - x >= diameter {
                break;
            }
            if squared(other_x - x, other_y - y) < least * least {
                let (first, second) = (index.min(other), index.max(other));
                let name = |index: &usize| &scenario.robots[*index].name;
                let what = format!("'{}' starts inside '{}'", name(second), name(first));
                let remedy = format!("keep their centers {diameter:.3} m apart");
                let at = KeyPath::new(["robots"]).index(*second).key("start");
                return Err(Problem::at(at, what, remedy));
            }
        }
    }
    Ok(())
}

/// Returns true if the disc and the rectangle share more than an edge.
fn overlaps(x: f64, y: f64, radius: f64, rectangle: &Obstacle) -> bool {
    let gap = |point: f64, low: f32, size: f32| {
        let low = f64::from(low);
        (low - point).max(point - (low + f64::from(size))).max(0.0)
    };
    let gap_x = gap(x, rectangle.x_m, rectangle.width_m);
    let gap_y = gap(y, rectangle.y_m, rectangle.height_m);
    squared(gap_x, gap_y) < radius * radius
}

/// Returns the squared length of a vector.
fn squared(x: f64, y: f64) -> f64 {
    x * x + y * y
}
