//! What a robot knows of its bars, whoever has seen it.

use alliance_proto::readings::Pose;
use alliance_proto::time::SimTime;

use crate::push::bar::{End, lead_m};
use crate::push::bus::{Lore, Stroke, TOLD_MOST, Told};
use crate::push::data::PushSection;

/// A bar that moves by no more than this for that long stands still, m.
const STILL_M: f32 = 0.02;
const STILL: SimTime = SimTime(1_000);

/// How often what heartbeats tell of more bars than fit changes, ms.
const TURN_MS: u64 = 500;

/// A bar as far as a robot knows. Facts come in any order, doubled, or late: the newest holds, of where it is and of the last stroke alike.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Known {
    /// As it is told.
    pub told: Told,
    /// How far the left end leads there, m.
    lead_m: f32,
    /// Whether both of its ends are over the line.
    pub has_arrived: bool,
    /// How far the left end led when the last stroke was heard of, m.
    lead_then_m: f32,
    /// How far it led when it moved last, m, and when.
    still: (f32, SimTime),
}

impl Known {
    /// A bar at its start.
    pub fn new(bar: u16, pose: Pose) -> Self {
        Self {
            told: Told {
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

    /// It is there, as far as is known.
    pub fn put(&mut self, pose: Pose, section: &PushSection) {
        self.told.pose = pose;
        self.lead_m = lead_m(&pose, section.length_m);
        let goal_m = section.bars[usize::from(self.told.bar)].goal_x_m;
        self.has_arrived = pose.position.x - self.lead_m.abs() / 2.0 >= goal_m;
    }

    /// How far an end leads the other one, m.
    pub fn lead_of(&self, end: End) -> f32 {
        end.sign() * self.lead_m
    }

    /// Somebody has seen it, or ended a stroke.
    pub fn learn(&mut self, told: &Told, section: &PushSection) {
        if told.seen > self.told.seen {
            self.told.seen = told.seen;
            self.put(told.pose, section);
        }
        if let Some(stroke) = told.last {
            self.stroke(stroke);
        }
    }

    /// A stroke is done. Of two at one time that at the right end is the last.
    pub fn stroke(&mut self, stroke: Stroke) {
        let order = |stroke: &Stroke| (stroke.at, stroke.end);
        if self
            .told
            .last
            .is_none_or(|last| order(&last) < order(&stroke))
        {
            self.told.last = Some(stroke);
            self.lead_then_m = self.lead_m;
        }
    }

    /// The robot sees the bar. One that has turned by a quarter of a stroke since the last stroke, and stands still, has had
    /// another: so a robot goes on that hears nothing.
    pub fn see(&mut self, pose: Pose, now: SimTime, section: &PushSection) {
        self.put(pose, section);
        self.told.seen = now;
        if (self.lead_m - self.still.0).abs() > STILL_M {
            self.still = (self.lead_m, now);
        }
        let gained_m = self.lead_m - self.lead_then_m;
        if gained_m.abs() >= section.stroke_m / 4.0 && now.since(self.still.1) >= STILL {
            let end = End::on_side(gained_m);
            self.stroke(Stroke { end, at: now });
        }
    }

    /// Whether an end is to be pushed: it does not lead by half a stroke, and the last stroke was at the other one; or it lags by half a
    /// stroke, and nobody pushes.
    pub fn is_due(&self, end: End, now: SimTime, section: &PushSection) -> bool {
        let (lead_m, half_m) = (self.lead_of(end), section.stroke_m / 2.0);
        let is_next = self.told.last.is_none_or(|last| last.end != end);
        let lags = lead_m <= -half_m && now.since(self.still.1) >= STILL;
        !self.has_arrived && lead_m < half_m && (is_next || lags)
    }
}

/// What to tell with a heartbeat: of all bars in turn, where they are too many for one.
pub(super) fn lore(known: &[Known], now: SimTime) -> Lore {
    let from = if known.len() > TOLD_MOST {
        (now.0 / TURN_MS) as usize * TOLD_MOST % known.len()
    } else {
        0
    };
    let all = known.iter().cycle().skip(from);
    let some = all.take(known.len().min(TOLD_MOST));
    some.map(|known| known.told).collect()
}
