//! Checks of `[observe]` beyond the ranges of its parameters.

use scenario::limits::WIDEST_M;
use scenario::{KeyPath, Problem, Scenario};

use super::ObserveSection;

/// Returns the first error of `[observe]`. Distances and speeds must be in order.
pub(super) fn check(scenario: &Scenario) -> Result<(), Problem> {
    scenario.room.check(WIDEST_M)?;
    let section = ObserveSection::from_scenario(scenario);
    let slowest = ("slowest_m_s", section.slowest_m_s);
    let fastest = ("fastest_m_s", section.fastest_m_s);
    let near = ("target_near_m", section.target_near_m);
    let full = ("target_full_m", section.target_full_m);
    let range = ("range_m", section.range_m);
    let predict = ("predict_m", section.predict_m);
    let robot_near = ("robot_near_m", section.robot_near_m);
    let robot_far = ("robot_far_m", section.robot_far_m);
    for (low, high, may_be_equal) in [
        (slowest, fastest, true),
        (near, full, false),
        (full, range, true),
        (range, predict, true),
        (robot_near, robot_far, false),
    ] {
        if low.1 > high.1 || (low.1 == high.1 && !may_be_equal) {
            let how = if may_be_equal { "above" } else { "not below" };
            let what = format!("{} is {how} {}, {}", low.1, high.0, high.1);
            let remedy = format!("give a lower {} or a higher {}", low.0, high.0);
            return Err(Problem::at(KeyPath::new(["observe", low.0]), what, remedy));
        }
    }
    Ok(())
}
