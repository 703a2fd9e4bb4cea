//! Local force vectors that attract and repel a robot (docs/missions/observe.md).

use glam::Vec2;

use crate::observe::data::ObserveSection;

/// Returns the force of a target at that distance, m. It is −1 at distance 0, 0 at `target_near_m`, 1 from
/// `target_full_m` to `range_m`, and 0 from `predict_m` on, with straight lines between.
pub(super) fn target_force(section: &ObserveSection, distance_m: f32) -> f32 {
    let between = |from: f32, to: f32| (distance_m - from) / (to - from);
    if distance_m < section.target_near_m {
        between(section.target_near_m, 2.0 * section.target_near_m)
    } else if distance_m < section.target_full_m {
        between(section.target_near_m, section.target_full_m)
    } else if distance_m <= section.range_m {
        1.0
    } else if distance_m < section.predict_m {
        between(section.predict_m, section.range_m)
    } else {
        0.0
    }
}

/// Returns the force of a robot at that distance, m: −1 up to `robot_near_m` and 0 from `robot_far_m` on, with a
/// straight line between.
pub(super) fn robot_force(section: &ObserveSection, distance_m: f32) -> f32 {
    let (near_m, far_m) = (section.robot_near_m, section.robot_far_m);
    -((far_m - distance_m) / (far_m - near_m)).clamp(0.0, 1.0)
}

/// Returns a force of that size along an offset; zero for a zero offset.
pub(super) fn along(offset: Vec2, force: impl FnOnce(f32) -> f32) -> Vec2 {
    let distance_m = offset.length();
    if distance_m > 0.0 {
        offset * (force(distance_m) / distance_m)
    } else {
        Vec2::ZERO
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::parse;

    /// Calculated by hand for the distances 0.4, 0.8, 2.6, 3.0 and 1.25, 2.0 m.
    #[test]
    fn forces_match_the_table() {
        let scenario = parse("[observe]\n");
        let section = ObserveSection::from_scenario(&scenario);
        let near = |found: f32, expected: f32| {
            assert!((found - expected).abs() < 1e-5, "{found} {expected}")
        };
        for (distance_m, force) in [
            (0.0, -1.0),
            (0.1, -0.75),
            (0.4, 0.0),
            (0.6, 0.5),
            (0.8, 1.0),
            (2.6, 1.0),
            (2.7, 0.75),
            (3.0, 0.0),
            (9.0, 0.0),
        ] {
            near(target_force(section, distance_m), force);
        }
        for (distance_m, force) in [
            (0.0, -1.0),
            (1.25, -1.0),
            (1.625, -0.5),
            (2.0, 0.0),
            (9.0, 0.0),
        ] {
            near(robot_force(section, distance_m), force);
        }
        let pulled = along(Vec2::new(-2.0, 0.0), |_| 0.5);
        assert_eq!(pulled, Vec2::new(-0.5, 0.0));
        assert_eq!(along(Vec2::ZERO, |_| 1.0), Vec2::ZERO);
    }
}
