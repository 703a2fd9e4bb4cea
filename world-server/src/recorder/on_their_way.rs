//! Messages that a receiver has reported as pending. What became of them is known later, and makes their one row then; of
//! those whose receiver or run ends first, that they were pending is the last word.

use std::collections::BTreeMap;
use std::mem;

use alliance_proto::ids::{Incarnation, RobotId};
use alliance_proto::telemetry::{Delivery, Reception};

/// The receiver and its incarnation; the sender, its incarnation, and the message's number in it.
type Key = (RobotId, Incarnation, RobotId, Incarnation, u64);

/// Pending receptions, with their receivers.
#[derive(Clone, Debug, Default)]
pub(super) struct OnTheirWay(BTreeMap<Key, Reception>);

impl OnTheirWay {
    /// Takes note of what an incarnation of a robot reports; says whether it is the last word about the message.
    pub fn settle(
        &mut self,
        receiver: RobotId,
        incarnation: Incarnation,
        reception: &Reception,
    ) -> bool {
        let Some(said) = reception.said else {
            return true;
        };
        let key = (
            receiver,
            incarnation,
            reception.sender,
            reception.incarnation,
            said.seq,
        );
        match reception.delivery {
            Delivery::Pending => {
                self.0.insert(key, *reception);
                return false;
            }
            Delivery::Delayed | Delivery::Cut => {
                self.0.remove(&key);
            }
            Delivery::Heard | Delivery::Lost | Delivery::Duplicate | Delivery::Dropped => {}
        }
        true
    }

    /// That incarnation of the robot is over: what was on its way to it, by sender and number.
    pub fn end_of(
        &mut self,
        receiver: RobotId,
        incarnation: Incarnation,
    ) -> Vec<(RobotId, Reception)> {
        let first = (receiver, incarnation, RobotId(0), 0, 0);
        let mut rest = self.0.split_off(&first);
        let next_life = (receiver, incarnation.saturating_add(1), RobotId(0), 0, 0);
        self.0.append(&mut rest.split_off(&next_life));
        list(rest)
    }

    /// The run is over: what was on its way, by receiver, sender and number.
    pub fn end(&mut self) -> Vec<(RobotId, Reception)> {
        list(mem::take(&mut self.0))
    }
}

fn list(pending: BTreeMap<Key, Reception>) -> Vec<(RobotId, Reception)> {
    let receptions = pending.into_iter();
    receptions
        .map(|(key, reception)| (key.0, reception))
        .collect()
}
