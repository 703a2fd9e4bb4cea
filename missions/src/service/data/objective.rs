//! The measure by which runs of service are ranked.

use scenario::mission::data::Objective;

use super::{Kind, Point, ServiceSection};

/// Ranks runs by the collected value, because points differ in it.
const VALUE: Objective = Objective::Figure {
    name: VALUE_COLLECTED,
    figure: VALUE_COLLECTED,
    more_is_better: true,
    meaning: "Sum of the values of the points that were done in their windows.",
};

/// The name of the sum of the values of the points that are done, in run.json.
pub const VALUE_COLLECTED: &str = "value_collected";

/// The name of the sum of the values of the points that expired, in run.json.
pub const VALUE_LOST: &str = "value_lost";

/// The name of the number of deadlocks, in run.json.
pub const DEADLOCKS: &str = "deadlocks";

/// Returns the value if points state one, the points that are done if some can expire, and otherwise the time.
pub(super) fn objective(section: &ServiceSection) -> Objective {
    if section.points.iter().any(|point| point.value.is_some()) {
        VALUE
    } else if can_expire(section) {
        Objective::Done
    } else {
        Objective::Time
    }
}

/// Checks whether work can be lost: at a deadline, or at the next arrival of a point that recurs.
fn can_expire(section: &ServiceSection) -> bool {
    let is_limited = |kind: &Kind| kind.deadline_s.is_some() || kind.period_s.is_some();
    let closes = |point: &Point| point.deadline_s.is_some();
    section.kinds.iter().any(is_limited) || section.points.iter().any(closes)
}
