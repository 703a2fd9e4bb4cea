//! The frame of a scenario: how places of a file become places on the floor.

use std::fmt;

use scenario::Problem;
use scenario::limits::{FARTHEST_M, LONGEST_M};

use super::model::{Floor, Instance, Robot, Task};
use super::source::{LengthUnit, Loaded, Source};

/// The least distance of a place from the border, m. A robot needs room beside the task.
const MARGIN_M: f64 = 1.0;
/// The least extent of an instance without a unit of length, m. Robots would cover a smaller one.
const LEAST_M: f64 = 10.0;

/// A frame: places are scaled, then shifted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Metres on the floor per unit of the file.
    pub scale: f64,
    /// The shift after scaling, m.
    pub shift: [f64; 2],
    pub room: Floor,
}

impl Frame {
    /// The frame that leaves all places as they are, without a room.
    pub const UNCHANGED: Self = Self {
        scale: 1.0,
        shift: [0.0, 0.0],
        room: Floor {
            x_m: 0.0,
            y_m: 0.0,
            width_m: 0.0,
            height_m: 0.0,
        },
    };

    /// Returns the frame of an instance. `scale` is the scale that the user states; by default it is a power of ten,
    /// 1 if possible.
    ///
    /// # Errors
    /// Returns an error if the places do not fit in a room with the stated scale, or outside the stated room.
    pub fn new(loaded: &Loaded, scale: Option<f64>, source: Source<'_>) -> Result<Self, Problem> {
        let (instance, unit) = (&loaded.instance, loaded.unit);
        if let Some(room) = instance.room {
            return Self::of_room(loaded, room, scale, source);
        }
        let bound = |axis: usize, start: f64, choose: fn(f64, f64) -> f64| {
            let coordinates = places(instance).map(|place| place[axis]);
            coordinates.fold(start, choose)
        };
        let least = [0, 1].map(|axis| bound(axis, f64::INFINITY, f64::min));
        let most = [0, 1].map(|axis| bound(axis, f64::NEG_INFINITY, f64::max));
        let extent = (most[0] - least[0]).max(most[1] - least[1]);
        let fits = |scale: f64| extent * scale + 2.0 * MARGIN_M <= FARTHEST_M;
        let scale = match scale {
            Some(scale) if fits(scale) => scale,
            Some(scale) => {
                let what = format!("the places extend over {} m", readable(extent * scale));
                let remedy = format!(
                    "use at most {}",
                    readable((FARTHEST_M - 2.0 * MARGIN_M) / extent)
                );
                return Err(Problem::with_source("--scale", what, remedy));
            }
            None => {
                let is_small = |scale: f64| {
                    unit == LengthUnit::None && extent > 0.0 && extent * scale < LEAST_M
                };
                let mut scale = 1.0;
                while !fits(scale) {
                    scale /= 10.0;
                }
                while is_small(scale) {
                    scale *= 10.0;
                }
                scale
            }
        };
        // Returns shift, lower and upper end of an axis.
        let axis = |axis: usize| {
            let (least, most) = (least[axis] * scale, most[axis] * scale);
            let shift = if least - MARGIN_M >= -FARTHEST_M && most + MARGIN_M <= FARTHEST_M {
                0.0
            } else {
                round(MARGIN_M - least).ceil()
            };
            let (least, most) = (least + shift, most + shift);
            // A small room begins at 0 if possible.
            let from = if least >= MARGIN_M && most + MARGIN_M <= LONGEST_M {
                0.0
            } else {
                round(least - MARGIN_M).floor().max(-FARTHEST_M)
            };
            (shift, from, round(most + MARGIN_M).ceil().min(FARTHEST_M))
        };
        let [x, y] = [axis(0), axis(1)];
        Ok(Self {
            scale,
            shift: [x.0, y.0],
            room: Floor {
                x_m: x.1,
                y_m: y.1,
                width_m: x.2 - x.1,
                height_m: y.2 - y.1,
            },
        })
    }

    /// Returns the frame of an instance that states its room: places stay as they are.
    fn of_room(
        loaded: &Loaded,
        room: Floor,
        scale: Option<f64>,
        source: Source<'_>,
    ) -> Result<Self, Problem> {
        if scale.is_some() {
            let what = "the file or the map states the room";
            return Err(Problem::with_source("--scale", what, "leave it out"));
        }
        let checked = room.as_room().check(FARTHEST_M);
        checked.map_err(|problem| Problem::with_source(source.name, problem.to_string(), ""))?;
        let (right, top) = (room.x_m + room.width_m, room.y_m + room.height_m);
        let outside = |line: usize, [x, y]: [f64; 2]| {
            let is_inside = (room.x_m..=right).contains(&x) && (room.y_m..=top).contains(&y);
            if is_inside {
                return Ok(());
            }
            let mut what = format!(
                "({x}, {y}) m lies outside the room of {} × {} m",
                room.width_m, room.height_m
            );
            if (room.x_m, room.y_m) != (0.0, 0.0) {
                what += &format!(" at ({}, {}) m", room.x_m, room.y_m);
            }
            Err(source.error(line, what, "move it into the room"))
        };
        for (index, task) in loaded.instance.tasks.iter().enumerate() {
            for place in of_task(task) {
                outside(loaded.task_line(index), place)?;
            }
        }
        for (index, robot) in loaded.instance.robots.iter().enumerate() {
            if let Some(place) = start(robot) {
                outside(loaded.robot_line(index), place)?;
            }
        }
        Ok(Self {
            room,
            ..Self::UNCHANGED
        })
    }

    /// Returns a place on the floor, m. It is rounded to a micrometre, because the sum of two decimal numbers has
    /// further digits.
    #[must_use]
    pub fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let on_axis = |at: f64, axis: usize| round(at * self.scale + self.shift[axis]);
        [on_axis(x, 0), on_axis(y, 1)]
    }

    /// Returns a length or a speed on the floor.
    #[must_use]
    pub fn length(&self, length: f64) -> f64 {
        round(length * self.scale)
    }
}

/// Displays the conversion of places, such as `1 unit is 0.1 m, shifted by (101, 0) m`.
impl fmt::Display for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.shift;
        write!(f, "1 unit of length is {} m", readable(self.scale))?;
        if self.scale != 1.0 {
            write!(f, ", and speeds are scaled alike")?;
        }
        if self.shift == [0.0, 0.0] {
            return write!(f, "; places are not shifted");
        }
        write!(f, "; places are shifted by ({x}, {y}) m")
    }
}

fn round(length: f64) -> f64 {
    (length * 1e6).round() / 1e6
}

/// Formats a number with at most six significant digits.
fn readable(number: f64) -> String {
    let digits = 5 - number.abs().max(1e-9).log10().floor() as i32;
    let factor = 10_f64.powi(digits);
    ((number * factor).floor() / factor).to_string()
}

/// Returns all places of an instance.
fn places(instance: &Instance) -> impl Iterator<Item = [f64; 2]> + '_ {
    let tasks = instance.tasks.iter().flat_map(of_task);
    tasks.chain(instance.robots.iter().filter_map(start))
}

fn of_task(task: &Task) -> impl Iterator<Item = [f64; 2]> + use<> {
    std::iter::once([task.x_m, task.y_m]).chain(task.deliver_to)
}

fn start(robot: &Robot) -> Option<[f64; 2]> {
    Some([robot.x_m?, robot.y_m?])
}
