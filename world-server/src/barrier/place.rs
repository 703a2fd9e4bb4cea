//! One robot's place in the barrier: who has it, and how far the current tick has come with them.

use alliance_proto::ids::{Incarnation, Tick};
use alliance_proto::log::Input;
use alliance_proto::scenario::Robot;
use alliance_proto::tick::ManifestEntry;

/// State of a robot's place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Presence {
    /// No agent.
    Empty,
    /// An agent was welcomed, but its liveliness token has not appeared.
    Invited,
    /// Takes part from the next tick on; `again` after a silence, else in a new incarnation.
    Entering {
        /// Whether it has been here before in this incarnation.
        again: bool,
    },
    /// Takes part.
    Present,
    /// Did not answer in time; out until it speaks.
    Silent,
}

/// What the barrier keeps of a report that counts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Listing {
    /// The incarnation that it is of: a successor may have the place by now.
    pub incarnation: Incarnation,
    pub broadcasts: u16,
}

/// One robot's place.
#[derive(Clone, Debug)]
pub(super) struct Place {
    pub name: String,
    pub presence: Presence,
    /// Latest incarnation, 0 before the first.
    pub incarnation: Incarnation,
    pub last_counted: Option<Tick>,
    /// Broadcasts that count since its last step.
    pub manifest: Vec<ManifestEntry>,
    /// The tick that it was silent in, and answers when it speaks again.
    pub unanswered: Tick,
    /// Whether the current tick has been sent to it.
    pub asked: bool,
    /// What of its answer to the current tick is to be listed.
    pub answer: Option<Listing>,
    /// Its answer has been listed in the manifests of its teammates.
    pub listed: bool,
    /// Its process died in this tick.
    pub gone: bool,
    /// Its robot is not in the mission.
    pub absent: bool,
    /// The clock starts, or has started, without it: its process ended, or was stopped, before it came.
    pub missed: bool,
    /// The scenario kills it in this tick: its report counts, its broadcasts are not listed.
    pub dies_after_tick: bool,
    /// The scenario has stopped it: it comes back when it is readmitted, whatever it says before.
    pub suspended: bool,
    /// Its latest incarnation was welcomed and given up, but may still come.
    pub late: bool,
}

impl Place {
    /// Whether the current tick waits for it.
    pub fn is_open(&self) -> bool {
        self.presence == Presence::Present && !self.gone && self.answer.is_none()
    }

    /// Nobody is there yet.
    pub fn new(robot: &Robot) -> Self {
        Self {
            name: robot.name.clone(),
            presence: Presence::Empty,
            incarnation: 0,
            last_counted: None,
            manifest: Vec::new(),
            unanswered: 0,
            asked: false,
            answer: None,
            listed: false,
            gone: false,
            absent: robot.absent,
            missed: false,
            dies_after_tick: false,
            suspended: false,
            late: false,
        }
    }

    /// Whether its agent lives and is suspended.
    pub fn is_suspended(&self) -> bool {
        self.suspended && !self.gone && self.presence == Presence::Silent
    }

    /// The tick is over: says whether the agent died in it.
    pub fn end_tick(&mut self) -> bool {
        (self.asked, self.listed, self.dies_after_tick) = (false, false, false);
        let died = std::mem::take(&mut self.gone);
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

    /// Who is about to enter takes part from now on; `moment` is that of the current tick if it has begun.
    pub fn enter(&mut self, scripted: bool, moment: Option<u32>, inputs: &mut Vec<Input>) {
        if let Presence::Entering { again } = self.presence {
            self.presence = Presence::Present;
            self.manifest.clear();
            // What was to be killed before it came was another one.
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

    /// It did not answer that tick: it is out of it, and deaf, until it speaks.
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
