//! Messages in flight: those that a receiver has reported as pending. A message has one row, which is written when its final
//! delivery is known. If its receiver or the run ends before, the row contains "pending".

use std::collections::BTreeMap;
use std::mem;

use proto::telemetry::{Delivery, Reception};
use scenario::ids::{Incarnation, RobotId};

/// The receiver and its incarnation; the sender, its incarnation and the message's sequence number.
type Key = (RobotId, Incarnation, RobotId, Incarnation, u64);

#[derive(Clone, Debug, Default)]
pub(super) struct InFlight(BTreeMap<Key, Reception>);

impl InFlight {
    /// Registers the reception that an incarnation of a robot reports. Returns `true` if its delivery is final.
    pub fn register(
        &mut self,
        receiver: RobotId,
        incarnation: Incarnation,
        reception: &Reception,
    ) -> bool {
        let Some(content) = reception.content else {
            return true;
        };
        let key = (
            receiver,
            incarnation,
            reception.sender,
            reception.incarnation,
            content.seq,
        );
        match reception.delivery {
            Delivery::Pending => {
                self.0.insert(key, *reception);
                return false;
            }
            Delivery::Delayed | Delivery::Damaged | Delivery::Cut => {
                self.0.remove(&key);
            }
            _ => {}
        }
        true
    }

    /// Removes and returns the messages in flight to an incarnation that has ended, by sender and sequence number.
    pub fn take_of_incarnation(
        &mut self,
        receiver: RobotId,
        incarnation: Incarnation,
    ) -> Vec<(RobotId, Reception)> {
        let first = (receiver, incarnation, RobotId(0), 0, 0);
        let mut rest = self.0.split_off(&first);
        let next_incarnation = (receiver, incarnation.saturating_add(1), RobotId(0), 0, 0);
        self.0.append(&mut rest.split_off(&next_incarnation));
        list(rest)
    }

    /// Removes and returns all messages in flight at the end of the run, by receiver, sender and sequence number.
    pub fn take_all(&mut self) -> Vec<(RobotId, Reception)> {
        list(mem::take(&mut self.0))
    }
}

fn list(pending: BTreeMap<Key, Reception>) -> Vec<(RobotId, Reception)> {
    let receptions = pending.into_iter();
    receptions
        .map(|(key, reception)| (key.0, reception))
        .collect()
}
