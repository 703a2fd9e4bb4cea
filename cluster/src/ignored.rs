//! Counts of ignored messages, with a rate limit for warnings. The limit keeps stray messages from filling a log.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// The minimum time between two warnings of the same kind.
const WARNING_INTERVAL: Duration = Duration::from_secs(1);

/// The number of ignored messages by kind.
#[derive(Clone, Debug, Default)]
pub struct IgnoredMessages {
    kinds: BTreeMap<&'static str, Counter>,
}

#[derive(Clone, Debug)]
struct Counter {
    count: u64,
    warned: Instant,
}

impl IgnoredMessages {
    /// Counts one message. Returns the count so far if a warning is due.
    pub fn count(&mut self, kind: &'static str, now: Instant) -> Option<u64> {
        let Some(counter) = self.kinds.get_mut(kind) else {
            self.kinds.insert(
                kind,
                Counter {
                    count: 1,
                    warned: now,
                },
            );
            return Some(1);
        };
        counter.count += 1;
        if now.duration_since(counter.warned) < WARNING_INTERVAL {
            return None;
        }
        counter.warned = now;
        Some(counter.count)
    }

    /// Adds messages that another component has counted and reported.
    pub fn add(&mut self, kind: &'static str, count: u64, now: Instant) {
        if count > 0 {
            let new = Counter {
                count: 0,
                warned: now,
            };
            self.kinds.entry(kind).or_insert(new).count += count;
        }
    }

    pub fn counts(&self) -> impl Iterator<Item = (&'static str, u64)> {
        self.kinds
            .iter()
            .map(|(kind, counter)| (*kind, counter.count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[allow(clippy::disallowed_methods)] // The start instant is arbitrary.
    fn every_message_is_counted_and_few_cause_a_warning() {
        let start = Instant::now();
        let mut ignored = IgnoredMessages::default();
        let warnings: Vec<u64> = (0..2500)
            .filter_map(|ms| ignored.count("tick", start + Duration::from_millis(ms)))
            .collect();
        assert_eq!(warnings, [1, 1001, 2001]);
        assert_eq!(ignored.count("report", start), Some(1));
        ignored.add("report", 9, start);
        ignored.add("view", 0, start);
        let counts: Vec<_> = ignored.counts().collect();
        assert_eq!(counts, [("report", 10), ("tick", 2500)]);
    }
}
