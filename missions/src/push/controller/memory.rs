//! A robot's knowledge of its bars, from its own sensor and from teammates.

use proto::readings::Pose;
use scenario::time::SimTime;

use crate::push::bar::{BarEnd, lead_m};
use crate::push::bus::{BarReport, MAX_REPORTED_BARS, SharedKnowledge, Stroke};
use crate::push::data::PushSection;

/// The largest motion of a bar at rest, m, and the time for which it must stay within.
const STILL_M: f32 = 0.02;
const STILL: SimTime = SimTime(1_000);

/// The interval at which heartbeats switch to further bars, ms, if there are more than fit.
const TURN_MS: u64 = 500;

/// The knowledge about a bar. Messages may arrive in any order, twice or late, so the newest pose and the newest
/// stroke count.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct BarKnowledge {
    pub report: BarReport,
    /// The lead of the left end at the known pose, m.
    lead_m: f32,
    /// True if both ends are over the line.
    pub has_arrived: bool,
    /// The lead of the left end when the last stroke became known, m.
    lead_then_m: f32,
    /// The lead of the left end at the last motion, m, and its time.
    still: (f32, SimTime),
}

impl BarKnowledge {
    pub fn new(bar: u32, pose: Pose) -> Self {
        Self {
            report: BarReport {
                bar,
                pose,
                seen: SimTime::ZERO,
                last: None,
            },
            lead_m: 0.0,
            has_arrived: false,
            lead_then_m: 0.0,
            still: (0.0, SimTime::ZERO),
        }
    }

    pub fn set_pose(&mut self, pose: Pose, section: &PushSection) {
        self.report.pose = pose;
        self.lead_m = lead_m(&pose, section.length_m);
        let goal_m = section.bars[self.report.bar as usize].goal_x_m;
        self.has_arrived = pose.position.x - self.lead_m.abs() / 2.0 >= goal_m;
    }

    pub fn lead_of(&self, end: BarEnd) -> f32 {
        end.sign() * self.lead_m
    }

    pub fn merge(&mut self, report: &BarReport, section: &PushSection) {
        if report.seen > self.report.seen {
            self.report.seen = report.seen;
            self.set_pose(report.pose, section);
        }
        if let Some(stroke) = report.last {
            self.add_stroke(stroke);
        }
    }

    /// Records a stroke. Of two strokes at one time, the one at the right end counts as the later one.
    pub fn add_stroke(&mut self, stroke: Stroke) {
        let order = |stroke: &Stroke| (stroke.at, stroke.end);
        if self
            .report
            .last
            .is_none_or(|last| order(&last) < order(&stroke))
        {
            self.report.last = Some(stroke);
            self.lead_then_m = self.lead_m;
        }
    }

    /// Records a reading of the bar. A bar at rest that has turned by a quarter of a stroke since the last stroke
    /// must have had another one. This detects strokes without messages.
    pub fn add_reading(&mut self, pose: Pose, now: SimTime, section: &PushSection) {
        self.set_pose(pose, section);
        self.report.seen = now;
        if (self.lead_m - self.still.0).abs() > STILL_M {
            self.still = (self.lead_m, now);
        }
        let gained_m = self.lead_m - self.lead_then_m;
        if gained_m.abs() >= section.stroke_m / 4.0 && now.since(self.still.1) >= STILL {
            let end = BarEnd::on_side(gained_m);
            self.add_stroke(Stroke { end, at: now });
        }
    }

    /// Returns whether the end should be pushed. It does not lead by half a stroke, and the last stroke was at the
    /// other end; or it lags by half a stroke, and the bar is at rest.
    pub fn is_due(&self, end: BarEnd, now: SimTime, section: &PushSection) -> bool {
        let (lead_m, half_m) = (self.lead_of(end), section.stroke_m / 2.0);
        let is_next = self.report.last.is_none_or(|last| last.end != end);
        let lags = lead_m <= -half_m && now.since(self.still.1) >= STILL;
        !self.has_arrived && lead_m < half_m && (is_next || lags)
    }
}

/// Returns the shared knowledge for a heartbeat. If there are more bars than fit, heartbeats contain them in turn.
pub(super) fn shared_knowledge(known: &[BarKnowledge], now: SimTime) -> SharedKnowledge {
    let from = if known.len() > MAX_REPORTED_BARS {
        (now.0 / TURN_MS) as usize * MAX_REPORTED_BARS % known.len()
    } else {
        0
    };
    let all = known.iter().cycle().skip(from);
    let selected = all.take(known.len().min(MAX_REPORTED_BARS));
    selected.map(|bar| bar.report).collect()
}
