//! Recharging: a robot with little energy drives to a charger and stays there until its battery is nearly full.

use glam::Vec2;
use proto::readings::{Actuation, Readings};
use robot_agent::body::FailedAttempts;
use scenario::time::SimTime;

use super::{QUEUE_M, QUEUE_TIME, ServiceController};

/// The energy at which a robot drives to a charger, as a multiple of that for the way at top speed. The rest is for
/// turns and obstacles.
const MARGIN: f32 = 1.25;

/// The charger of a robot, and its attempts to reach chargers.
#[derive(Clone, Debug, Default)]
pub(super) struct Recharge {
    /// The number of the charger to which the robot drives, or at which it charges.
    pub charger: Option<usize>,
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
            self.recharge.charger = self
                .nearest_charger(place, now)
                .filter(|(_, way_m)| energy_j <= reserve_j || self.is_just_enough(energy_j, *way_m))
                .map(|(charger, _)| charger);
        }
    }

    /// Returns the nearest charger that is not suspended and to which a way leads, and the length of the way, m.
    fn nearest_charger(&self, from: Option<Vec2>, now: SimTime) -> Option<(usize, f32)> {
        let chargers = self.briefing.chargers.iter().enumerate();
        let ways = chargers
            .filter(|(number, _)| !self.recharge.failed.is_suspended(*number, now))
            .filter_map(|(number, charger)| {
                let way_m =
                    from.map_or(Some(0.0), |from| self.briefing.way_m(from, charger.place()))?;
                Some((number, way_m))
            });
        ways.min_by(|(_, a), (_, b)| a.total_cmp(b))
    }

    /// Returns whether an energy is enough for a way, but hardly more. A robot with less cannot reach the end, and
    /// continues to work.
    fn is_just_enough(&self, energy_j: f32, way_m: f32) -> bool {
        let drive_s = self.driver.seconds(Vec2::ZERO, Vec2::new(way_m, 0.0));
        let needed_j = (drive_s * self.briefing.drive_w) as f32;
        (needed_j..=MARGIN * needed_j).contains(&energy_j)
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
