//! A memory of places that a robot did not reach, so that an unreachable place does not keep it from the others.

use std::collections::BTreeMap;

use scenario::time::SimTime;

/// The time for which a place is suspended after the first failed attempt. Each further failure doubles it.
pub const FIRST_SUSPENSION: SimTime = SimTime(30_000);

/// The failed attempts to reach places. A failure suspends the place, for 30 s at first and then for twice the previous
/// time. A success removes the failures.
///
/// The number of attempts at an unreachable place grows only with the logarithm of the time, so any number of such
/// places leaves time for the others. A place that becomes reachable waits at most as long again as it has failed.
#[derive(Clone, Debug, PartialEq)]
pub struct FailedAttempts<K> {
    suspensions: BTreeMap<K, Suspension>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Suspension {
    span: SimTime,
    until: SimTime,
}

impl<K> Default for FailedAttempts<K> {
    fn default() -> Self {
        Self {
            suspensions: BTreeMap::new(),
        }
    }
}

impl<K: Copy + Ord> FailedAttempts<K> {
    /// Records a failed attempt and suspends the place.
    pub fn fail(&mut self, place: K, now: SimTime) {
        let known = self.suspensions.get(&place);
        let span = known.map_or(FIRST_SUSPENSION, |known| known.span + known.span);
        let until = now + span;
        self.suspensions.insert(place, Suspension { span, until });
    }

    /// Suspends a place for some time without a failed attempt.
    pub fn suspend(&mut self, place: K, span: SimTime, now: SimTime) {
        let until = now + span;
        self.suspensions.insert(place, Suspension { span, until });
    }

    pub fn succeed(&mut self, place: K) {
        // The check is faster than a search in an empty map, which is the usual case.
        if !self.suspensions.is_empty() {
            self.suspensions.remove(&place);
        }
    }

    #[must_use]
    pub fn is_suspended(&self, place: K, now: SimTime) -> bool {
        let known = self.suspensions.get(&place);
        known.is_some_and(|known| now < known.until)
    }

    /// Returns the places that are suspended at this time, in ascending order.
    pub fn suspended(&self, now: SimTime) -> impl Iterator<Item = K> {
        let all = self.suspensions.iter();
        all.filter(move |(_, known)| now < known.until)
            .map(|(place, _)| *place)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn suspensions_double_until_a_success() {
        let mut attempts = FailedAttempts::default();
        let mut now = SimTime::ZERO;
        for span in [30_000, 60_000, 120_000, 240_000] {
            attempts.fail(7, now);
            assert!(attempts.is_suspended(7, now + SimTime(span - 1)), "{span}");
            assert_eq!(attempts.suspended(now).collect::<Vec<_>>(), [7]);
            now = now + SimTime(span);
            assert!(!attempts.is_suspended(7, now), "{span}");
        }
        attempts.succeed(7);
        attempts.fail(7, now);
        assert!(!attempts.is_suspended(7, now + FIRST_SUSPENSION));
        assert!(!attempts.is_suspended(8, now), "another place");
    }

    proptest! {
        /// The law behind the promise that all reachable places are served: however many places are unreachable, and
        /// however long an attempt takes, the robot soon finds all of them suspended and is free for a reachable one.
        #[test]
        fn unreachable_places_leave_time_for_others(count in 1..40_usize, attempt_s in 1..90_u64) {
            let mut attempts = FailedAttempts::default();
            let mut now = SimTime::ZERO;
            let mut failures = 0;
            while let Some(place) = (0..count).find(|place| !attempts.is_suspended(*place, now)) {
                now = now + SimTime(1000 * attempt_s);
                attempts.fail(place, now);
                failures += 1;
                prop_assert!(failures <= 10 * count, "{failures} attempts at {count} places");
            }
        }

        #[test]
        fn the_number_of_attempts_is_logarithmic(attempt_s in 1..90_u64, end_s in 1..1_000_000_u64) {
            let mut attempts = FailedAttempts::default();
            let (mut now, mut failures) = (SimTime::ZERO, 0_u32);
            while now < SimTime(1000 * end_s) {
                now = now + SimTime(1000 * if attempts.is_suspended(0, now) { 1 } else { attempt_s });
                if !attempts.is_suspended(0, now) {
                    attempts.fail(0, now);
                    failures += 1;
                }
            }
            prop_assert!(f64::from(failures) <= (end_s as f64 / 30.0 + 1.0).log2() + 2.0, "{failures} in {end_s} s");
        }
    }
}
