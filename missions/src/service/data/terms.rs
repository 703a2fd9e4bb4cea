//! The stated properties of points: windows and values. Robots receive them with the scenario.

use glam::Vec2;
use scenario::time::SimTime;

use super::ServiceSection;

/// The window and the value of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms {
    /// The arrival time of the first round.
    pub arrives: SimTime,
    /// The time from an arrival to the next one.
    pub comes_back_after: Option<SimTime>,
    /// The time from an arrival to the earliest work.
    pub opens_after: SimTime,
    /// The stated time from an arrival to expiration.
    pub closes_after: Option<SimTime>,
    /// The reward of the point if it is done in its window.
    pub value: f64,
    /// The place of delivery, m.
    pub deliver_to: Option<Vec2>,
    /// The part of a robot's capacity that the point takes.
    pub demand: f64,
}

impl Terms {
    /// The terms of a point that states none.
    pub const NONE: Self = Self {
        arrives: SimTime::ZERO,
        comes_back_after: None,
        opens_after: SimTime::ZERO,
        closes_after: None,
        value: 1.0,
        deliver_to: None,
        demand: 0.0,
    };

    /// Returns the demand that the robot takes for the rest of the run: that of a point without a delivery.
    #[must_use]
    pub fn kept_demand(&self) -> f64 {
        if self.deliver_to.is_some() {
            0.0
        } else {
            self.demand
        }
    }

    /// Returns the time from which robots can work in a round, and the stated time at which the point expires.
    #[must_use]
    pub fn window(&self, round: u32) -> (SimTime, Option<SimTime>) {
        let period = self.comes_back_after.unwrap_or(SimTime::ZERO);
        let arrives = self.arrives + SimTime(period.0.saturating_mul(round.into()));
        let closes = self.closes_after.map(|after| arrives + after);
        (arrives + self.opens_after, closes)
    }
}

/// Returns the terms of all points at stated places, by number. Empty if no point states a property.
#[must_use]
pub fn terms(section: &ServiceSection) -> Vec<Terms> {
    if !section.has_properties() {
        return Vec::new();
    }
    let points = section.points.iter().zip(section.kinds_of_points());
    let of_point = points.map(|(point, kind)| {
        let time = SimTime::from_secs_f64;
        Terms {
            arrives: time(point.arrival_s),
            comes_back_after: section.kinds[kind].period_s.map(time),
            opens_after: point.opens_s.map_or(SimTime::ZERO, time),
            closes_after: point.deadline_s.map(time),
            value: point.value.unwrap_or(Terms::NONE.value),
            deliver_to: point.deliver_to.map(Vec2::from),
            demand: point.demand.unwrap_or(Terms::NONE.demand),
        }
    });
    of_point.collect()
}
