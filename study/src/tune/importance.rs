//! How much each parameter matters, by the candidates of the random search: they are spread evenly, as those of CMA-ES are not.
//!
//! Two numbers, neither of which knows anything of parameters that matter together only:
//! - η², the correlation ratio: the share of the scores' variance that lies between equal parts of the parameter's range. Of a
//!   parameter that does not matter it is not 0 but about (parts − 1)/(n − 1), which is told beside it.
//! - Spearman's rank correlation: which way, if it is always the same one.

use super::search::Method;
use super::tuning::{Candidate, mean};
use crate::compare::statistics::ranks::ranks;

/// Parts of a parameter's range.
const PARTS: usize = 5;

/// Of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Importance {
    /// η², 0 to 1.
    pub share: f64,
    /// What η² of a parameter that does not matter is, on average.
    pub by_chance: f64,
    /// Spearman's ρ of coordinate and score, -1 to 1; positive: more of it is worse.
    pub correlation: f64,
}

/// Of each parameter.
#[must_use]
pub fn importance(candidates: &[Candidate]) -> Vec<Importance> {
    let own: Vec<&Candidate> = candidates
        .iter()
        .filter(|candidate| candidate.method == Method::Random)
        .collect();
    let scores: Vec<f64> = own.iter().map(|candidate| candidate.score).collect();
    let dimensions = own.first().map_or(0, |candidate| candidate.point.len());
    (0..dimensions)
        .map(|place| {
            let coordinates: Vec<f64> = own.iter().map(|it| it.point[place]).collect();
            Importance {
                share: correlation_ratio(&coordinates, &scores),
                by_chance: (PARTS as f64 - 1.0) / (own.len() as f64 - 1.0).max(1.0),
                correlation: correlation(&ranks(&coordinates), &ranks(&scores)),
            }
        })
        .collect()
}

fn correlation_ratio(coordinates: &[f64], scores: &[f64]) -> f64 {
    let whole = mean(scores.iter().copied());
    let total: f64 = scores
        .iter()
        .map(|score| (score - whole) * (score - whole))
        .sum();
    let part = |coordinate: f64| ((coordinate * PARTS as f64) as usize).min(PARTS - 1);
    let between: f64 = (0..PARTS)
        .map(|number| {
            let both = coordinates.iter().zip(scores);
            let own: Vec<f64> = both
                .filter(|(coordinate, _)| part(**coordinate) == number)
                .map(|(_, score)| *score)
                .collect();
            let off = mean(own.iter().copied()) - whole;
            own.len() as f64 * off * off
        })
        .sum();
    if total > 0.0 { between / total } else { 0.0 }
}

/// Pearson's, which of ranks is Spearman's.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let (mean_a, mean_b) = (mean(a.iter().copied()), mean(b.iter().copied()));
    let products = |first: &[f64], of_first: f64, second: &[f64], of_second: f64| -> f64 {
        let both = first.iter().zip(second);
        both.map(|(x, y)| (x - of_first) * (y - of_second)).sum()
    };
    let spread = products(a, mean_a, a, mean_a) * products(b, mean_b, b, mean_b);
    if spread > 0.0 {
        products(a, mean_a, b, mean_b) / spread.sqrt()
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_matters_and_which_way() {
        let candidates: Vec<Candidate> = (0..100)
            .map(|number| {
                let (a, b) = (
                    f64::from(number % 10) / 10.0 + 0.05,
                    f64::from(number / 10) / 10.0 + 0.05,
                );
                // The first one by a valley, the second one not at all, the third one upwards a little.
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
    fn correlations_by_hand() {
        assert_eq!(correlation(&[1.0, 2.0, 3.0], &[1.0, 2.0, 3.0]), 1.0);
        // Spearman's formula: 1 - 6 Σd²/(n(n² - 1)) with d = 0, 1, 1: 0.5.
        assert!((correlation(&[1.0, 2.0, 3.0], &[1.0, 3.0, 2.0]) - 0.5).abs() < 1e-12);
        assert_eq!(correlation(&[1.0, 1.0], &[1.0, 2.0]), 0.0);
        // Two parts of two: between them all of it.
        assert_eq!(
            correlation_ratio(&[0.0, 0.1, 0.9, 1.0], &[1.0, 1.0, 3.0, 3.0]),
            1.0
        );
    }
}
