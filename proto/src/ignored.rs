//! Counts messages that are ignored, and says when a warning about them is due: strangers shall not fill a log.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Least time between two warnings of the same kind.
const WARNING_INTERVAL: Duration = Duration::from_secs(1);

/// How many messages were ignored, by kind.
#[derive(Clone, Debug, Default)]
pub struct Ignored {
    kinds: BTreeMap<&'static str, Kind>,
}

#[derive(Clone, Debug)]
struct Kind {
    count: u64,
    warned: Instant,
}

impl Ignored {
    /// Counts one more. Gives the count so far if somebody should be told now.
    pub fn count(&mut self, kind: &'static str, now: Instant) -> Option<u64> {
        let Some(known) = self.kinds.get_mut(kind) else {
            self.kinds.insert(
                kind,
                Kind {
                    count: 1,
                    warned: now,
                },
            );
            return Some(1);
        };
        known.count += 1;
        if now.duration_since(known.warned) < WARNING_INTERVAL {
            return None;
        }
        known.warned = now;
        Some(known.count)
    }

    /// Adds those that somebody else has counted, and told of.
    pub fn add(&mut self, kind: &'static str, count: u64, now: Instant) {
        if count > 0 {
            let unknown = Kind {
                count: 0,
                warned: now,
            };
            self.kinds.entry(kind).or_insert(unknown).count += count;
        }
    }

    /// All counts.
    pub fn counts(&self) -> impl Iterator<Item = (&'static str, u64)> {
        self.kinds.iter().map(|(kind, known)| (*kind, known.count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[allow(clippy::disallowed_methods)] // Any instant will do to count from.
    fn all_are_counted_and_few_are_told() {
        let start = Instant::now();
        let mut ignored = Ignored::default();
        let told: Vec<u64> = (0..2500)
            .filter_map(|ms| ignored.count("tick", start + Duration::from_millis(ms)))
            .collect();
        assert_eq!(told, [1, 1001, 2001]);
        assert_eq!(ignored.count("report", start), Some(1));
        ignored.add("report", 9, start);
        ignored.add("view", 0, start);
        let counts: Vec<_> = ignored.counts().collect();
        assert_eq!(counts, [("report", 10), ("tick", 2500)]);
    }
}
