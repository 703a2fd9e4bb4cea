//! report-progress: go to the report site and report (thesis §4.1.2.3).

use alliance_proto::time::SimTime;
use glam::Vec2;

use super::map::Places;
use super::memory::SET_ASIDE;
use robot_agent::body::Goal;
use robot_agent::body::goal::length;

/// How far inside the site's edge the robot aims, m; half of the site where that is less.
const INSIDE_M: f32 = 0.1;
/// How exactly it has to get there, m.
const WITHIN_M: f32 = 0.05;

/// So many closed ways to the site, without getting there in between, and the robot leaves reporting alone for a while: both
/// ways round, twice.
const CLOSED_MOST: u32 = 4;

/// What reporting wants next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Errand {
    /// Go there.
    Go(Goal),
    /// Report here.
    Report,
    /// The locations are wrong: this is not the site.
    Wrong,
}

/// How the robot got on with its ways to the site. It tells nobody: it may be shut in itself, or be the only one that believes
/// the site to be there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Ways {
    /// Ways that proved to be closed, in a row.
    closed: u32,
    set_aside: Option<SimTime>,
}

impl Ways {
    /// A way proved to be closed.
    pub fn close(&mut self, now: SimTime) {
        self.closed += 1;
        if self.closed >= CLOSED_MOST {
            *self = Self {
                closed: 0,
                set_aside: Some(now),
            };
        }
    }

    /// Whether the robot leaves reporting alone, so that its other tasks have their turn.
    pub fn are_set_aside(&self, now: SimTime) -> bool {
        self.set_aside
            .is_some_and(|since| now.since(since) < SET_ASIDE)
    }
}

/// One step of reporting, from `position`; `on_site` is what the site sensor says. The robot cannot get nearer to the
/// border than `radius_m`.
pub(super) fn errand(
    places: &Places,
    position: Vec2,
    on_site: Option<bool>,
    radius_m: f32,
) -> Errand {
    if on_site == Some(true) {
        return Errand::Report;
    }
    let (min, max) = places.site();
    let size = max - min;
    let edge = (size / 2.0).min(Vec2::splat(INSIDE_M));
    let (low, high) = (min + edge, max - edge);
    let low = low.max(min + Vec2::splat(radius_m + WITHIN_M)).min(high);
    let at = position.clamp(low, high);
    if length(at - position) > WITHIN_M {
        return Errand::Go(Goal::Place {
            at,
            within: WITHIN_M,
        });
    }
    match on_site {
        Some(_) => Errand::Wrong,
        None => Errand::Report,
    }
}
