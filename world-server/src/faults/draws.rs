//! Random numbers with the same bits on every machine: IEEE arithmetic and libm only.

use std::f64::consts::TAU;

use rand::Rng;

/// The largest number of 32-bit words that one draw takes from a stream.
pub(super) const WORDS: u64 = 4;

/// Draws a uniformly distributed number in [0, 1).
pub(super) fn uniform(rng: &mut impl Rng) -> f64 {
    const RESOLUTION: f64 = 1.0 / (1_u64 << 53) as f64;
    (rng.next_u64() >> 11) as f64 * RESOLUTION
}

/// Draws a normally distributed number with mean 0 and standard deviation 1 (Box and Muller 1958).
pub(super) fn normal(rng: &mut impl Rng) -> f64 {
    exponential(rng, 2.0).sqrt() * libm::cos(TAU * uniform(rng))
}

/// Draws an exponentially distributed number.
pub(super) fn exponential(rng: &mut impl Rng, mean: f64) -> f64 {
    -mean * libm::log(1.0 - uniform(rng))
}

#[cfg(test)]
mod tests {
    use scenario::rng::{Purpose, stream};

    use super::*;

    const COUNT: usize = 100_000;

    /// Computes the mean and the variance of many draws.
    fn moments(mut draw: impl FnMut() -> f64) -> (f64, f64) {
        let values: Vec<f64> = (0..COUNT).map(|_| draw()).collect();
        let mean = values.iter().sum::<f64>() / COUNT as f64;
        let squares = values.iter().map(|value| (value - mean).powi(2));
        (mean, squares.sum::<f64>() / COUNT as f64)
    }

    #[test]
    fn the_distributions_have_their_moments() {
        let mut rng = stream(1, Purpose::Sensor);
        let near = |(mean, variance): (f64, f64), wanted: (f64, f64)| {
            assert!((mean - wanted.0).abs() < 0.02, "{mean}");
            assert!((variance - wanted.1).abs() < 0.05, "{variance}");
        };
        near(moments(|| uniform(&mut rng)), (0.5, 1.0 / 12.0));
        near(moments(|| normal(&mut rng)), (0.0, 1.0));
        near(moments(|| exponential(&mut rng, 1.0)), (1.0, 1.0));
    }

    #[test]
    fn no_draw_uses_more_than_the_declared_words() {
        let mut rng = stream(1, Purpose::Sensor);
        normal(&mut rng);
        assert_eq!(rng.get_word_pos(), u128::from(WORDS));
    }
}
