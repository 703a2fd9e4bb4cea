//! The robot's attempts at its bars, so that a bar that cannot be moved does not keep it from the others.

use robot_agent::body::FailedAttempts;
use scenario::time::SimTime;

use super::memory::BarKnowledge;
use crate::push::bus::Stroke;

/// The time of work at a bar without any progress after which the attempt has failed.
const PATIENCE: SimTime = SimTime(60_000);

/// The smallest motion of the robot or of the bar that is progress, m.
const PROGRESS_M: f32 = 0.02;

/// The attempts at all bars, by index in the robot's knowledge. Time at a bar adds up over several tasks and stops
/// while the robot does something else.
#[derive(Clone, Debug)]
pub(super) struct Attempts {
    current: Vec<Attempt>,
    failed: FailedAttempts<usize>,
    step: SimTime,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Attempt {
    idle: SimTime,
    /// The last known stroke at the bar.
    last: Option<Stroke>,
    /// The shortest distance between the robot and its place, m.
    nearest_m: f32,
    /// The farthest position of the bar, m.
    advance_m: f32,
}

const NEW: Attempt = Attempt {
    idle: SimTime::ZERO,
    last: None,
    nearest_m: f32::INFINITY,
    advance_m: f32::NEG_INFINITY,
};

impl Attempts {
    pub fn new(bars: usize, step: SimTime) -> Self {
        Self {
            current: vec![NEW; bars],
            failed: FailedAttempts::default(),
            step,
        }
    }

    /// Records a step of work at a bar, with the distance to the robot's place, m. A stroke, motion of the bar or a
    /// shorter way is progress.
    pub fn work(&mut self, place: usize, known: &BarKnowledge, distance_m: f32, now: SimTime) {
        let attempt = &mut self.current[place];
        let advance_m = known.report.pose.position.x;
        if attempt.last != known.report.last {
            self.failed.succeed(place);
            *attempt = Attempt {
                last: known.report.last,
                ..NEW
            };
        }
        if distance_m <= attempt.nearest_m - PROGRESS_M
            || advance_m >= attempt.advance_m + PROGRESS_M
        {
            attempt.idle = SimTime::ZERO;
            attempt.nearest_m = attempt.nearest_m.min(distance_m);
            attempt.advance_m = attempt.advance_m.max(advance_m);
        } else {
            attempt.idle = attempt.idle + self.step;
        }
        if attempt.idle >= PATIENCE {
            *attempt = Attempt {
                last: attempt.last,
                ..NEW
            };
            self.failed.fail(place, now);
        }
    }

    /// Returns whether the robot leaves a bar out for now. It does so only while there is another bar to push.
    pub fn leaves_out(&self, place: usize, known: &[BarKnowledge], now: SimTime) -> bool {
        let is_open = |(place, known): (usize, &BarKnowledge)| {
            !known.has_arrived && !self.failed.is_suspended(place, now)
        };
        self.failed.is_suspended(place, now) && known.iter().enumerate().any(is_open)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;
    use proto::readings::Pose;

    use super::*;
    use crate::push::bar::BarEnd;

    const STEP: SimTime = SimTime(50);

    fn bars() -> Vec<BarKnowledge> {
        let pose = Pose {
            position: Vec2::new(2.0, 4.0),
            heading_rad: 0.0,
        };
        (0..2).map(|bar| BarKnowledge::new(bar, pose)).collect()
    }

    /// Works at the first bar until the robot leaves it out. Returns the time, s.
    fn work(
        attempts: &mut Attempts,
        bars: &mut [BarKnowledge],
        mut step: impl FnMut(u64, &mut BarKnowledge) -> f32,
    ) -> Option<u64> {
        (0..10_000).find(|tick| {
            let now = SimTime(tick * STEP.0);
            let way_m = step(*tick, &mut bars[0]);
            attempts.work(0, &bars[0], way_m, now);
            attempts.leaves_out(0, bars, now)
        })
    }

    #[test]
    fn a_bar_without_progress_is_left_out_for_another_one() {
        let (mut bars, mut attempts) = (bars(), Attempts::new(2, STEP));
        let failed = work(&mut attempts, &mut bars, |_, _| 1.0).unwrap();
        assert_eq!(failed, 1200, "60 s after the first step");
        let at = |s: u64| SimTime(1000 * (60 + s));
        assert!(attempts.leaves_out(0, &bars, at(29)));
        assert!(!attempts.leaves_out(0, &bars, at(30)));
        assert!(!attempts.leaves_out(1, &bars, at(0)));
        assert!(
            !attempts.leaves_out(0, &bars[..1], at(0)),
            "there is nothing else to do"
        );
    }

    #[test]
    fn a_stroke_motion_of_the_bar_or_a_shorter_way_is_progress() {
        let stroke = |tick: u64, bar: &mut BarKnowledge| {
            let end = BarEnd::BOTH[(tick / 1000 % 2) as usize];
            let at = SimTime(tick / 1000 * 50_000);
            bar.add_stroke(Stroke { end, at });
            1.0
        };
        let advance = |tick: u64, bar: &mut BarKnowledge| {
            bar.report.pose.position.x = 2.0 + tick as f32 * 1e-3;
            1.0
        };
        let approach = |tick: u64, _: &mut BarKnowledge| 1000.0 - tick as f32 * 0.01;
        let steps: [fn(u64, &mut BarKnowledge) -> f32; 3] = [stroke, advance, approach];
        for step in steps {
            assert_eq!(work(&mut Attempts::new(2, STEP), &mut bars(), step), None);
        }
    }
}
