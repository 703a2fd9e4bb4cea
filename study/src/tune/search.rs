//! Which points are tried next: by CMA-ES (Hansen and Ostermeier 2001), or at random as the control.
//!
//! What comes next is a function of the seed and of all ranks before. No state is kept: the search is made again from its beginning,
//! which takes next to nothing beside a run, and so one that was interrupted goes on as if it had not been.

use std::cell::{Cell, RefCell};

use cmaes::{CMAESOptions, DVector};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::space::folded;

/// The first step size, of coordinates from 0 to 1.
const STEP: f64 = 0.3;

/// How points are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// By what the points before were like.
    Cmaes,
    /// Evenly distributed.
    Random,
}

impl Method {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Cmaes, Self::Random];

    /// As pages and tables call it.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Cmaes => "CMA-ES",
            Self::Random => "random search",
        }
    }
}

/// A generation's points for so many parameters, as many as CMA-ES is used to: 4 + ⌊3 ln d⌋.
#[must_use]
pub fn population(dimensions: usize) -> usize {
    4 + (3.0 * libm::log(dimensions as f64)) as usize
}

/// The points of the next generation, each of so many coordinates from 0 to 1. `before` are the values of the points of each
/// generation before, in their order; less is better, and only their order counts.
#[must_use]
pub fn next(method: Method, seed: u64, dimensions: usize, before: &[Vec<f64>]) -> Vec<Vec<f64>> {
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
    // It asks for the value of one point after the other.
    let value = |point: &DVector<f64>| {
        let mut points = points.borrow_mut();
        points.push(point.iter().map(|it| folded(*it)).collect());
        let known: Option<&Vec<f64>> = before.get(generation.get());
        known.map_or(0.0, |values| values[points.len() - 1])
    };
    let options = CMAESOptions::new(vec![0.5; dimensions], STEP)
        .population_size(population(dimensions))
        .seed(seed);
    // None of its conditions is broken: there are dimensions, and the step is positive.
    let Ok(mut search) = options.build(value) else {
        return Vec::new();
    };
    for number in 0..=before.len() {
        generation.set(number);
        points.borrow_mut().clear();
        // When to stop is a matter of the budget.
        let _ = search.next();
    }
    drop(search);
    points.into_inner()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Evaluations until the value is that small, or all that are allowed.
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
            let points = next(method, 1, dimensions, &before);
            assert!(points.iter().flatten().all(|it| (0.0..=1.0).contains(it)));
            let values: Vec<f64> = points.iter().map(|point| function(point)).collect();
            count += values.len();
            if values.iter().any(|value| *value < goal) {
                return count;
            }
            before.push(values);
        }
        most
    }

    /// Its least is 0 at 0.3.
    fn sphere(point: &[f64]) -> f64 {
        point.iter().map(|it| (it - 0.3) * (it - 0.3)).sum()
    }

    /// From -2 to 2; its least is 0 at 1, in a bent valley.
    fn rosenbrock(point: &[f64]) -> f64 {
        let x: Vec<f64> = point.iter().map(|it| 4.0 * it - 2.0).collect();
        let pairs = x.windows(2);
        pairs
            .map(|pair| {
                let (a, b) = (pair[0], pair[1]);
                100.0 * (b - a * a) * (b - a * a) + (1.0 - a) * (1.0 - a)
            })
            .sum()
    }

    #[test]
    fn it_finds_the_least_value_of_known_functions_and_random_search_does_not() {
        let cmaes = evaluations(Method::Cmaes, sphere, 6, 1e-6, 3000);
        assert!(cmaes < 700, "{cmaes}");
        assert_eq!(evaluations(Method::Random, sphere, 6, 1e-6, 3000), 3000);
        let valley = evaluations(Method::Cmaes, rosenbrock, 4, 1e-3, 6000);
        assert!(valley < 3000, "{valley}");
        assert_eq!(evaluations(Method::Random, rosenbrock, 4, 1e-3, 6000), 6000);
    }

    #[test]
    fn what_comes_next_depends_on_seed_and_ranks_alone() {
        for method in Method::ALL {
            let first = next(method, 7, 3, &[]);
            assert_eq!(first.len(), population(3));
            assert_eq!(first, next(method, 7, 3, &[]));
            assert_ne!(first, next(method, 8, 3, &[]));
            let ranks = vec![(0..population(3)).map(|it| it as f64).collect::<Vec<_>>()];
            let second = next(method, 7, 3, &ranks);
            assert_ne!(first, second);
            let shifted: Vec<Vec<f64>> = vec![ranks[0].iter().map(|it| it * 9.0 - 4.0).collect()];
            assert_eq!(second, next(method, 7, 3, &shifted));
        }
        assert_eq!([1, 3, 6, 22].map(population), [4, 7, 9, 13]);
    }
}
