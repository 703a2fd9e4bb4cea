//! Customers of vehicle routing problems as tasks, and numbers in lines of text.

use scenario::Problem;

use super::super::model::Task;
use super::super::source::{Depot, Loaded, Source};

/// A customer of a vehicle routing problem.
#[derive(Clone, Debug, Default)]
pub(super) struct Customer {
    pub number: u64,
    pub line: usize,
    pub x: f64,
    pub y: f64,
    pub demand: Option<f64>,
    /// The earliest and the latest time at which service may begin.
    pub window: Option<[f64; 2]>,
    pub service: f64,
    pub prize: Option<f64>,
    pub release: f64,
}

impl Customer {
    /// Returns the task. The deadline is the end of a service that begins at the last moment.
    fn task(&self) -> Task {
        let opens_s = self.window.map(|[ready, _]| ready - self.release);
        Task {
            id: format!("c{}", self.number),
            x_m: self.x,
            y_m: self.y,
            work_s: self.service,
            arrival_s: self.release,
            opens_s: opens_s.filter(|ready| *ready > 0.0),
            deadline_s: self
                .window
                .map(|[_, due]| due + self.service - self.release),
            value: self.prize,
            demand: self.demand.filter(|demand| *demand != 0.0),
            ..Task::default()
        }
    }
}

/// Returns the instance of a vehicle routing problem. The time limit is the last closing time of a depot.
pub(super) fn load(name: &str, customers: &[Customer], depots: Vec<Depot>) -> Loaded {
    let mut loaded = Loaded {
        task_lines: customers.iter().map(|customer| customer.line).collect(),
        ..Loaded::without_units()
    };
    let instance = &mut loaded.instance;
    instance.name = name.to_owned();
    instance.limit_s = depots
        .iter()
        .filter_map(|depot| depot.closes_s)
        .reduce(f64::max);
    instance.tasks = customers.iter().map(Customer::task).collect();
    loaded.depots = depots;
    loaded
}

/// Returns the numbers of a line.
///
/// # Errors
/// Returns the first word that is not a finite number.
pub(super) fn numbers(source: Source<'_>, line: usize, text: &str) -> Result<Vec<f64>, Problem> {
    let words = text.split_whitespace();
    let numbers = words.map(|word| match word.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(source.error(
            line,
            format!("'{word}' is not a number"),
            "correct the line",
        )),
    });
    numbers.collect()
}

/// Returns a number of a line as a count or an identification.
///
/// # Errors
/// Returns an error if the number is negative or not whole.
pub(super) fn whole(source: Source<'_>, line: usize, number: f64) -> Result<u64, Problem> {
    if number >= 0.0 && number.fract() == 0.0 && number < 1e15 {
        return Ok(number as u64);
    }
    let what = format!("{number} is not a whole number of at least 0");
    Err(source.error(line, what, "correct the line"))
}
