//! The points of a run: a function of the scenario and the seed.

use alliance_proto::rng::{Purpose, stream};
use alliance_proto::scenario::Scenario;
use alliance_proto::time::SimTime;
use glam::Vec2;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::{Between, Kind, ServiceSection};

/// How much farther than its radius a robot at a drawn point is from the walls, m.
const MARGIN_M: f32 = 0.05;

/// A point as it is before anything happens to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointSpec {
    /// What there is to do, by the place of the kind.
    pub kind: usize,
    /// Where, m.
    pub at: Vec2,
    /// How long it takes a robot of skill 1, s.
    pub work_s: f64,
    /// When it arrives first.
    pub arrives: SimTime,
    /// How long after each arrival it expires.
    pub expires_after: Option<SimTime>,
    /// How long after each arrival it comes back.
    pub comes_back_after: Option<SimTime>,
}

impl PointSpec {
    /// A point of a kind, with what that leaves open drawn.
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
            expires_after: spec
                .deadline_s
                .map(|between| SimTime::from_secs_f64(between.draw(rng))),
            comes_back_after: spec.period_s.map(SimTime::from_secs_f64),
        }
    }
}

impl Between {
    fn draw(&self, rng: &mut ChaCha8Rng) -> f64 {
        self.min + (self.max - self.min) * rng.random::<f64>()
    }
}

/// All points that a run has before faults add any, by number. A drawn place may be inside an obstacle: the world takes the nearest one
/// that is free.
#[must_use]
pub fn points(scenario: &Scenario, seed: u64) -> Vec<PointSpec> {
    let section = ServiceSection::of(scenario);
    let mut rng = stream(seed, Purpose::Mission);
    let mut kinds = section.kind_of_each();
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
    let size = Vec2::new(scenario.room.width_m, scenario.room.height_m);
    let margin = (scenario.body.radius_m + MARGIN_M).min(size.min_element() / 2.0);
    for batch in &section.random {
        let mut at_s = batch.at_s;
        for kind in kinds.by_ref().take(batch.n.into()) {
            let share = Vec2::new(rng.random(), rng.random());
            let at = margin + share * (size - 2.0 * margin);
            if batch.rate_hz > 0.0 {
                // The share is below 1.
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
