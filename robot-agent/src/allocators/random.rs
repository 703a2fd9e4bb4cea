//! The `random` allocator: one applicable task, drawn when the robot is free and every `redraw_s`. The draws do not
//! depend on messages.

use proto::telemetry::Reason;
use rand::RngExt;
use scenario::ParameterRange::Above;
use scenario::ParameterSpec;
use scenario::time::SimTime;

use crate::allocator::utility::WorkInProgress;
use crate::allocator::{Allocator, Decision, Input, SelfState, parameters};

#[derive(Clone, Debug)]
pub struct Random {
    me: SelfState,
    redraw: SimTime,
    drawn: SimTime,
}

parameters! {
    /// The parameters in `[allocators.random]`.
    pub struct Config {
        redraw_s: f64 = 30.0, "s", Above(0.0, 1e9), "time between two draws";
    }
}

impl Allocator for Random {
    type Config = Config;

    fn parameters() -> Vec<ParameterSpec> {
        Config::parameters()
    }

    fn new(me: &SelfState, config: &Config) -> Self {
        Self {
            me: me.clone(),
            redraw: SimTime::from_secs_f64(config.redraw_s),
            drawn: SimTime::ZERO,
        }
    }

    fn adopt(&mut self, config: &Config) -> bool {
        self.redraw = SimTime::from_secs_f64(config.redraw_s);
        true
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        let applicable = || input.choices.iter().filter(|choice| choice.applicable);
        let continues = decision
            .active
            .is_some_and(|active| applicable().any(|choice| choice.behavior == active));
        if !continues || input.now.since(self.drawn) >= self.redraw {
            let count = applicable().count();
            decision.active = None;
            if count > 0 {
                let index = input.draws.stream().random_range(0..count);
                decision.active = applicable().nth(index).map(|choice| choice.behavior);
                decision.reason = Some(Reason::Drawn);
                self.drawn = input.now;
            }
        }
        WorkInProgress::default().log(&self.me, input, decision, |_| None);
    }
}
