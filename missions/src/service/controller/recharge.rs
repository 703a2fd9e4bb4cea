//! Recharging: a robot with little energy drives to a charger and stays there until its battery is nearly full.

use glam::Vec2;
use proto::readings::{Actuation, Readings};
use scenario::time::SimTime;

use super::ServiceController;

impl ServiceController {
    /// Decides whether the robot charges. A robot that begins selects the nearest charger.
    pub(super) fn update_charging(&mut self, readings: &Readings) {
        let Some(energy_j) = readings
            .energy_j
            .filter(|_| !self.briefing.chargers.is_empty())
        else {
            return;
        };
        let [reserve_j, charged_j] = self.briefing.energy_limits_j;
        if energy_j >= charged_j {
            self.charger = None;
        } else if energy_j <= reserve_j && self.charger.is_none() {
            let place = readings.pose.map(|pose| pose.position);
            let distance_m = |charger: &Vec2| place.map_or(0.0, |place| place.distance(*charger));
            let chargers = self.briefing.chargers.iter().copied();
            self.charger = chargers.min_by(|a, b| distance_m(a).total_cmp(&distance_m(b)));
        }
    }

    /// Computes the movement to a charger. A robot within reach stands still.
    pub(super) fn drive_to_charger(
        &mut self,
        charger: Vec2,
        position: Vec2,
        readings: &Readings,
        now: SimTime,
    ) -> Actuation {
        let (near_m, distance_m) = (self.briefing.reach_m, position.distance(charger));
        if distance_m <= near_m / 2.0 || distance_m <= near_m && self.driver.is_blocked() {
            return Actuation::default();
        }
        self.driver.drive_to(charger, near_m / 2.0, readings, now)
    }
}
