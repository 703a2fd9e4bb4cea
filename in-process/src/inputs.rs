//! The external inputs of a logged run, for its repetition.

use std::collections::{BTreeMap, VecDeque};

use proto::process::ProcessAction;
use run_log::{Input, InputLine};
use scenario::ids::{Incarnation, Tick};

#[derive(Clone, Default)]
pub(super) struct LoggedInputs {
    by_tick: BTreeMap<Tick, Vec<Input>>,
    /// The incarnations that process faults start, by tick and robot. An incarnation that ends before it takes part has a number, too.
    incarnations: BTreeMap<(Tick, String), VecDeque<Incarnation>>,
}

impl LoggedInputs {
    /// Adds inputs of ticks that have not begun.
    pub fn add(&mut self, lines: Vec<InputLine>) {
        for InputLine { tick, input } in lines {
            match input {
                Input::Join {
                    robot,
                    incarnation,
                    scripted: true,
                    ..
                } => {
                    let started = self.incarnations.entry((tick, robot)).or_default();
                    started.push_back(incarnation);
                }
                input if input.is_scripted() => {}
                input => self.by_tick.entry(tick).or_default().push(input),
            }
        }
    }

    /// Returns the inputs that take effect before a tick or have no order index in it.
    pub fn unordered(&self, tick: Tick) -> Vec<Input> {
        if self.by_tick.is_empty() {
            return Vec::new();
        }
        let inputs = self.by_tick.get(&tick).into_iter().flatten();
        let unordered = inputs.filter(|input| input.moment().is_none());
        unordered.cloned().collect()
    }

    /// Removes and returns the inputs of a tick, without those that are admitted before it.
    pub fn take(&mut self, tick: Tick) -> TickInputs {
        // Most runs have no inputs after their start, and an empty map is not searched.
        if self.by_tick.is_empty() {
            return TickInputs::default();
        }
        let inputs = self.by_tick.remove(&tick).map(TickInputs::new);
        inputs.unwrap_or_default()
    }

    /// Returns the next incarnation of the robot that a process fault starts in this tick.
    pub fn next_incarnation(&mut self, tick: Tick, robot: &str) -> Option<Incarnation> {
        let key = (tick, robot.to_owned());
        self.incarnations.get_mut(&key)?.pop_front()
    }
}

fn is_branch(input: &Input) -> bool {
    matches!(input, Input::Branch(_))
}

fn is_body(input: &Input) -> bool {
    matches!(input, Input::Body(_))
}

/// The external inputs of one tick.
#[derive(Default)]
pub(super) struct TickInputs {
    /// The inputs that take effect at an order index, sorted by it.
    pub ordered: VecDeque<Input>,
    /// The inputs that take effect while robots are sent the tick and report.
    unordered: Vec<Input>,
}

impl TickInputs {
    fn new(inputs: Vec<Input>) -> Self {
        let (mut ordered, mut unordered): (Vec<Input>, Vec<Input>) =
            inputs.into_iter().partition(|input| {
                let is_ordered = input.moment().is_some() || input.is_command();
                is_ordered || is_branch(input) || is_body(input)
            });
        unordered.retain(|input| !matches!(input, Input::Join { .. }));
        // A command takes effect at the end of its order index. Commands without one take effect at the first. A branch
        // precedes everything else.
        ordered.sort_by_key(|input| {
            let moment = input.moment().unwrap_or(0);
            (moment, !is_branch(input), input.is_command())
        });
        Self {
            ordered: ordered.into(),
            unordered,
        }
    }

    /// Returns `true` if no input takes effect while robots are sent the tick and report.
    pub fn leave_reports_alone(&self) -> bool {
        self.unordered.is_empty()
    }

    /// Returns the reason for which a process action failed. `number` is the number of earlier actions in the tick.
    pub fn failure_of(&self, name: &str, action: ProcessAction, number: u32) -> Option<&str> {
        self.unordered.iter().find_map(|input| match input {
            Input::Failed {
                robot,
                act,
                number: at,
                reason,
            } if (robot.as_str(), *act) == (name, action) && at.is_none_or(|at| at == number) => {
                Some(reason.as_str())
            }
            _ => None,
        })
    }

    /// Returns the tick in which an incarnation counted last, if it dies while reports are gathered.
    pub fn death_of(&self, name: &str, current: Option<Incarnation>) -> Option<Option<Tick>> {
        self.unordered.iter().find_map(|input| match input {
            Input::Gone {
                robot,
                incarnation,
                last_counted,
                ..
            } if robot == name && current == Some(*incarnation) => Some(*last_counted),
            _ => None,
        })
    }

    /// Returns `true` if the robot does not answer.
    pub fn stall(&self, name: &str) -> bool {
        let mut inputs = self.unordered.iter();
        inputs.any(|input| matches!(input, Input::StallBegin { robot, .. } if robot == name))
    }

    /// Returns `true` if a broadcast of `from` did not arrive at `to`.
    pub fn lose(&self, to: &str, from: &str, tick: Tick, broadcast: u16) -> bool {
        self.unordered.iter().any(|input| match input {
            Input::Lost {
                receiver,
                sender,
                sent_tick,
                index,
            } => receiver == to && sender == from && (*sent_tick, *index) == (tick, broadcast),
            _ => false,
        })
    }
}
