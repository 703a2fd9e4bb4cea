//! Medians and their 95 % intervals.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// The 97.5 % quantile of the standard normal distribution.
const Z: f64 = 1.959_963_984_540_054;

const RESAMPLES: usize = 2000;

pub type Interval = (f64, f64);

/// A median with its interval.
pub type Estimate = (f64, Interval);

/// Returns the mean, or `None` without values.
#[must_use]
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Returns Wilson's score interval (Wilson 1927) of the share `hits` / `count` at 95 %; 0 to 1 if `count` is 0.
#[must_use]
pub fn wilson(hits: usize, count: usize) -> Interval {
    wilson_at(hits, count, Z)
}

/// Returns Wilson's interval at the level of the normal distribution's quantile `z`.
#[must_use]
pub fn wilson_at(hits: usize, count: usize, z: f64) -> Interval {
    if count == 0 {
        return (0.0, 1.0);
    }
    let n = count as f64;
    let share = hits as f64 / n;
    let scale = 1.0 + z * z / n;
    let center = (share + z * z / (2.0 * n)) / scale;
    let half = z / scale * (share * (1.0 - share) / n + z * z / (4.0 * n * n)).sqrt();
    // The formula is exact at the ends except for rounding.
    let low = if hits == 0 { 0.0 } else { center - half };
    let high = if hits == count { 1.0 } else { center + half };
    (low, high)
}

/// Returns the median with the bootstrap's percentile interval (Efron 1979), or `None` without values. Equal values always give
/// equal intervals.
#[must_use]
pub fn estimate(mut values: Vec<f64>) -> Option<Estimate> {
    if values.is_empty() {
        return None;
    }
    values.sort_by(f64::total_cmp);
    // All calls use the same draws, so an interval depends only on its values.
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let mut sample = Vec::with_capacity(values.len());
    let mut medians: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            sample.clear();
            // Draws u64 indices, because usize would give different draws on other platforms.
            sample.extend((0..values.len()).map(|_| {
                let place = rng.random_range(0..values.len() as u64);
                values[place as usize]
            }));
            sample.sort_by(f64::total_cmp);
            quantile(&sample, 0.5)
        })
        .collect();
    medians.sort_by(f64::total_cmp);
    let interval = (quantile(&medians, 0.025), quantile(&medians, 0.975));
    Some((quantile(&values, 0.5), interval))
}

/// Returns a quantile of sorted values, with linear interpolation (Hyndman and Fan's type 7).
#[must_use]
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let below = sorted[place.floor() as usize];
    let above = sorted[place.ceil() as usize];
    below + (above - below) * place.fract()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn assert_interval(found: Interval, expected: Interval) {
        assert!(
            (found.0 - expected.0).abs() < 5e-4 && (found.1 - expected.1).abs() < 5e-4,
            "{found:?}"
        );
    }

    #[test]
    fn wilson_matches_hand_calculation() {
        // z² = 3.8415. 8 of 10: (0.8 + 0.19207 ± 1.95996 · √(0.016 + 0.0096036)) / 1.38415
        assert_interval(wilson(8, 10), (0.4902, 0.9433));
        // 0 of 10 has the upper bound z² / (n + z²); 10 of 10 is its mirror image.
        assert_interval(wilson(0, 10), (0.0, 0.2775));
        assert_interval(wilson(10, 10), (0.7225, 1.0));
        // 1 of 2: 0.5 ± 1.95996 / 2.92073 · √(0.125 + 0.240091)
        assert_interval(wilson(1, 2), (0.0945, 0.9055));
        assert_eq!(wilson(0, 0), (0.0, 1.0));
    }

    #[test]
    fn medians_and_quantiles_match_hand_calculation() {
        assert_eq!(quantile(&[1.0], 0.3), 1.0);
        assert_eq!(quantile(&[1.0, 2.0, 4.0, 8.0], 0.5), 3.0);
        assert_eq!(quantile(&[0.0, 10.0, 20.0], 0.25), 5.0);
        assert_eq!(estimate(vec![5.0, 1.0, 3.0]).unwrap().0, 3.0);
        assert_eq!(estimate(Vec::new()), None);
    }

    #[test]
    fn the_bootstrap_of_constant_and_varying_values() {
        assert_eq!(estimate(vec![7.0; 5]), Some((7.0, (7.0, 7.0))));
        // With three values, a sample's median is the least value with probability 1/27 · (1 + 3 · 2) = 7/27 > 2.5 %.
        assert_eq!(estimate(vec![1.0, 2.0, 3.0]), Some((2.0, (1.0, 3.0))));
        // For 0 to 100 uniform, the median's standard error is about 1 / (2 f √n) = 50 / √101, so the interval is about 50 ± 9.8.
        let even = estimate((0..=100).map(f64::from).collect()).unwrap();
        assert!((38.0..=43.0).contains(&even.1.0), "{even:?}");
        assert!((57.0..=62.0).contains(&even.1.1), "{even:?}");
        let turned = (0..=100).rev().map(f64::from).collect();
        assert_eq!(estimate(turned), Some(even));
    }
}
