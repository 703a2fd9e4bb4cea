//! `alliance clock`: controls the step clock of a live run. This does not change the log.

use std::process::ExitCode;

use clap::{Args, Subcommand};
use proto::control::{ClockCommand, ClockStatus, ControlCommand, Reply};
use world_server::pace::Speed;

use crate::control::{ControlArgs, unexpected};

/// Pause, resume, step or change the speed of a live run
#[derive(Args, Clone, Debug)]
#[command(arg_required_else_help = true)]
pub struct ClockArgs {
    #[command(subcommand)]
    action: Action,
    #[command(flatten)]
    control: ControlArgs,
}

#[derive(Subcommand, Clone, Copy, Debug)]
enum Action {
    /// Pause before the next tick
    Pause,
    /// Resume after a pause
    Resume,
    /// Run a number of ticks, then pause
    Step {
        /// Number of ticks to run
        #[arg(value_name = "N", default_value_t = 1, value_parser = steps)]
        ticks: u64,
    },
    /// Set the speed relative to real time
    Speed {
        /// max (as fast as possible), or a factor of real time such as 5x
        #[arg(value_name = "max|FACTORx")]
        speed: Speed,
    },
}

fn steps(text: &str) -> Result<u64, String> {
    let number = text.parse::<u64>().ok().filter(|number| *number > 0);
    number.ok_or_else(|| "use a whole number above 0".to_owned())
}

impl ClockArgs {
    /// Sends the command. Exit status 0, 2 if the world refuses it, 3 if no run is live or none answers.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let command = match self.action {
            Action::Pause => ClockCommand::Pause,
            Action::Resume => ClockCommand::Resume,
            Action::Step { ticks } => ClockCommand::Step(ticks),
            Action::Speed { speed: Speed::Max } => ClockCommand::Speed(None),
            Action::Speed {
                speed: Speed::Factor(factor),
            } => ClockCommand::Speed(Some(factor)),
        };
        let command = ControlCommand::Clock(command);
        self.control
            .send_command("clock", command, |reply| match reply {
                Reply::Clock(clock) => format!("tick {}: {}", clock.tick, describe(clock)),
                other => unexpected(other),
            })
    }
}

/// Returns the state of the clock as text.
pub fn describe(clock: &ClockStatus) -> String {
    let pace = match clock.speed {
        None => "as fast as possible".to_owned(),
        Some(factor) => format!("at {factor}x"),
    };
    let pace = match (clock.steps_left, clock.paused) {
        (0, true) => "paused".to_owned(),
        (0, false) => pace,
        (1, _) => format!("{pace}, 1 step left"),
        (steps, _) => format!("{pace}, {steps} steps left"),
    };
    match &clock.waits_for {
        Some(robots) => format!("stands still: it waits for {robots}"),
        None => pace,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clock_in_words() {
        let clock = |paused, speed, steps_left| {
            describe(&ClockStatus {
                paused,
                speed,
                steps_left,
                tick: 7,
                waits_for: None,
            })
        };
        assert_eq!(clock(true, Some(5.0), 0), "paused");
        assert_eq!(clock(false, Some(0.5), 0), "at 0.5x");
        assert_eq!(clock(true, None, 2), "as fast as possible, 2 steps left");
        assert_eq!(clock(false, Some(5.0), 1), "at 5x, 1 step left");
    }
}
