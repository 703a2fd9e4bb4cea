//! Where the curves of motivations and utilities bend: what a picture of them needs, however seldom somebody looks.

use alliance_proto::ids::{Incarnation, RobotId};
use alliance_proto::telemetry::Motivation;
use alliance_proto::tick::Report;
use alliance_proto::time::SimTime;
use alliance_proto::view::Bend;

/// Two steps rise by the same if their rises differ by less than this share of the motivation: rounding is no bend.
const ROUNDING: f64 = 1e-9;

/// Corners that are told at once at most, the latest: a view has to fit into a message.
const MOST: usize = 10_000;

/// The curves of all robots.
pub struct Bends {
    step: SimTime,
    /// By rank; empty: nothing reported yet.
    curves: Vec<Curves>,
    found: Vec<Bend>,
}

/// The curves of one robot.
#[derive(Clone, Default)]
struct Curves {
    incarnation: Incarnation,
    /// Time of the latest step that counted.
    at: SimTime,
    /// In the order of the report.
    sets: Vec<Curve>,
}

#[derive(Clone, Copy)]
struct Curve {
    latest: Motivation,
    /// What the latest step added.
    rise: f64,
    /// Whether the latest point is told.
    told: bool,
}

impl Bends {
    /// No curve yet, of a run with this step.
    pub fn new(robots: usize, step: SimTime) -> Self {
        Self {
            step,
            curves: vec![Curves::default(); robots],
            found: Vec::new(),
        }
    }

    /// Takes in a report that counts in the step of that time, with the levels in it; they come in order.
    pub fn see(&mut self, now: SimTime, report: &Report, levels: &[Motivation]) {
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
            let bent = (rise - curve.rise).abs() > ROUNDING * latest.motivation.max(1.0);
            if bent && !curve.told {
                self.found.push(bend(report.robot, before, &previous));
            }
            // Who looks now shall see a reset and a change of state at once.
            let told = rise < 0.0 || latest.state != previous.state;
            if told {
                self.found.push(bend(report.robot, now, &latest));
            }
            *curve = Curve { latest, rise, told };
        }
    }

    /// What was found since the last time, when all steps up to `now` are finished.
    pub fn take(&mut self, now: SimTime) -> Vec<Bend> {
        for rank in 0..self.curves.len() {
            if self.curves[rank].at + self.step < now {
                self.end(rank);
            }
        }
        let surplus = self.found.len().saturating_sub(MOST);
        self.found.drain(..surplus);
        std::mem::take(&mut self.found)
    }

    fn begin(&mut self, now: SimTime, report: &Report, levels: &[Motivation]) {
        let sets = levels.iter();
        let points = sets.clone().map(|latest| bend(report.robot, now, latest));
        self.found.extend(points);
        self.curves[report.robot.index()] = Curves {
            incarnation: report.incarnation,
            at: now,
            sets: sets
                .map(|&latest| Curve {
                    latest,
                    rise: 0.0,
                    told: true,
                })
                .collect(),
        };
    }

    fn end(&mut self, rank: usize) {
        let robot = RobotId(rank as u16);
        let Curves { at, sets, .. } = std::mem::take(&mut self.curves[rank]);
        let ends = sets.iter().map(|curve| Bend {
            last: true,
            ..bend(robot, at, &curve.latest)
        });
        self.found.extend(ends);
    }
}

/// A point of a curve that goes on.
fn bend(robot: RobotId, at: SimTime, motivation: &Motivation) -> Bend {
    Bend {
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
    use alliance_proto::ids::BehaviorId;
    use alliance_proto::telemetry::BehaviorState;
    use proptest::prelude::*;

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

    /// What the corners say of a moment: straight between two of them, a step where the curve falls.
    fn level(bends: &[Bend], at: SimTime) -> Option<f64> {
        let after = bends.iter().position(|bend| bend.at >= at)?;
        let next = &bends[after];
        if next.at == at {
            return Some(next.level);
        }
        let before = bends[..after].last().filter(|before| !before.last)?;
        if next.level < before.level {
            return Some(before.level);
        }
        let share = (at - before.at).as_secs_f64() / (next.at - before.at).as_secs_f64();
        Some(before.level + share * (next.level - before.level))
    }

    proptest! {
        /// However seldom somebody looks: every level of every step can be read from the corners, and nothing between lives.
        #[test]
        fn corners_tell_every_step(
            // Of each step: whether it counts, the rate, whether it is a reset, whether somebody looks.
            steps in prop::collection::vec((0..20_u8, 0..3_u8, 0..15_u8, 0..9_u8), 1..300)
        ) {
            let mut bends = Bends::new(1, STEP);
            let mut found = Vec::new();
            let mut logged = Vec::new();
            let (mut now, mut level_now) = (SimTime::ZERO, 0.0_f64);
            for (counts, rate, reset, look) in steps {
                if counts > 0 {
                    level_now = if reset == 0 { 0.0 } else { (level_now + 0.1 * f64::from(rate)).min(4.0) };
                    let state = if level_now >= 4.0 { BehaviorState::Active } else { BehaviorState::Hibernating };
                    bends.see(now, &Report::default(), &levels(&[level_now], state));
                    logged.push((now, Some(level_now)));
                } else {
                    logged.push((now, None));
                }
                now = now + STEP;
                if look == 0 {
                    found.extend(bends.take(now));
                }
            }
            // The end of the run is one of all curves.
            found.extend(bends.take(now + STEP));
            prop_assert!(found.windows(2).all(|pair| pair[0].at <= pair[1].at));
            for (at, expected) in logged {
                let told = level(&found, at);
                match (told, expected) {
                    (None, None) => {}
                    (Some(told), Some(expected)) => {
                        prop_assert!((told - expected).abs() < 1e-6, "{at}: {told} for {expected}");
                    }
                    _ => prop_assert!(false, "{at}: {told:?} for {expected:?}"),
                }
            }
        }
    }

    #[test]
    fn a_straight_rise_and_a_reset_are_few_corners() {
        let mut bends = Bends::new(1, STEP);
        for tick in 0..1000_u64 {
            let level = 0.1 * (tick % 500) as f64;
            let levels = levels(&[level], BehaviorState::Hibernating);
            bends.see(SimTime(50 * tick), &Report::default(), &levels);
        }
        let corners: Vec<(u64, bool)> = bends
            .take(SimTime(50 * 1001))
            .iter()
            .map(|bend| (bend.at.0 / 50, bend.last))
            .collect();
        assert_eq!(
            corners,
            [(0, false), (499, false), (500, false), (999, true)]
        );
    }
}
