//! The corners of all curves of a finished run, within a bound for memory.

use proto::view::Corner;
use scenario::time::SimTime;

/// The maximum number of corners of all curves. A corner has 40 bytes, and about three times as many on the way to the page.
const CORNERS_MAX: usize = 1_000_000;

/// The spacing after which nothing more is dropped: a day.
const SPACING_MAX: SimTime = SimTime(86_400_000);

/// The corners of the curves of each robot, by time. Beyond the maximum, corners of equal state that follow each other within a
/// spacing are dropped. The spacing doubles until the number fits.
pub struct Corners {
    by_robot: Vec<Vec<Corner>>,
    count: usize,
    max: usize,
    spacing: SimTime,
}

impl Corners {
    #[must_use]
    pub fn new(robots: usize, step: SimTime) -> Self {
        Self::with_max(robots, step, CORNERS_MAX)
    }

    fn with_max(robots: usize, step: SimTime, max: usize) -> Self {
        Self {
            by_robot: vec![Vec::new(); robots],
            count: 0,
            max,
            spacing: step,
        }
    }

    /// Adds corners, by time for each robot.
    pub fn add(&mut self, corners: impl IntoIterator<Item = Corner>) {
        for corner in corners {
            self.by_robot[corner.robot.index()].push(corner);
            self.count += 1;
        }
        if self.count > self.max {
            // The new corners are not thinned yet. Without this pass the spacing would double each time the space is used up.
            self.thin();
            // A quarter of free space keeps the number of passes small.
            while self.count > self.max / 4 * 3 && self.spacing < SPACING_MAX {
                self.spacing = self.spacing + self.spacing;
                self.thin();
            }
            // Starts, ends and changes of state alone need more than the maximum.
            if self.count > self.max / 4 * 3 {
                self.max = 2 * self.count;
            }
        }
    }

    /// Returns the corners of a robot; empty for an unknown robot.
    #[must_use]
    pub fn of(&self, rank: usize) -> &[Corner] {
        self.by_robot.get(rank).map_or(&[], Vec::as_slice)
    }

    /// Drops corners within the spacing.
    fn thin(&mut self) {
        let spacing = self.spacing;
        for corners in &mut self.by_robot {
            let mut kept: Vec<Option<Corner>> = Vec::new();
            corners.retain(|corner| {
                let set = corner.set.index();
                if kept.len() <= set {
                    kept.resize(set + 1, None);
                }
                // Starts, ends and changes of state are never dropped.
                let stays = corner.last
                    || kept[set].is_none_or(|before| {
                        before.last
                            || before.state != corner.state
                            || before.at + spacing <= corner.at
                    });
                if stays {
                    kept[set] = Some(*corner);
                }
                stays
            });
        }
        self.count = self.by_robot.iter().map(Vec::len).sum();
    }
}

#[cfg(test)]
mod tests {
    use proto::telemetry::BehaviorState;
    use scenario::ids::{BehaviorId, RobotId};

    use super::*;

    fn corner(at: u64, state: BehaviorState, last: bool) -> Corner {
        Corner {
            robot: RobotId(0),
            set: BehaviorId(0),
            at: SimTime(at),
            level: at as f64,
            state,
            last,
        }
    }

    #[test]
    fn the_number_of_corners_is_bounded_and_starts_ends_and_states_stay() {
        let mut corners = Corners::with_max(1, SimTime(50), 1000);
        for tick in 0..100_000_u64 {
            let state = match tick {
                40_000..40_003 => BehaviorState::Active,
                _ => BehaviorState::Hibernating,
            };
            corners.add([corner(50 * tick, state, tick == 70_000)]);
            assert!(corners.count <= 1000);
        }
        let kept = corners.of(0);
        assert_eq!(kept.len(), corners.count);
        assert!(kept.windows(2).all(|pair| pair[0].at < pair[1].at));
        let ticks: Vec<u64> = kept.iter().map(|corner| corner.at.0 / 50).collect();
        for tick in [0, 40_000, 40_003, 70_000, 70_001] {
            assert!(ticks.contains(&tick), "{tick}");
        }
        // Elsewhere the corners are about a spacing apart.
        let gap = ticks.windows(2).map(|pair| pair[1] - pair[0]).max();
        assert!(
            gap.is_some_and(|gap| 50 * gap <= 2 * corners.spacing.0),
            "{gap:?}"
        );
        assert_eq!(corners.of(1), []);
    }

    #[test]
    fn corners_that_cannot_be_dropped_do_not_hang() {
        let mut corners = Corners::with_max(1, SimTime(50), 10);
        for tick in 0..100 {
            corners.add([corner(50 * tick, BehaviorState::Active, true)]);
        }
        assert_eq!(corners.of(0).len(), 100);
    }
}
