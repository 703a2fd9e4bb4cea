//! Arrival and departure of agents.

use proto::join::Refusal;
use run_log::Input;
use scenario::ids::{Incarnation, RobotId, Tick};

use super::Barrier;
use super::place::{Presence, RobotSlot};

impl Barrier {
    /// Offers a robot to an agent. Returns the robot, its incarnation and the earliest tick that it can take part in.
    ///
    /// # Errors
    /// [`Refusal::UnknownRobot`] and [`Refusal::Taken`].
    pub fn invite(&mut self, name: &str) -> Result<(RobotId, Incarnation, Tick), Refusal> {
        let Some(index) = self.places.iter().position(|place| place.name == name) else {
            return Err(Refusal::UnknownRobot {
                robot: name.to_owned(),
                known: self.places.iter().map(|place| place.name.clone()).collect(),
            });
        };
        // Without participants no tick ends, so a new agent enters the current tick. So does an expected agent.
        let expected = self.expected.contains(&RobotId(index as u32));
        let later = self.started && !self.is_idle() && !expected;
        let first_tick = self.tick + Tick::from(later);
        let place = &mut self.places[index];
        if place.absent {
            return Err(Refusal::Absent {
                robot: name.to_owned(),
            });
        }
        // An agent that died in this tick has left already, though its death is recorded only when the tick ends.
        if place.presence != Presence::Empty && !place.lost {
            return Err(Refusal::Taken {
                robot: name.to_owned(),
                incarnation: place.incarnation,
            });
        }
        place.presence = Presence::Invited;
        place.start_without &= self.started;
        place.may_still_arrive = false;
        place.incarnation += 1;
        place.last_counted = None;
        Ok((RobotId(index as u32), place.incarnation, first_tick))
    }

    /// Registers that the liveliness token of an incarnation has appeared.
    pub fn arrive(&mut self, robot: RobotId, incarnation: Incarnation) {
        let place = &mut self.places[robot.index()];
        let is_due = match place.presence {
            Presence::Invited => true,
            Presence::Empty => place.may_still_arrive,
            _ => false,
        };
        if is_due && place.incarnation == incarnation {
            place.may_still_arrive = false;
            place.presence = Presence::Entering { again: false };
            if self.expected.remove(&robot) {
                place.enter(true, None, &mut self.inputs);
            }
            self.enter_if_idle();
        }
    }

    /// Frees the place of an invited agent whose token has not appeared in time. The agent may still arrive later if no other
    /// agent takes the place, because a large team starts slowly on a busy machine.
    pub fn give_up(&mut self, robot: RobotId, incarnation: Incarnation) {
        let place = &mut self.places[robot.index()];
        if place.presence == Presence::Invited && place.incarnation == incarnation {
            place.presence = Presence::Empty;
            place.may_still_arrive = true;
        }
    }

    /// Registers that the liveliness token of an incarnation has disappeared, so its agent is dead. `asked_for` is `true` if the
    /// scenario is killing this agent.
    pub fn agent_lost(&mut self, robot: RobotId, incarnation: Incarnation, asked_for: bool) {
        let place = &mut self.places[robot.index()];
        if place.incarnation != incarnation {
            return;
        }
        match place.presence {
            Presence::Empty => {}
            Presence::Invited | Presence::Entering { again: false } => {
                place.presence = Presence::Empty;
            }
            _ if place.lost => {}
            Presence::Present | Presence::Silent | Presence::Entering { again: true } => {
                place.suspended = false;
                place.manifest.clear();
                let counted_now = place.answer.is_some().then_some(self.tick);
                // An agent that has reported dies in this tick as ordered. One that has not must have died of another cause.
                let owes_report = place.presence == Presence::Present && place.tick_sent;
                let scripted =
                    place.dies_after_tick && (counted_now.is_some() || (asked_for && !owes_report));
                self.external_count += u32::from(self.moment.is_some() && !scripted);
                self.inputs.push(Input::Gone {
                    robot: place.name.clone(),
                    incarnation,
                    last_counted: counted_now.or(place.last_counted),
                    listed: !place.dies_after_tick || counted_now.is_none(),
                    moment: self.moment.filter(|_| !scripted),
                    scripted,
                });
                // The place is free at once for a successor that the scenario starts in the same tick. While reports are gathered in
                // order, `asked` has no meaning here.
                if place.dies_after_tick && !place.tick_sent && self.moment.is_some() {
                    place.dies_after_tick = false;
                    place.presence = Presence::Empty;
                    self.dead.push(robot);
                } else {
                    place.lost = true;
                }
            }
        }
    }

