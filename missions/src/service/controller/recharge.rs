//! Recharging: a robot with little energy drives to a charger and stays there until its battery is nearly full.

use glam::Vec2;
use proto::readings::{Actuation, Readings};
use robot_agent::body::FailedAttempts;
use scenario::time::SimTime;

use super::{QUEUE_M, QUEUE_TIME, ServiceController};

/// The energy at which a robot drives to a charger, as a multiple of that for the way at top speed. The rest is for
/// turns and obstacles.
const MARGIN: f32 = 1.25;

/// The distance by which a straight line can be longer than a way, m. It covers rounding.
const ROUNDING_M: f32 = 1.0;

/// The charger of a robot, and its attempts to reach chargers.
#[derive(Clone, Debug, Default)]
pub(super) struct Recharge {
    /// The number of the charger to which the robot drives, or at which it charges.
    pub charger: Option<usize>,
    /// The charger that was nearest at the last search. While the energy is more than enough for the way to it, no search
    /// is necessary.
    nearest: Option<usize>,
    /// The time since when the way is blocked near the charger.
    blocked_since: Option<SimTime>,
    failed: FailedAttempts<usize>,
}

impl Recharge {
    /// Records a full battery.
    fn complete(&mut self) {
        if let Some(charger) = self.charger.take() {
            self.failed.succeed(charger);
        }
    }

    /// Records that the way to the charger is blocked. The attempt fails after `queue`, within which a teammate may
    /// leave the charger.
    fn note_blocked(&mut self, charger: usize, queue: SimTime, now: SimTime) {
        let since = *self.blocked_since.get_or_insert(now);
        if now.since(since) >= queue {
            (self.charger, self.blocked_since) = (None, None);
            self.failed.fail(charger, now);
        }
    }
}

impl ServiceController {
    /// Decides whether the robot charges. A robot begins if its energy is at the reserve, or just enough for the way to
    /// the nearest charger.
    pub(super) fn update_charging(&mut self, readings: &Readings, now: SimTime) {
        let Some(energy_j) = readings.energy_j else {
            return;
        };
        let [reserve_j, charged_j] = self.briefing.energy_limits_j;
        if energy_j >= charged_j {
            self.recharge.complete();
        } else if self.recharge.charger.is_none() {
            let place = readings.pose.map(|pose| pose.position);
            let known = self.recharge.nearest;
            let known = known.and_then(|charger| self.way_to_charger(charger, place, now));
            let is_more_than_enough = |(_, way_m): (usize, f32)| energy_j > self.limit_j(way_m);
            if energy_j > reserve_j && known.is_some_and(is_more_than_enough) {
                return;
            }
            let nearest = self.nearest_charger(known, place, now);
            let is_due = |(_, way_m): &(usize, f32)| {
                let needed_j = self.needed_j(*way_m);
                // A robot with less energy cannot reach the charger, and continues to work.
                energy_j <= reserve_j || (needed_j..=self.limit_j(*way_m)).contains(&energy_j)
            };
            let charger = nearest.filter(is_due).map(|(charger, _)| charger);
            self.recharge.charger = charger;
            self.recharge.nearest = nearest.map(|(charger, _)| charger);
        }
    }

    /// Returns a charger with the length of the way to it, m. `None` if it is suspended or no way leads there.
    fn way_to_charger(
        &self,
        charger: usize,
        from: Option<Vec2>,
        now: SimTime,
    ) -> Option<(usize, f32)> {
        if self.recharge.failed.is_suspended(charger, now) {
            return None;
        }
        let way_m = |from| self.briefing.way_to_charger_m(from, charger);
        let way_m = from.map_or(Some(0.0), way_m)?;
        Some((charger, way_m))
    }

    /// Returns the nearest charger with the length of the way to it, m. A charger that is `known` shortens the search.
    fn nearest_charger(
        &self,
        known: Option<(usize, f32)>,
        from: Option<Vec2>,
        now: SimTime,
    ) -> Option<(usize, f32)> {
        let mut nearest: Option<(usize, f32)> = None;
        let mut most_m = known.map_or(f32::INFINITY, |(_, way_m)| way_m);
        for (number, charger) in self.briefing.chargers.iter().enumerate() {
            let line_m = from.map_or(0.0, |from| from.distance(charger.place()));
            if line_m > most_m + ROUNDING_M {
                continue;
            }
            let way = self.way_to_charger(number, from, now);
            if let Some((_, way_m)) = way
                && nearest.is_none_or(|(_, least_m)| way_m < least_m)
            {
                (nearest, most_m) = (way, most_m.min(way_m));
            }
        }
        nearest
    }

    /// Returns the energy for a way at top speed, J.
    fn needed_j(&self, way_m: f32) -> f32 {
        let drive_s = self.driver.seconds(Vec2::ZERO, Vec2::new(way_m, 0.0));
        (drive_s * self.briefing.drive_w) as f32
    }

    /// Returns the energy at which a robot with this way to a charger drives there, J.
    fn limit_j(&self, way_m: f32) -> f32 {
        MARGIN * self.needed_j(way_m)
    }

    /// Computes the movement to a charger. A robot within reach stands still.
    pub(super) fn drive_to_charger(
        &mut self,
        charger: usize,
        position: Vec2,
        readings: &Readings,
        now: SimTime,
    ) -> Actuation {
        let place = self.briefing.chargers[charger].place();
        let (near_m, distance_m) = (self.briefing.reach_m, position.distance(place));
        if distance_m <= near_m / 2.0 || distance_m <= near_m && self.driver.is_blocked() {
            self.recharge.blocked_since = None;
            return Actuation::default();
        }
        let actuation = self.driver.drive_to(place, near_m / 2.0, readings, now);
        if self.driver.is_blocked() && distance_m > near_m {
            let queue = if distance_m <= near_m + QUEUE_M {
                QUEUE_TIME + self.briefing.full_charge(charger)
            } else {
                SimTime::ZERO
            };
            self.recharge.note_blocked(charger, queue, now);
        }
        actuation
    }
}
