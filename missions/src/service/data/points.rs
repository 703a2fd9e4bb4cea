//! The points of a run, computed from the scenario and the seed.

use glam::Vec2;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use scenario::Scenario;
use scenario::rng::{Purpose, stream};
use scenario::time::SimTime;
use world_server::world::Places;

use super::{Interval, Kind, ServiceSection, Terms, terms};

/// The distance beyond its radius that a robot at a drawn point keeps from the walls, m.
const MARGIN_M: f32 = 0.05;

/// The number of draws of a place. It suffices unless obstacles fill nearly the entire room.
const MAX_TRIES: usize = 100_000;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointSpec {
    /// The kind of work, as an index into the scenario's kinds.
    pub kind: usize,
    pub at: Vec2,
    pub work_s: f64,
    pub arrives: SimTime,
    /// The time from each arrival to the earliest work.
    pub opens_after: SimTime,
    /// The time from each arrival to expiration.
    pub expires_after: Option<SimTime>,
    /// The time from each arrival to the next one.
    pub comes_back_after: Option<SimTime>,
    /// The reward of the point if it is done in its window.
    pub value: f64,
    /// The place of delivery, m.
    pub deliver_to: Option<Vec2>,
    /// The part of a robot's capacity that the point takes.
    pub demand: f64,
    /// True if the scenario states properties of points, so that the log contains them.
    pub has_terms: bool,
}

impl PointSpec {
    /// Creates a point of a kind, and draws the values that the kind leaves open.
    pub fn drawn(
        kinds: &[Kind],
        kind: usize,
        at: Vec2,
        arrives: SimTime,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let spec = &kinds[kind];
        Self {
            kind,
            at,
            work_s: spec.work_s.draw(rng),
            arrives,
            opens_after: SimTime::ZERO,
            value: Terms::NONE.value,
            deliver_to: None,
            demand: Terms::NONE.demand,
            has_terms: false,
            expires_after: spec
                .deadline_s
                .map(|between| SimTime::from_secs_f64(between.draw(rng))),
            comes_back_after: spec.period_s.map(SimTime::from_secs_f64),
        }
    }
}

impl Interval {
    fn draw(&self, rng: &mut ChaCha8Rng) -> f64 {
        self.min + (self.max - self.min) * rng.random::<f64>()
    }
}

/// Returns a place for a drawn point; `None` if obstacles leave none.
pub(super) fn free_place(scenario: &Scenario, places: &Places) -> Option<Vec2> {
    let room = scenario.room;
    places.any([room.low(), room.high()], |place| places.can_stand(place))
}

/// Returns all initial points of a run, by number. A place at which no robot can stand is drawn again.
#[must_use]
pub fn points(scenario: &Scenario, seed: u64) -> Vec<PointSpec> {
    let section = ServiceSection::of(scenario);
    let mut rng = stream(seed, Purpose::Mission);
    let mut kinds = section.kinds_of_points();
    let mut points = Vec::new();
    for (point, kind) in section.points.iter().zip(&mut kinds) {
        let at = Vec2::new(point.x_m, point.y_m);
        let arrives = SimTime::from_secs_f64(point.arrival_s);
        let drawn = PointSpec::drawn(&section.kinds, kind, at, arrives, &mut rng);
        points.push(PointSpec {
            work_s: point.work_s.unwrap_or(drawn.work_s),
            ..drawn
        });
    }
    for (point, terms) in points.iter_mut().zip(terms(section)) {
        point.opens_after = terms.opens_after;
        point.expires_after = terms.closes_after.or(point.expires_after);
        point.value = terms.value;
        point.deliver_to = terms.deliver_to;
        point.demand = terms.demand;
        point.has_terms = true;
    }
    let places = Places::of(scenario);
    let (low, size) = (scenario.room.low(), scenario.room.size());
    let margin = (scenario.body.radius_m + MARGIN_M).min(size.min_element() / 2.0);
    for batch in &section.random {
        let mut at_s = batch.at_s;
        for kind in kinds.by_ref().take(batch.n as usize) {
            let mut draws = (0..MAX_TRIES).map(|_| {
                let share = Vec2::new(rng.random(), rng.random());
                low + (margin + share * (size - 2.0 * margin))
            });
            let at = draws.find(|at| places.can_stand(*at));
            // The check of the scenario guarantees that a free place exists.
            let at = at
                .or_else(|| free_place(scenario, &places))
                .unwrap_or(scenario.room.middle());
            if batch.rate_hz > 0.0 {
                // The random number is below 1, so the logarithm is finite.
                at_s -= libm::log(1.0 - rng.random::<f64>()) / batch.rate_hz;
            }
            let arrives = SimTime::from_secs_f64(at_s);
            points.push(PointSpec::drawn(
                &section.kinds,
                kind,
                at,
                arrives,
                &mut rng,
            ));
        }
    }
    points
}
