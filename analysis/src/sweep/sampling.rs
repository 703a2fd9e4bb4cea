//! Random points. Each key has its own random stream, so adding a key does not change the draws of others.

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use toml::Value;
use xxhash_rust::xxh3::xxh3_64;

#[derive(Clone, Debug, PartialEq)]
pub enum Distribution {
    /// A whole number between both bounds, inclusive; uniform.
    Integer(i64, i64),
    /// A number between both bounds; uniform.
    Uniform(f64, f64),
    /// A positive number between both bounds; its logarithm is uniform.
    Log(f64, f64),
    /// One of the listed values; uniform.
    Choice(Vec<Value>),
}

impl Distribution {
    /// Returns the bounds, or all values of a choice.
    #[must_use]
    pub fn limits(&self) -> Vec<Value> {
        match self {
            Self::Integer(min, max) => vec![Value::Integer(*min), Value::Integer(*max)],
            Self::Uniform(min, max) | Self::Log(min, max) => {
                vec![Value::Float(*min), Value::Float(*max)]
            }
            Self::Choice(values) => values.clone(),
        }
    }

    fn draw(&self, rng: &mut ChaCha8Rng) -> Value {
        let u = uniform(rng);
        match self {
            Self::Integer(min, max) => {
                let span = max.abs_diff(*min) as f64 + 1.0;
                // Rounding can reach the end of a very long span.
                let steps = ((u * span) as u64).min(max.abs_diff(*min));
                Value::Integer(min.saturating_add_unsigned(steps))
            }
            Self::Uniform(min, max) => Value::Float(min + u * (max - min)),
            Self::Log(min, max) => {
                let (from, to) = (libm::log(*min), libm::log(*max));
                // The logarithm and its inverse can miss a bound by rounding.
                Value::Float(libm::exp(from + u * (to - from)).clamp(*min, *max))
            }
            Self::Choice(values) => {
                let place = (u * values.len() as f64) as usize;
                values[place.min(values.len() - 1)].clone()
            }
        }
    }
}

/// Draws `count` values of a key.
#[must_use]
pub fn draw(seed: u64, key: &str, distribution: &Distribution, count: usize) -> Vec<Value> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(xxh3_64(key.as_bytes()));
    (0..count).map(|_| distribution.draw(&mut rng)).collect()
}

/// Draws a number in [0, 1) with the same bits on every machine.
fn uniform(rng: &mut ChaCha8Rng) -> f64 {
    const RESOLUTION: f64 = 1.0 / (1_u64 << 53) as f64;
    (rng.next_u64() >> 11) as f64 * RESOLUTION
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(distribution: &Distribution) -> Vec<f64> {
        let values = draw(1, "key", distribution, 10_000);
        let number = |value: &Value| {
            value
                .as_float()
                .or_else(|| value.as_integer().map(|number| number as f64))
        };
        values.iter().map(|value| number(value).unwrap()).collect()
    }

    #[track_caller]
    fn assert_mean(distribution: &Distribution, within: (f64, f64), mean: f64) {
        let drawn = numbers(distribution);
        assert!(drawn.iter().all(|x| (within.0..=within.1).contains(x)));
        let found = drawn.iter().sum::<f64>() / drawn.len() as f64;
        assert!((found - mean).abs() < 0.03 * mean, "{found}");
    }

    #[test]
    fn each_distribution_keeps_its_bounds_and_mean() {
        assert_mean(&Distribution::Uniform(2.0, 4.0), (2.0, 4.0), 3.0);
        // The mean of x with ln x uniform in [ln 1, ln 100] is 99 / ln 100.
        assert_mean(&Distribution::Log(1.0, 100.0), (1.0, 100.0), 21.5);
        assert_mean(&Distribution::Integer(1, 6), (1.0, 6.0), 3.5);
        let die = numbers(&Distribution::Integer(1, 6));
        assert!([1.0, 6.0].iter().all(|end| die.contains(end)));
        let choice = Distribution::Choice(vec![Value::Float(1.0), Value::Float(3.0)]);
        assert_mean(&choice, (1.0, 3.0), 2.0);
    }

    #[test]
    fn keys_draw_independently_and_seeds_repeat_draws() {
        let even = Distribution::Uniform(0.0, 1.0);
        let a = draw(1, "a", &even, 3);
        assert_eq!(a, draw(1, "a", &even, 4)[..3]);
        assert_ne!(a, draw(1, "b", &even, 3));
        assert_ne!(a, draw(2, "a", &even, 3));
    }
}
