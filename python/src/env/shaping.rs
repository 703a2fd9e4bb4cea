//! Terms that are added to the reward of a step, defined for all missions.

use glam::Vec2;
use proto::view::{MarkOutline, View};
use scenario::Problem;
use scenario::ids::RobotId;
use scenario::limits::check_known;
use world_server::simulation::Simulation;

/// The share of the avoidance range below which a measured distance counts as contact.
const CONTACT_SHARE: f32 = 0.25;

/// The weights of the terms in the reward of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaping {
    /// The weight of the mission's own reward.
    progress: f64,
    /// The weight of the decrease of each agent's distance to the open work that was nearest at the start of the step,
    /// 1/m.
    approach: f64,
    /// The weight of the distance between each agent's positions before and after the step, 1/m.
    travel: f64,
    /// The weight of the time that an agent ends a step closer to something than a quarter of the avoidance range, 1/s.
    contact: f64,
}

impl Default for Shaping {
    fn default() -> Self {
        Self {
            progress: 1.0,
            approach: 0.0,
            travel: 0.0,
            contact: 0.0,
        }
    }
}

/// The positions at the start of a step, by agent: its own and the nearest open work.
#[derive(Default)]
pub struct StepStart(Vec<(Vec2, Option<Vec2>)>);

impl Shaping {
    const TERMS: [&str; 4] = ["progress", "approach", "travel", "contact"];

    /// Reads the weights by term. The weight of `progress` is 1 unless stated, that of the other terms 0.
    ///
    /// # Errors
    /// Names an unknown term or a weight that is not finite.
    pub fn from_weights(weights: &[(String, f64)]) -> Result<Self, Problem> {
        let mut shaping = Self::default();
        for (term, weight) in weights {
            check_known(["shaping"], "there is no term", term, Self::TERMS)?;
            if !weight.is_finite() {
                let what = format!("the weight {weight} of '{term}' is not finite");
                return Err(Problem::at(["shaping"], what, "write a number"));
            }
            match term.as_str() {
                "progress" => shaping.progress = *weight,
                "approach" => shaping.approach = *weight,
                "travel" => shaping.travel = *weight,
                _ => shaping.contact = *weight,
            }
        }
        Ok(shaping)
    }

    /// Returns the positions that the terms need; none if only the mission's own reward counts.
    pub fn begin(&self, simulation: &Simulation, agents: &[RobotId]) -> StepStart {
        if self.approach == 0.0 && self.travel == 0.0 {
            return StepStart::default();
        }
        let work = if self.approach == 0.0 {
            Vec::new()
        } else {
            open_work(simulation)
        };
        let nearest = |from: Vec2| {
            let work = work.iter().copied();
            work.min_by(|a, b| from.distance(*a).total_cmp(&from.distance(*b)))
        };
        let positions = agents.iter().map(|robot| {
            let position = simulation.world().pose(*robot).position;
            (position, nearest(position))
        });
        StepStart(positions.collect())
    }

    /// Returns the reward of a step that took `step_s`, in which the mission's own reward was `progress`.
    pub fn reward(
        &self,
        start: &StepStart,
        simulation: &Simulation,
        agents: &[RobotId],
        step_s: f64,
        progress: f64,
    ) -> f64 {
        let mut reward = self.progress * progress;
        for (robot, (before, nearest)) in agents.iter().zip(&start.0) {
            let after = simulation.world().pose(*robot).position;
            reward += self.travel * f64::from(before.distance(after));
            if let Some(work) = nearest {
                reward += self.approach * f64::from(before.distance(*work) - after.distance(*work));
            }
        }
        if self.contact != 0.0 {
            let range_m = simulation.setup().scenario.sensors.avoidance_range_m;
            let touches = |robot: &&RobotId| {
                let readings = &simulation.message(**robot).readings;
                let proximity = readings.proximity.unwrap_or_default();
                let mut hits = [proximity.ahead, proximity.left, proximity.right]
                    .into_iter()
                    .flatten()
                    .flatten();
                hits.any(|hit| hit.distance_m < CONTACT_SHARE * range_m)
            };
            let count = agents.iter().filter(touches).count();
            reward += self.contact * count as f64 * step_s;
        }
        reward
    }
}

/// Returns the centers of the mission's visible objects with work that is left: points, spills, bars, unobserved targets.
fn open_work(simulation: &Simulation) -> Vec<Vec2> {
    let world = simulation.world();
    let mut view = View::default();
    world.mission().add_to_view(world, &mut view);
    let marks = view.marks.iter();
    let open = marks.filter(|mark| mark.work.as_ref().is_some_and(|work| work.left > 0.0));
    open.map(|mark| match mark.outline {
        MarkOutline::Disc { center, .. } => center,
        MarkOutline::Bar { from, to, .. } | MarkOutline::Line { from, to } => from.midpoint(to),
        MarkOutline::Rectangle { min, max } => min.midpoint(max),
    })
    .collect()
}
