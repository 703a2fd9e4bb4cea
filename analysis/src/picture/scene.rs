//! The contents of one picture.

use glam::Vec2;
use proto::telemetry::Delivery;
use proto::view::{MessageView, View};
use scenario::ids::RobotId;

/// The room at one time, with the paths and the messages of the time before.
#[derive(Clone, Debug)]
pub struct Scene {
    pub view: View,
    /// The positions of each robot before the time of the view, by rank, oldest first.
    pub trails: Vec<Vec<Vec2>>,
    /// The transmissions before the time of the view, without repetitions.
    pub transmissions: Vec<Transmission>,
}

/// A message from one robot to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Transmission {
    pub sender: RobotId,
    pub receiver: RobotId,
    pub is_lost: bool,
}

impl Transmission {
    /// Returns the transmission of a reception, or `None` while the message is in flight.
    #[must_use]
    pub fn new(message: &MessageView) -> Option<Self> {
        let delivery = message.reception.delivery;
        (delivery != Delivery::Pending).then(|| Self {
            sender: message.reception.sender,
            receiver: message.receiver,
            is_lost: delivery.is_missed(),
        })
    }
}
