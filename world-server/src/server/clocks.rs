//! A comparison of two hosts' clocks, because certificates are valid for a limited time.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

const APART: Duration = Duration::from_secs(60);

/// Compares the clock of a host, in ms since 1970, with the local clock.
///
/// # Errors
/// Returns a text with the difference if it is more than a minute.
pub fn check_clock(unix_ms: u64) -> Result<(), String> {
    // The simulation does not use this time.
    #[allow(clippy::disallowed_methods)]
    let now = SystemTime::now();
    compare(now.duration_since(UNIX_EPOCH).unwrap_or_default(), unix_ms)
}

fn compare(here: Duration, unix_ms: u64) -> Result<(), String> {
    let apart = here.abs_diff(Duration::from_millis(unix_ms));
    if apart > APART {
        let apart = humantime::format_duration(Duration::from_secs(apart.as_secs()));
        return Err(format!(
            "the clocks of this host and the world differ by {apart}; synchronize them, for example with NTP"
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
    fn a_larger_difference_is_an_error() {
        let here = Duration::from_millis(NOW_MS);
        let expected = "the clocks of this host and the world differ by 1m 1s; synchronize them, for example with NTP";
        for unix_ms in [NOW_MS - 61_000, NOW_MS + 61_000] {
            assert_eq!(compare(here, unix_ms), Err(expected.to_owned()));
        }
        // Extreme values of an untrusted sender.
        assert!(compare(here, 0).is_err());
        assert!(compare(here, u64::MAX).is_err());
    }
}