    /// Excludes an agent that did not answer the current tick in time. It is out until it reports again.
    pub fn stall(&mut self, robot: RobotId) {
        if self.is_awaited(robot) {
            let place = &mut self.places[robot.index()];
            place.fall_silent(self.tick, false, &mut self.inputs);
        }
    }

    /// Returns `true` if an agent is joining but has not taken part yet.
    #[must_use]
    pub fn is_joining(&self, robot: RobotId) -> bool {
        let presence = self.places[robot.index()].presence;
        matches!(
            presence,
            Presence::Invited | Presence::Entering { again: false }
        )
    }

    /// Sets the next incarnation of a robot in a replay. The skipped incarnations ended before they took part.
    pub fn skip_to(&mut self, robot: RobotId, incarnation: Incarnation) {
        self.places[robot.index()].incarnation = incarnation - 1;
    }

    /// Admits the logged incarnation of an agent in a replay: from the next tick on, or with `at_once` from the current order
    /// index of this tick on.
    pub fn admit(&mut self, robot: RobotId, incarnation: Incarnation, at_once: bool) {
        let place = &mut self.places[robot.index()];
        let again = place.presence != Presence::Empty && place.incarnation == incarnation;
        if !again {
            place.last_counted = None;
        }
        place.incarnation = incarnation;
        place.presence = Presence::Entering { again };
        if at_once {
            let moment = self.moment;
            place.enter(false, moment, &mut self.inputs);
            self.external_count += 1;
        } else {
            self.enter_if_idle();
        }
    }

    /// Starts the clock without this robot, whose process has ended or is stopped, unless an agent for it arrives before.
    pub fn start_without(&mut self, robot: RobotId) {
        let place = &mut self.places[robot.index()];
        place.start_without |= !self.started && place.presence == Presence::Empty && !place.absent;
    }

    /// Starts the clock if every robot has arrived, except robots to [start without](Self::start_without). At least one robot must
    /// be present. Returns `true` if the clock runs.
    pub fn start_if_all_arrived(&mut self) -> bool {
        if self.started {
            return true;
        }
        let is_here = |place: &RobotSlot| matches!(place.presence, Presence::Entering { .. });
        let is_due = |place: &RobotSlot| !place.absent && !place.start_without && !is_here(place);
        // Robots mostly arrive by rank, so a search from the end finds a missing one soonest.
        if !self.places.iter().rev().any(is_due)
            && (self.places.iter().any(is_here)
                || self.places.iter().all(|place| !place.start_without))
        {
            self.started = true;
            for place in self.places.iter().filter(|place| place.start_without) {
                self.inputs.push(Input::Gone {
                    robot: place.name.clone(),
                    // No incarnation of this robot has taken part.
                    incarnation: 0,
                    last_counted: None,
                    listed: true,
                    moment: None,
                    scripted: false,
                });
            }
            self.enter();
        }
        self.started
    }

    /// Admits arrived agents to the current tick if it has no participants, because such a tick does not end.
    pub(super) fn enter_if_idle(&mut self) {
        if self.started && self.is_idle() {
            self.enter();
        }
    }

    /// Admits arrived agents. Each gets its own order index, except at the beginning of a tick.
    fn enter(&mut self) {
        let order_index = self.moment.filter(|moment| *moment > 0);
        for place in &mut self.places {
            if matches!(place.presence, Presence::Entering { .. }) {
                let moment = order_index.map(|moment| moment + self.external_count);
                place.enter(false, moment, &mut self.inputs);
                self.external_count += u32::from(order_index.is_some());
            }
        }
    }
}
