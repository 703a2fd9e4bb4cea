//! The importance of each parameter, from the uniformly distributed candidates of the random search.
//!
//! Two numbers, which both ignore interactions between parameters:
//! - η², the correlation ratio: the share of the scores' variance between equal parts of the parameter's range. For a parameter
//!   without effect it is about (parts − 1)/(n − 1).
//! - Spearman's rank correlation: the direction of the effect, if it is monotonic.

use statrs::statistics::Statistics;

use super::search::Method;
use super::tuning::{Candidate, mean};
use crate::compare::statistics::ranks::ranks;

/// The number of equal parts of a range.
const PARTS: usize = 5;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Importance {
    /// η², the correlation ratio, from 0 to 1.
    pub share: f64,
    /// The expected η² of a parameter without effect.
    pub by_chance: f64,
    /// Spearman's ρ of coordinate and score, -1 to 1; positive if larger values are worse.
    pub correlation: f64,
}

#[must_use]
pub fn importance(candidates: &[Candidate]) -> Vec<Importance> {
    let random = candidates.iter();
    let random = random.filter(|candidate| candidate.method == Method::Random);
    let scores: Vec<f64> = random.clone().map(|candidate| candidate.score).collect();
    let dimensions = random
        .clone()
        .next()
        .map_or(0, |candidate| candidate.point.len());
    let importance = (0..dimensions).map(|place| {
        let coordinates = random.clone().map(|candidate| candidate.point[place]);
        let coordinates: Vec<f64> = coordinates.collect();
        Importance {
            share: correlation_ratio(&coordinates, &scores),
            by_chance: (PARTS as f64 - 1.0) / (scores.len() as f64 - 1.0).max(1.0),
            correlation: correlation(&ranks(&coordinates), &ranks(&scores)),
        }
    });
    importance.collect()
}

fn correlation_ratio(coordinates: &[f64], scores: &[f64]) -> f64 {
    let whole = mean(scores.iter().copied());
    let squares = scores.iter().map(|score| (score - whole) * (score - whole));
    let total: f64 = squares.sum();
    let part = |coordinate: f64| ((coordinate * PARTS as f64) as usize).min(PARTS - 1);
    let between: f64 = (0..PARTS)
        .map(|number| {
            let both = coordinates.iter().zip(scores);
            let members: Vec<f64> = both
                .filter(|(coordinate, _)| part(**coordinate) == number)
                .map(|(_, score)| *score)
                .collect();
            let off = mean(members.iter().copied()) - whole;
            members.len() as f64 * off * off
        })
        .sum();
    if total > 0.0 { between / total } else { 0.0 }
}

/// Returns Pearson's correlation, which for ranks is Spearman's.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let spread = a.std_dev() * b.std_dev();
    if spread > 0.0 {
        a.covariance(b) / spread
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn importance_and_direction_of_parameters() {
        let candidates: Vec<Candidate> = (0..100)
            .map(|number| {
                let (a, b) = (
                    f64::from(number % 10) / 10.0 + 0.05,
                    f64::from(number / 10) / 10.0 + 0.05,
                );
                // Effects: the first parameter a valley, the second none, the third a small increase.
                let c = f64::from(number * 37 % 100) / 100.0;
                Candidate {
                    method: Method::Random,
                    generation: 0,
                    point: vec![a, b, c],
                    values: Vec::new(),
                    runs: 0,
                    own_runs: 0,
                    dropped: false,
                    metric: 0.0,
                    bytes: 0.0,
                    score: 10.0 * (a - 0.5) * (a - 0.5) + 0.3 * c,
                }
            })
            .collect();
        let [valley, nothing, upwards] = importance(&candidates)[..] else {
            panic!("three parameters")
        };
        assert!(
            valley.share > 0.7 && valley.correlation.abs() < 0.1,
            "{valley:?}"
        );
        assert!(nothing.share < 0.1, "{nothing:?}");
        assert!(upwards.correlation > 0.05, "{upwards:?}");
        assert!((valley.by_chance - 4.0 / 99.0).abs() < 1e-12);
    }

    #[test]
    fn correlations_match_hand_calculation() {
        assert_eq!(correlation(&[1.0, 2.0, 3.0], &[1.0, 2.0, 3.0]), 1.0);
        // Spearman's formula: 1 - 6 Σd²/(n(n² - 1)) with d = 0, 1, 1: 0.5.
        assert!((correlation(&[1.0, 2.0, 3.0], &[1.0, 3.0, 2.0]) - 0.5).abs() < 1e-12);
        assert_eq!(correlation(&[1.0, 1.0], &[1.0, 2.0]), 0.0);
        // Two parts of two values: the entire variance lies between them.
        let ratio = correlation_ratio(&[0.0, 0.1, 0.9, 1.0], &[1.0, 1.0, 3.0, 3.0]);
        assert_eq!(ratio, 1.0);
    }
}
