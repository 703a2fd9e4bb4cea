//! Robots that avoid each other and the walls in krABMaga: `peer ROBOTS SECONDS`
//!
//! Prints the number of robot-steps and their processor time, s. A step is 50 ms. krABMaga has no physics and no sensors, so
//! a robot reads the positions of others. Once per second, it also reads those of all robots within the range of a radio.

use std::any::Any;
use std::fmt;
use std::hash::{Hash, Hasher};

use krabmaga::engine::agent::Agent;
use krabmaga::engine::fields::field::Field;
use krabmaga::engine::fields::field_2d::{Field2D, Location2D};
use krabmaga::engine::location::Real2D;
use krabmaga::engine::schedule::Schedule;
use krabmaga::engine::state::State;

/// The side of a robot's share of the arena, 30 radii of 0.2 m.
const SHARE_M: f32 = 6.0;
const STEP_S: f32 = 0.05;
const SPEED_M_S: f32 = 0.5;
const TURN_RAD_S: f32 = 1.57;
/// The distance between centers at which a robot turns.
const NEAR_M: f32 = 0.8;
const RADIO_M: f32 = 16.0;
/// The number of steps between two readings of the radio.
const RADIO_PERIOD: u64 = 20;
/// The side of a cell of the index. A query by a shorter distance would miss neighbors in other cells.
const CELL_M: f32 = 4.0;
const WARM_UP: u64 = 20;

#[derive(Clone, Copy)]
struct Robot {
    number: u32,
    place: Real2D,
    heading: f32,
    /// The number of robots in the range of the radio.
    heard: usize,
}

impl Agent for Robot {
    fn step(&mut self, state: &mut dyn State) {
        let arena = state.as_any().downcast_ref::<Arena>().expect("one arena");
        let (sin, cos) = self.heading.sin_cos();
        // The direction of the nearest obstacle in front, to the left if positive.
        let mut nearest = (NEAR_M, 0.0);
        for other in arena
            .field
            .get_neighbors_within_distance(self.place, CELL_M)
        {
            let (x, y) = (other.place.x - self.place.x, other.place.y - self.place.y);
            let distance = x.hypot(y);
            if other.number != self.number && distance < nearest.0 && x * cos + y * sin > 0.0 {
                nearest = (distance, cos * y - sin * x);
            }
        }
        if (arena.step + u64::from(self.number)).is_multiple_of(RADIO_PERIOD) {
            self.heard = arena
                .field
                .get_neighbors_within_distance(self.place, RADIO_M)
                .len();
        }
        let side = arena.field.width;
        let ahead =
            |place: f32, direction: f32| (place + NEAR_M * direction).clamp(0.0, side - 1e-3);
        let wall = ahead(self.place.x, cos) != self.place.x + NEAR_M * cos
            || ahead(self.place.y, sin) != self.place.y + NEAR_M * sin;
        if wall || nearest.0 < NEAR_M {
            self.heading -= TURN_RAD_S * STEP_S * nearest.1.signum();
        } else {
            self.place.x += SPEED_M_S * STEP_S * cos;
            self.place.y += SPEED_M_S * STEP_S * sin;
        }
        arena.field.set_object_location(*self, self.place);
    }
}

impl Location2D<Real2D> for Robot {
    fn get_location(self) -> Real2D {
        self.place
    }

    fn set_location(&mut self, place: Real2D) {
        self.place = place;
    }
}

impl Hash for Robot {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        self.number.hash(hasher);
    }
}

impl PartialEq for Robot {
    fn eq(&self, other: &Self) -> bool {
        self.number == other.number
    }
}

impl Eq for Robot {}

impl fmt::Display for Robot {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.number)
    }
}

struct Arena {
    field: Field2D<Robot>,
    robots: u32,
    step: u64,
}

impl State for Arena {
    fn init(&mut self, schedule: &mut Schedule) {
        let columns = f64::from(self.robots).sqrt().ceil() as u32;
        for number in 0..self.robots {
            let place = |cell: u32| (cell as f32 + 0.5) * SHARE_M;
            let place = Real2D {
                x: place(number % columns),
                y: place(number / columns),
            };
            let robot = Robot {
                number,
                place,
                heading: number as f32,
                heard: 0,
            };
            self.field.set_object_location(robot, place);
            schedule.schedule_repeating(Box::new(robot), 0.0, 0);
        }
    }

    fn update(&mut self, step: u64) {
        self.field.lazy_update();
        self.step = step;
    }

    fn reset(&mut self) {}

    fn as_any(&self) -> &dyn Any {
        self
    }

    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }

    fn as_state(&self) -> &dyn State {
        self
    }

    fn as_state_mut(&mut self) -> &mut dyn State {
        self
    }
}

/// Returns the processor time of this thread, s.
fn processor_s() -> f64 {
    let text =
        std::fs::read_to_string("/proc/thread-self/schedstat").expect("a kernel with schedstat");
    text.split_whitespace()
        .next()
        .expect("a number")
        .parse::<f64>()
        .expect("a number")
        / 1e9
}

fn main() {
    let words: Vec<String> = std::env::args().collect();
    let robots: u32 = words[1].parse().expect("a number of robots");
    let seconds: f64 = words[2].parse().expect("a number of seconds");
    let side = f64::from(robots).sqrt().ceil() as f32 * SHARE_M;
    let mut arena = Arena {
        field: Field2D::new(side, side, CELL_M, false),
        robots,
        step: 0,
    };
    let mut schedule = Schedule::new();
    arena.init(&mut schedule);
    for _ in 0..WARM_UP {
        schedule.step(&mut arena);
    }
    let (mut steps, mut spent, began) = (0, 0.0, processor_s());
    while spent < seconds {
        schedule.step(&mut arena);
        steps += u64::from(robots);
        spent = processor_s() - began;
    }
    println!("{steps} {spent}");
}
