//! The size that a log can reach, compared with the free space of its disk.

use std::path::Path;

use nix::sys::statvfs::statvfs;
use run_log::LogLevel;
use scenario::Setup;
use scenario::time::SimTime;

/// The usual length of rows, bytes.
mod row {
    pub const SET: f64 = 62.0;
    pub const POSE: f64 = 55.0;
    pub const MESSAGE: f64 = 82.0;
    pub const REPEATED_MESSAGE: f64 = 33.0;
    pub const CONTENT: f64 = 85.0;
    pub const HASH: f64 = 45.0;
}

/// The sections of a robot in a tick, and the rows of a seal.
const SECTIONS: f64 = 4.0;
const SEALS: f64 = 3.0;

/// Returns the note about a log that can fill its disk before the time limit. Returns `None` if there is enough space, or
/// if the free space is not known.
pub fn note(setup: &Setup, level: LogLevel, folder: &Path) -> Option<String> {
    // The folder does not exist yet.
    let existing = folder.ancestors().find(|path| path.exists());
    let disk = statvfs(existing.unwrap_or(Path::new("."))).ok()?;
    let free = disk.blocks_available() as f64 * disk.fragment_size() as f64;
    note_of(setup, level, free)
}

fn note_of(setup: &Setup, level: LogLevel, free: f64) -> Option<String> {
    let needed = bytes_at_limit(setup, level);
    let [needed_gb, free_gb] = [needed, free].map(|bytes| bytes / 1e9);
    (needed > free).then(|| {
        format!(
            "note: the log can reach {needed_gb:.2} GB at the limit of {} s, but its disk has {free_gb:.2} GB free; \
             use --log summary or a shorter --limit",
            setup.scenario.limit_s
        )
    })
}

/// Returns the size of a log at the time limit if each robot moves all the time.
fn bytes_at_limit(setup: &Setup, level: LogLevel) -> f64 {
    if !level.has_every_tick() {
        return 0.0;
    }
    let is_full = level == LogLevel::Full;
    let robots = setup.scenario.robots.len() as f64;
    let allocators = setup.scenario.allocator_list();
    let has_motivations = allocators.contains("alliance");
    // Motivations have few rows in a compact log. Utilities change while a robot moves.
    let set = if is_full || !has_motivations {
        row::SET
    } else {
        0.0
    };
    // Other allocators send up to a row about each robot or task near them.
    let content = if has_motivations {
        0.0
    } else {
        row::CONTENT * (robots + 4.0)
    };
    let (message, hashes) = if is_full {
        (row::MESSAGE, robots * SECTIONS)
    } else {
        (row::REPEATED_MESSAGE, 0.0)
    };
    let per_tick =
        set * setup.behavior_sets() as f64 + row::POSE * robots + row::HASH * (hashes + SEALS);
    let robots_with_values = setup.alliance.robots.values();
    let sets = robots_with_values.flat_map(|robot| robot.sets.values());
    let rate_hz = sets.map(|set| set.broadcast_rate_hz).fold(0.0, f64::max);
    let step_s = SimTime(setup.scenario.step_ms).as_secs_f64();
    let per_broadcast = message * (robots - 1.0) + content;
    let per_second = per_tick / step_s + per_broadcast * robots * rate_hz;
    per_second * setup.scenario.limit_s
}

#[cfg(test)]
mod tests {
    use missions::Registry;
    use missions::waste::data::default_setup;

    use super::*;

    #[test]
    fn only_a_log_that_does_not_fit_has_a_note() {
        let setup = default_setup(1);
        let [full, compact] = [LogLevel::Full, LogLevel::Compact];
        assert!(bytes_at_limit(&setup, full) > 3.0 * bytes_at_limit(&setup, compact));
        assert_eq!(note_of(&setup, full, 1e9), None);
        assert_eq!(note_of(&setup, LogLevel::Summary, 0.0), None);
        let note = note_of(&setup, full, 1e6).unwrap();
        assert!(note.starts_with("note: the log can reach 0."), "{note}");
        assert!(
            note.contains("but its disk has 0.00 GB free; use"),
            "{note}"
        );
    }

    /// The sizes are those of runs of 60 s with compact logs.
    #[test]
    fn contents_of_messages_count() {
        let known = Registry::built_in().vocabulary();
        let waste = known
            .missions
            .iter()
            .find(|mission| mission.name() == "waste");
        for (allocator, robots, megabytes) in [
            ("dhba", 100, 77.8),
            ("grape", 100, 74.4),
            ("hipc", 30, 10.1),
        ] {
            let mut scenario = waste.unwrap().family(robots, 2 * robots / 3).unwrap();
            scenario.allocator = Some(allocator.to_owned());
            scenario.limit_s = 60.0;
            let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
            let bytes = bytes_at_limit(&setup, LogLevel::Compact);
            assert!(bytes > megabytes * 1e6, "{allocator}: {bytes}");
        }
    }
}
