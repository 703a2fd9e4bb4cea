//! The next points of a search: by CMA-ES (Hansen and Ostermeier 2001), or at random as a control.
//!
//! The next points are a function of the seed and of all earlier ranks. No state is stored: each call replays the search from
//! its start, which takes negligible time compared with a run. A resumed search therefore equals an uninterrupted one.

use std::cell::{Cell, RefCell};

use crate::sweep::plan::space::reflected;
use cmaes::{CMAESOptions, DVector};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// The initial step size for coordinates from 0 to 1.
const STEP: f64 = 0.3;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// CMA-ES, which adapts to the earlier points.
    Cmaes,
    /// Uniform random points, the control.
    Random,
}

impl Method {
    pub const ALL: [Self; 2] = [Self::Cmaes, Self::Random];

    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Cmaes => "CMA-ES",
            Self::Random => "random search",
        }
    }

    /// Returns the part of a file name.
    #[must_use]
    pub fn slug(self) -> &'static str {
        match self {
            Self::Cmaes => "cma-es",
            Self::Random => "random",
        }
    }
}

/// Returns the number of points in a generation, the default of CMA-ES: 4 + ⌊3 ln d⌋.
#[must_use]
pub fn population(dimensions: usize) -> usize {
    4 + (3.0 * libm::log(dimensions as f64)) as usize
}

/// Returns the points of the next generation, with coordinates from 0 to 1. `before` contains the values of the earlier
/// generations' points in order. Less is better, and only the order of the values counts.
#[must_use]
pub fn next_points(
    method: Method,
    seed: u64,
    dimensions: usize,
    before: &[Vec<f64>],
) -> Vec<Vec<f64>> {
    match method {
        Method::Cmaes => by_cmaes(seed, dimensions, before),
        Method::Random => {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(before.len() as u64);
            let point = |_| (0..dimensions).map(|_| rng.random::<f64>()).collect();
            (0..population(dimensions)).map(point).collect()
        }
    }
}

fn by_cmaes(seed: u64, dimensions: usize, before: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let generation = Cell::new(0);
    let points: RefCell<Vec<Vec<f64>>> = RefCell::new(Vec::new());
    // CMA-ES requests the values of the points one after the other.
    let value = |point: &DVector<f64>| {
        let mut points = points.borrow_mut();
        points.push(
            point
                .iter()
                .map(|coordinate| reflected(*coordinate))
                .collect(),
        );
        let known: Option<&Vec<f64>> = before.get(generation.get());
        known.map_or(0.0, |values| values[points.len() - 1])
    };
    let options = CMAESOptions::new(vec![0.5; dimensions], STEP)
        .population_size(population(dimensions))
        .seed(seed);
    // The options are valid: there are dimensions, and the step is positive.
    let Ok(mut search) = options.build(value) else {
        return Vec::new();
    };
    for number in 0..=before.len() {
        generation.set(number);
        points.borrow_mut().clear();
        // The budget decides when to stop.
        let _ = search.next();
    }
    drop(search);
    points.into_inner()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts the evaluations until the value is small enough, or all that are allowed.
    fn evaluations(
        method: Method,
        function: fn(&[f64]) -> f64,
        dimensions: usize,
        goal: f64,
        most: usize,
    ) -> usize {
        let mut before: Vec<Vec<f64>> = Vec::new();
        let mut count = 0;
        while count < most {
            let points = next_points(method, 1, dimensions, &before);
            let mut coordinates = points.iter().flatten();
            assert!(coordinates.all(|coordinate| (0.0..=1.0).contains(coordinate)));
            let values: Vec<f64> = points.iter().map(|point| function(point)).collect();
            count += values.len();
            if values.iter().any(|value| *value < goal) {
                return count;
            }
            before.push(values);
        }
        most
    }

    /// Returns a sphere function with the minimum 0 at 0.3.
    fn sphere(point: &[f64]) -> f64 {
        point.iter().map(|x| (x - 0.3) * (x - 0.3)).sum()
    }

    /// Returns Rosenbrock's function on -2 to 2, with the minimum 0 at 1 in a curved valley.
    fn rosenbrock(point: &[f64]) -> f64 {
        let x: Vec<f64> = point
            .iter()
            .map(|coordinate| 4.0 * coordinate - 2.0)
            .collect();
        let pairs = x.windows(2);
        pairs
            .map(|pair| {
                let (a, b) = (pair[0], pair[1]);
                100.0 * (b - a * a) * (b - a * a) + (1.0 - a) * (1.0 - a)
            })
            .sum()
    }

    #[test]
    fn cmaes_finds_minima_of_known_functions_and_random_search_does_not() {
        let cmaes = evaluations(Method::Cmaes, sphere, 6, 1e-6, 3000);
        assert!(cmaes < 700, "{cmaes}");
        assert_eq!(evaluations(Method::Random, sphere, 6, 1e-6, 3000), 3000);
        let valley = evaluations(Method::Cmaes, rosenbrock, 4, 1e-3, 6000);
        assert!(valley < 3000, "{valley}");
        assert_eq!(evaluations(Method::Random, rosenbrock, 4, 1e-3, 6000), 6000);
    }

    #[test]
    fn the_next_points_depend_only_on_seed_and_ranks() {
        for method in Method::ALL {
            let first = next_points(method, 7, 3, &[]);
            assert_eq!(first.len(), population(3));
            assert_eq!(first, next_points(method, 7, 3, &[]));
            assert_ne!(first, next_points(method, 8, 3, &[]));
            let ranks = (0..population(3)).map(|rank| rank as f64);
            let second = next_points(method, 7, 3, &[ranks.clone().collect()]);
            assert_ne!(first, second);
            let shifted = ranks.map(|rank| rank * 9.0 - 4.0).collect();
            assert_eq!(second, next_points(method, 7, 3, &[shifted]));
        }
        assert_eq!([1, 3, 6, 22].map(population), [4, 7, 9, 13]);
    }
}
