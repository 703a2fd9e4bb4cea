//! report-progress: go to the report site and report (thesis §4.1.2.3).

use glam::Vec2;
use scenario::time::SimTime;

use super::map::KnownPlaces;
use super::memory::SET_ASIDE;
use robot_agent::body::Goal;
use robot_agent::body::goal::length;

/// The distance from the site's edge at which the robot aims, m. At most half of the site.
const INSIDE_M: f32 = 0.1;
const WITHIN_M: f32 = 0.05;

/// The number of successive blocked ways to the site after which the robot sets reporting aside: both ways round,
/// twice.
const CLOSED_MOST: u32 = 4;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ReportStep {
    Go(Goal),
    Report,
    /// The locations are wrong: the site is not here.
    Wrong,
}

/// The record of blocked ways to the site. Not broadcast: the robot may be shut in, or its locations may be wrong.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct BlockedWays {
    closed: u32,
    set_aside: Option<SimTime>,
}

impl BlockedWays {
    pub fn close(&mut self, now: SimTime) {
        self.closed += 1;
        if self.closed >= CLOSED_MOST {
            *self = Self {
                closed: 0,
                set_aside: Some(now),
            };
        }
    }

    /// Checks whether reporting is set aside, so that other tasks can run.
    pub fn are_set_aside(&self, now: SimTime) -> bool {
        self.set_aside
            .is_some_and(|since| now.since(since) < SET_ASIDE)
    }
}

/// Computes one step of reporting from `position`. `on_site` is the reading of the site sensor. The robot cannot come
/// nearer to the border than `radius_m`.
pub(super) fn errand(
    places: &KnownPlaces,
    position: Vec2,
    on_site: Option<bool>,
    radius_m: f32,
) -> ReportStep {
    if on_site == Some(true) {
        return ReportStep::Report;
    }
    let (min, max) = places.site();
    let size = max - min;
    let edge = (size / 2.0).min(Vec2::splat(INSIDE_M));
    let (low, high) = (min + edge, max - edge);
    let low = low.max(min + Vec2::splat(radius_m + WITHIN_M)).min(high);
    let at = position.clamp(low, high);
    if length(at - position) > WITHIN_M {
        return ReportStep::Go(Goal::Place {
            at,
            within: WITHIN_M,
        });
    }
    match on_site {
        Some(_) => ReportStep::Wrong,
        None => ReportStep::Report,
    }
}
