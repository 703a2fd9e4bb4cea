//! Random rooms with disjoint obstacles and corridors that a robot can pass.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use scenario::{Obstacle, Scenario};

/// Minimum width of a corridor between obstacles, or between an obstacle and a wall that it does not touch, in robot
/// radii.
const CORRIDOR_RADII: f32 = 5.0;
/// Minimum side of an obstacle, m.
const SMALL_M: f32 = 0.3;
/// Maximum side of an obstacle, m.
const LARGE_M: f32 = 2.5;
/// Number of attempts to place one obstacle.
const TRIES: usize = 200;

/// A rectangle, m: x and y of the lower left corner, then of the upper right one.
type Rectangle = [f32; 4];

/// Places up to `count` obstacles of 0.3 to 2.5 m at random. One in four touches a wall. The others keep a corridor to
/// the walls, and all obstacles keep one between each other. Areas that the mission reserves remain free.
#[must_use]
pub fn obstacles(scenario: &Scenario, count: u32, rng: &mut ChaCha8Rng) -> Vec<Obstacle> {
    let room = scenario.room;
    let corridor_m = CORRIDOR_RADII * scenario.body.radius_m;
    let largest = |size_m: f32| LARGE_M.min(size_m - 2.0 * corridor_m - SMALL_M);
    let (widest, highest) = (largest(room.width_m), largest(room.height_m));
    if widest <= SMALL_M || highest <= SMALL_M {
        return Vec::new();
    }
    let kept_free = kept_free(scenario);
    let mut placed: Vec<Rectangle> = Vec::new();
    for _ in 0..count {
        for _ in 0..TRIES {
            let width = rng.random_range(SMALL_M..widest);
            let height = rng.random_range(SMALL_M..highest);
            let left = rng.random_range(corridor_m..room.width_m - width - corridor_m);
            let low = rng.random_range(corridor_m..room.height_m - height - corridor_m);
            let (left, low) = match rng.random_range(0..16) {
                0 => (0.0, low),
                1 => (room.width_m - width, low),
                2 => (left, 0.0),
                3 => (left, room.height_m - height),
                _ => (left, low),
            };
            let (left, low) = (room.x_m + left, room.y_m + low);
            let candidate = [left, low, left + width, low + height];
            let clear = |others: &[Rectangle], least: f32| {
                others.iter().all(|other| gap(&candidate, other) >= least)
            };
            if clear(&placed, corridor_m) && clear(&kept_free, 0.0) {
                placed.push(candidate);
                break;
            }
        }
    }
    placed
        .iter()
        .map(|&[left, low, right, high]| Obstacle {
            x_m: left,
            y_m: low,
            width_m: right - left,
            height_m: high - low,
            penetrability: 0.0,
        })
        .collect()
}

/// Returns the areas that the mission reserves.
fn kept_free(scenario: &Scenario) -> Vec<Rectangle> {
    let kept = scenario.mission().free_areas(scenario).into_iter();
    kept.map(|[low, high]| [low.x, low.y, high.x, high.y])
        .collect()
}

/// Returns the distance between two rectangles, m; negative if they overlap.
fn gap(a: &Rectangle, b: &Rectangle) -> f32 {
    let x = (a[0] - b[2]).max(b[0] - a[2]);
    let y = (a[1] - b[3]).max(b[1] - a[3]);
    if x > 0.0 && y > 0.0 {
        (x * x + y * y).sqrt()
    } else {
        x.max(y)
    }
}

#[cfg(test)]
mod tests {
    use missions::waste::data::default_scenario;
    use rand_chacha::rand_core::SeedableRng;
    use scenario::Room;

    use super::*;

    #[test]
    fn corridors_are_kept_in_any_room_and_a_small_one_stays_empty() {
        for seed in 0..200 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let room = Room::of_size(rng.random_range(2.0..14.0), rng.random_range(2.0..14.0));
            let scenario = Scenario {
                room,
                ..default_scenario()
            };
            let placed: Vec<Rectangle> = obstacles(&scenario, 8, &mut rng)
                .iter()
                .map(|o| [o.x_m, o.y_m, o.x_m + o.width_m, o.y_m + o.height_m])
                .collect();
            assert!(placed.is_empty() || room.width_m.min(room.height_m) > 2.6);
            for (place, a) in placed.iter().enumerate() {
                for b in &placed[..place] {
                    assert!(gap(a, b) > 1.0 - 1e-5, "seed {seed}: {a:?} {b:?}");
                }
                let to_walls = [a[0], a[1], room.width_m - a[2], room.height_m - a[3]];
                for way in to_walls {
                    assert!(way.abs() < 1e-5 || way > 1.0 - 1e-5, "seed {seed}: {a:?}");
                }
            }
        }
    }
}
