//! The rows and the vertical scale that all figures of motivations share.

use proto::view::LevelUnit;

use super::RunFigures;
use crate::report::robot_history::SetHistory;

/// The rank of a robot, and one of its behavior sets.
pub(super) type Row<'s> = (usize, &'s SetHistory);

/// Returns the upper end of a robot's curves: the threshold, or the highest utility in the run.
pub(super) fn ceiling(run: &RunFigures<'_>, rank: usize) -> f64 {
    match run.history.robots[rank].measure {
        LevelUnit::Motivation => run.history.setup.alliance.threshold,
        LevelUnit::Utility => run.highest_utility,
    }
}
