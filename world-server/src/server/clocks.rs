//! The clocks of two hosts, by which certificates hold or not.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// By how much they may differ.
const APART: Duration = Duration::from_secs(60);

/// Whether the clock of a host, in ms since 1970, is that of this one.
///
/// # Errors
/// By how much they differ, if it is more than a minute.
pub fn check_clock(unix_ms: u64) -> Result<(), String> {
    // Never seen by the simulation.
    #[allow(clippy::disallowed_methods)]
    let now = SystemTime::now();
    compare(now.duration_since(UNIX_EPOCH).unwrap_or_default(), unix_ms)
}

fn compare(here: Duration, unix_ms: u64) -> Result<(), String> {
    let apart = here.abs_diff(Duration::from_millis(unix_ms));
    if apart > APART {
        let apart = humantime::format_duration(Duration::from_secs(apart.as_secs()));
        return Err(format!(
            "this host's clock and the world's are {apart} apart: set them, by NTP for example"
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW_MS: u64 = 1_700_000_000_000;

    #[test]
    fn a_minute_is_allowed_ahead_and_behind() {
        let here = Duration::from_millis(NOW_MS);
        for unix_ms in [NOW_MS, NOW_MS - 60_000, NOW_MS + 60_000] {
            assert_eq!(compare(here, unix_ms), Ok(()));
        }
    }

    #[test]
    fn more_is_told_in_words() {
        let here = Duration::from_millis(NOW_MS);
        let told =
            "this host's clock and the world's are 1m 1s apart: set them, by NTP for example";
        for unix_ms in [NOW_MS - 61_000, NOW_MS + 61_000] {
            assert_eq!(compare(here, unix_ms), Err(told.to_owned()));
        }
        // What a stranger may state.
        assert!(compare(here, 0).is_err());
        assert!(compare(here, u64::MAX).is_err());
    }
}
