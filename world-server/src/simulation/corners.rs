//! Corners of the motivation and utility curves, from which a drawing can restore every level.

use proto::telemetry::Motivation;
use proto::tick::Report;
use proto::view::Corner;
use scenario::ids::{Incarnation, RobotId};
use scenario::time::SimTime;

/// The largest difference of two rises that counts as rounding, as a share of the motivation.
const ROUNDING: f64 = 1e-9;

#[derive(Clone)]
pub struct CurveCorners {
    step: SimTime,
    /// The curves by rank; empty before the first report.
    curves: Vec<Curves>,
    found: Vec<Corner>,
}

#[derive(Clone, Default)]
struct Curves {
    incarnation: Incarnation,
    /// The time of the latest step that counted.
    at: SimTime,
    /// Curves in the order of the report.
    sets: Vec<Curve>,
}

#[derive(Clone, Copy)]
struct Curve {
    latest: Motivation,
    /// The rise of the latest step.
    rise: f64,
    /// True if the latest point is in `found`.
    reported: bool,
}

impl CurveCorners {
    pub fn new(robots: usize, step: SimTime) -> Self {
        Self {
            step,
            curves: vec![Curves::default(); robots],
            found: Vec::new(),
        }
    }

    /// Adds a report that counts in the step at `now`, with its levels. Reports come in order.
    pub fn add_report(&mut self, now: SimTime, report: &Report, levels: &[Motivation]) {
        let rank = report.robot.index();
        let curves = &self.curves[rank];
        let goes_on = curves.at + self.step == now
            && curves.incarnation == report.incarnation
            && curves.sets.len() == levels.len();
        if !goes_on {
            self.end(rank);
            self.begin(now, report, levels);
            return;
        }
        let curves = &mut self.curves[rank];
        let before = std::mem::replace(&mut curves.at, now);
        for (curve, &latest) in curves.sets.iter_mut().zip(levels) {
            let previous = curve.latest;
            let rise = latest.motivation - previous.motivation;
            let is_corner = (rise - curve.rise).abs() > ROUNDING * latest.motivation.max(1.0);
            if is_corner && !curve.reported {
                self.found.push(corner(report.robot, before, &previous));
            }
            // A reset and a change of state are visible in the very next view.
            let reported = rise < 0.0 || latest.state != previous.state;
            if reported {
                self.found.push(corner(report.robot, now, &latest));
            }
            *curve = Curve {
                latest,
                rise,
                reported,
            };
        }
    }

    /// Returns the corners since the previous call, when all steps before `now` are finished.
    pub fn take(&mut self, now: SimTime) -> Vec<Corner> {
        for rank in 0..self.curves.len() {
            if self.curves[rank].at + self.step < now {
                self.end(rank);
            }
        }
        std::mem::take(&mut self.found)
    }

    fn begin(&mut self, now: SimTime, report: &Report, levels: &[Motivation]) {
        let sets = levels.iter();
        let points = sets.clone().map(|latest| corner(report.robot, now, latest));
        self.found.extend(points);
        self.curves[report.robot.index()] = Curves {
            incarnation: report.incarnation,
            at: now,
            sets: sets
                .map(|&latest| Curve {
                    latest,
                    rise: 0.0,
                    reported: true,
                })
                .collect(),
        };
    }

    fn end(&mut self, rank: usize) {
        let robot = RobotId(rank as u32);
        let Curves { at, sets, .. } = std::mem::take(&mut self.curves[rank]);
        let ends = sets.iter().map(|curve| Corner {
            last: true,
            ..corner(robot, at, &curve.latest)
        });
        self.found.extend(ends);
    }
}

/// Creates a corner of a curve that continues.
fn corner(robot: RobotId, at: SimTime, motivation: &Motivation) -> Corner {
    Corner {
        robot,
        set: motivation.set,
        at,
        level: motivation.motivation,
        state: motivation.state,
        last: false,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use proto::telemetry::BehaviorState;
    use scenario::ids::BehaviorId;

    use super::*;

    const STEP: SimTime = SimTime(50);

    fn levels(levels: &[f64], state: BehaviorState) -> Vec<Motivation> {
        let levels = levels.iter().zip(0..);
        let levels = levels.map(|(&motivation, set)| Motivation {
            set: BehaviorId(set),
            motivation,
            state,
            ..Motivation::default()
        });
        levels.collect()
    }

    /// Interpolates the level at a time from the corners: linear, with a step where the curve falls.
    fn level(corners: &[Corner], at: SimTime) -> Option<f64> {
        let after = corners.iter().position(|corner| corner.at >= at)?;
        let next = &corners[after];
        if next.at == at {
            return Some(next.level);
        }
        let before = corners[..after].last().filter(|before| !before.last)?;
        if next.level < before.level {
            return Some(before.level);
        }
        let share = (at - before.at).as_secs_f64() / (next.at - before.at).as_secs_f64();
        Some(before.level + share * (next.level - before.level))
    }

    proptest! {
        /// Checks that the corners restore every level at any frequency of views, and nothing between incarnations.
        #[test]
        fn corners_reproduce_every_step(
            // Per step: whether it counts, the rate, whether it is a reset, whether a view is taken.
            steps in prop::collection::vec((0..20_u8, 0..3_u8, 0..15_u8, 0..9_u8), 1..300)
        ) {
            let mut curves = CurveCorners::new(1, STEP);
            let mut found = Vec::new();
            let mut logged = Vec::new();
            let (mut now, mut level_now) = (SimTime::ZERO, 0.0_f64);
            for (counts, rate, reset, look) in steps {
                if counts > 0 {
                    level_now = if reset == 0 { 0.0 } else { (level_now + 0.1 * f64::from(rate)).min(4.0) };
                    let state = if level_now >= 4.0 { BehaviorState::Active } else { BehaviorState::Hibernating };
                    curves.add_report(now, &Report::default(), &levels(&[level_now], state));
                    logged.push((now, Some(level_now)));
                } else {
                    logged.push((now, None));
                }
                now = now + STEP;
                if look == 0 {
                    found.extend(curves.take(now));
                }
            }
            // The end of the run ends all curves.
            found.extend(curves.take(now + STEP));
            prop_assert!(found.windows(2).all(|pair| pair[0].at <= pair[1].at));
            for (at, expected) in logged {
                let drawn = level(&found, at);
                match (drawn, expected) {
                    (None, None) => {}
                    (Some(drawn), Some(expected)) => {
                        prop_assert!((drawn - expected).abs() < 1e-6, "{at}: {drawn} for {expected}");
                    }
                    _ => prop_assert!(false, "{at}: {drawn:?} for {expected:?}"),
                }
            }
        }
    }

    #[test]
    fn a_straight_rise_with_a_reset_has_few_corners() {
        let mut curves = CurveCorners::new(1, STEP);
        for tick in 0..1000_u64 {
            let level = 0.1 * (tick % 500) as f64;
            let levels = levels(&[level], BehaviorState::Hibernating);
            curves.add_report(SimTime(50 * tick), &Report::default(), &levels);
        }
        let corners: Vec<(u64, bool)> = curves
            .take(SimTime(50 * 1001))
            .iter()
            .map(|corner| (corner.at.0 / 50, corner.last))
            .collect();
        assert_eq!(
            corners,
            [(0, false), (499, false), (500, false), (999, true)]
        );
    }
}
