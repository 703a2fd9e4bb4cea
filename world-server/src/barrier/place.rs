//! One robot's place in the barrier: its agent and the agent's progress in the current tick.

use proto::tick::{ManifestEntry, Report, TickMessage};
use run_log::Input;
use scenario::Robot;
use scenario::ids::{Incarnation, Tick};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Presence {
    Empty,
    /// An agent was welcomed, but its liveliness token has not appeared.
    Invited,
    Entering {
        /// `true` after a silence, `false` for a new incarnation.
        again: bool,
    },
    Present,
    /// The agent did not answer in time. It is out until it reports again.
    Silent,
}

/// The part of a counted report that manifests need.
#[derive(Clone, Copy, Debug)]
pub(super) struct CountedAnswer {
    /// The reporting incarnation, which may differ from the present one of the place.
    pub incarnation: Incarnation,
    pub broadcasts: u16,
}

#[derive(Clone, Debug)]
pub(crate) struct RobotSlot {
    pub name: String,
    pub presence: Presence,
    /// The latest incarnation; 0 before the first.
    pub incarnation: Incarnation,
    pub last_counted: Option<Tick>,
    /// Counted broadcasts since the robot's last step.
    pub manifest: Vec<ManifestEntry>,
    /// The tick that the agent did not answer. A later answer to it ends the silence.
    pub unanswered: Tick,
    /// `true` if the current tick has been sent to the agent.
    pub tick_sent: bool,
    pub(super) answer: Option<CountedAnswer>,
    /// `true` if the answer has been listed in the teammates' manifests.
    pub listed: bool,
    pub lost: bool,
    pub absent: bool,
    /// `true` if the clock starts without this robot, because its process ended or was stopped before it arrived.
    pub start_without: bool,
    /// `true` if the scenario kills the agent in this tick: its report counts, its broadcasts are not listed.
    pub dies_after_tick: bool,
    /// `true` if the scenario has suspended the agent. Its reports do not end this; only readmission does.
    pub suspended: bool,
    /// `true` if the latest incarnation was welcomed and given up, but may still arrive.
    pub may_still_arrive: bool,
}

impl RobotSlot {
    pub fn is_open(&self) -> bool {
        self.presence == Presence::Present && !self.lost && self.answer.is_none()
    }

    pub fn new(robot: &Robot) -> Self {
        Self {
            name: robot.name.clone(),
            presence: Presence::Empty,
            incarnation: 0,
            last_counted: None,
            manifest: Vec::new(),
            unanswered: 0,
            tick_sent: false,
            answer: None,
            listed: false,
            lost: false,
            absent: robot.absent,
            start_without: false,
            dies_after_tick: false,
            suspended: false,
            may_still_arrive: false,
        }
    }

    /// Writes incarnation, tick, last counted tick and manifest to a message. `sort_manifest` must follow.
    #[inline]
    pub fn address(&mut self, tick: Tick, message: &mut TickMessage) {
        message.incarnation = self.incarnation;
        message.tick = tick;
        message.last_counted = self.last_counted;
        // Both are empty in most ticks.
        if !(self.manifest.is_empty() && message.manifest.is_empty()) {
            std::mem::swap(&mut self.manifest, &mut message.manifest);
            self.manifest.clear();
        }
    }

    /// Counts a report of the current tick.
    #[inline]
    pub fn count(&mut self, report: &Report) {
        self.answer = Some(CountedAnswer {
            incarnation: report.incarnation,
            broadcasts: report.broadcasts,
        });
    }

    pub fn is_suspended(&self) -> bool {
        self.suspended && !self.lost && self.presence == Presence::Silent
    }

    /// Ends the tick. Returns `true` if the agent died in it.
    pub fn end_tick(&mut self) -> bool {
        (self.tick_sent, self.listed, self.dies_after_tick) = (false, false, false);
        let died = std::mem::take(&mut self.lost);
        if died {
            let succeeded = matches!(
                self.presence,
                Presence::Invited | Presence::Entering { again: false }
            );
            if !succeeded {
                self.presence = Presence::Empty;
            }
            self.manifest.clear();
        }
        died
    }

    /// Lets an entering agent take part from now on. `moment` is the order index within the tick; `None` at its beginning.
    pub fn enter(&mut self, scripted: bool, moment: Option<u32>, inputs: &mut Vec<Input>) {
        if let Presence::Entering { again } = self.presence {
            self.presence = Presence::Present;
            self.manifest.clear();
            // A pending kill was meant for an earlier incarnation.
            self.dies_after_tick &= again;
            let robot = self.name.clone();
            inputs.push(if again {
                Input::StallEnd {
                    robot,
                    moment,
                    scripted,
                }
            } else {
                Input::Join {
                    robot,
                    incarnation: self.incarnation,
                    moment,
                    scripted,
                }
            });
        }
    }

    /// Marks the agent as silent since `tick`. It receives nothing until it reports again.
    pub fn fall_silent(&mut self, tick: Tick, scripted: bool, inputs: &mut Vec<Input>) {
        self.presence = Presence::Silent;
        self.unanswered = tick;
        self.manifest.clear();
        inputs.push(Input::StallBegin {
            robot: self.name.clone(),
            scripted,
        });
    }
}
