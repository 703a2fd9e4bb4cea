//! `random`: any applicable task with the same probability, drawn when the robot is free and every `redraw_s`. It reads nothing of
//! what others say, and its draws depend on no message.

use alliance_proto::scenario::{ParameterDefault, ParameterRange, ParameterSpec};
use alliance_proto::telemetry::Reason;
use alliance_proto::time::SimTime;
use rand::RngExt;
use serde::Deserialize;

use crate::allocator::utility::UnderWay;
use crate::allocator::{Allocator, Decision, Input, Me};

/// One robot's choice.
#[derive(Clone, Debug)]
pub struct Random {
    me: Me,
    redraw: SimTime,
    drawn: SimTime,
}

/// `[allocators.random]`.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Time after which a robot draws again, s.
    pub redraw_s: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self { redraw_s: 30.0 }
    }
}

impl Allocator for Random {
    type Config = Config;

    fn parameters() -> Vec<ParameterSpec> {
        vec![ParameterSpec {
            key: "redraw_s",
            unit: "s",
            default: ParameterDefault::Number(Config::default().redraw_s),
            about: "time after which a robot draws again",
            range: ParameterRange::Above(0.0, 1e9),
        }]
    }

    fn new(me: &Me, config: &Config) -> Self {
        Self {
            me: me.clone(),
            redraw: SimTime::from_secs_f64(config.redraw_s),
            drawn: SimTime::ZERO,
        }
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        let applicable = || input.choices.iter().filter(|choice| choice.applicable);
        let goes_on = decision
            .active
            .is_some_and(|active| applicable().any(|choice| choice.behavior == active));
        if !goes_on || input.now.since(self.drawn) >= self.redraw {
            let count = applicable().count();
            decision.active = None;
            if count > 0 {
                let place = input.draws.stream().random_range(0..count);
                decision.active = applicable().nth(place).map(|choice| choice.behavior);
                decision.reason = Some(Reason::Drawn);
                self.drawn = input.now;
            }
        }
        UnderWay::default().log(&self.me, input, decision, |_| None);
    }
}
