//! Random rooms for closed-loop tests: disjoint obstacles with corridors that a robot can pass.

use alliance_proto::scenario::{Obstacle, Scenario};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// Least way between two obstacles, and between an obstacle and a wall that it does not touch, m: 2.5 robot diameters.
pub const CORRIDOR_M: f32 = 1.0;
/// Around the deposit's center so much stays free, m.
const DEPOSIT_FREE_M: f32 = 0.5;
/// Right of the left wall so much stays free at the report site, m: the robots start there.
const SITE_FREE_M: f32 = 1.2;
/// Places tried for one obstacle.
const TRIES: usize = 200;

/// A rectangle: x and y of the lower left corner, then of the upper right one, m.
type Rectangle = [f32; 4];

/// The default mission with 1 to 8 obstacles of 0.3 to 2.5 m at random places. One in four stands at a wall; all others keep
/// [`CORRIDOR_M`] from the walls, and all keep it from each other. They may cover parts of the spills.
#[must_use]
pub fn random_room(seed: u64) -> Scenario {
    let mut scenario = Scenario {
        name: format!("room-{seed}"),
        ..Scenario::default()
    };
    let room = scenario.room;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let wanted = rng.random_range(1..=8);
    let deposit = scenario.waste.deposit;
    let (deposit_x, deposit_y) = (
        deposit.x_fraction * room.width_m,
        deposit.y_fraction * room.height_m,
    );
    let site_half_m = scenario.waste.report_site.height_m / 2.0;
    let kept_free: [Rectangle; 2] = [
        [
            deposit_x - DEPOSIT_FREE_M,
            deposit_y - DEPOSIT_FREE_M,
            deposit_x + DEPOSIT_FREE_M,
            deposit_y + DEPOSIT_FREE_M,
        ],
        [
            0.0,
            room.height_m / 2.0 - site_half_m,
            SITE_FREE_M,
            room.height_m / 2.0 + site_half_m,
        ],
    ];
    let mut placed: Vec<Rectangle> = Vec::new();
    for _ in 0..wanted {
        for _ in 0..TRIES {
            let (width, height) = (rng.random_range(0.3..2.5), rng.random_range(0.3..2.5));
            let left = rng.random_range(CORRIDOR_M..room.width_m - width - CORRIDOR_M);
            let low = rng.random_range(CORRIDOR_M..room.height_m - height - CORRIDOR_M);
            let (left, low) = match rng.random_range(0..16) {
                0 => (0.0, low),
                1 => (room.width_m - width, low),
                2 => (left, 0.0),
                3 => (left, room.height_m - height),
                _ => (left, low),
            };
            let candidate = [left, low, left + width, low + height];
            let clear = |others: &[Rectangle], least: f32| {
                others.iter().all(|other| gap(&candidate, other) >= least)
            };
            if clear(&placed, CORRIDOR_M) && clear(&kept_free, 0.0) {
                placed.push(candidate);
                break;
            }
        }
    }
    scenario.obstacles = placed
        .iter()
        .map(|&[left, low, right, high]| Obstacle {
            x_m: left,
            y_m: low,
            width_m: right - left,
            height_m: high - low,
            penetrability: 0.0,
        })
        .collect();
    scenario
}

/// Way between two rectangles, m; negative where they overlap.
fn gap(a: &Rectangle, b: &Rectangle) -> f32 {
    let x = (a[0] - b[2]).max(b[0] - a[2]);
    let y = (a[1] - b[3]).max(b[1] - a[3]);
    if x > 0.0 && y > 0.0 {
        (x * x + y * y).sqrt()
    } else {
        x.max(y)
    }
}
