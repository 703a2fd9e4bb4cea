//! The table of CBBA: what a robot does with what a teammate says of a task (Choi, Brunet, How 2009, Table I).

use alliance_proto::allocation::consensus::Claim;
use alliance_proto::ids::RobotId;
use alliance_proto::time::SimTime;

/// What becomes of a belief.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// It stays as it is.
    Leave,
    /// The sender's takes its place.
    Update,
    /// Nobody is believed to have the task.
    Reset,
}

/// The times of news on both sides: s_i and s_k. `None`: there is none.
pub trait Stamps {
    /// When the latest news of a robot that has reached the receiver was sent.
    fn mine(&self, robot: RobotId) -> Option<SimTime>;
    /// The same of the sender; of itself it is the time of the message.
    fn theirs(&self, robot: RobotId) -> Option<SimTime>;
}

/// What `me` (i) does when `sender` (k) says that `says` holds and it believes `believes`. Of equal bids that of the lower rank counts
/// as the larger one.
pub fn consensus(
    me: RobotId,
    sender: RobotId,
    says: Option<Claim>,
    believes: Option<Claim>,
    stamps: &impl Stamps,
) -> Action {
    let newer = |robot| stamps.theirs(robot) > stamps.mine(robot);
    let update_if = |holds| {
        if holds { Action::Update } else { Action::Leave }
    };
    match (says, believes) {
        (None, None) => Action::Leave,
        (None, Some(i)) if i.robot == me => Action::Leave,
        (None, Some(i)) if i.robot == sender => Action::Update,
        (None, Some(i)) => update_if(newer(i.robot)),

        (Some(k), None) if k.robot == me => Action::Leave,
        (Some(k), Some(i)) if k.robot == me => {
            let is_void = i.robot == sender || (i.robot != me && newer(i.robot));
            if is_void {
                Action::Reset
            } else {
                Action::Leave
            }
        }

        (Some(k), None) if k.robot == sender => Action::Update,
        (Some(k), Some(i)) if k.robot == sender => {
            let gives_way = i.robot == sender || (i.robot != me && newer(i.robot));
            update_if(gives_way || k.beats(&i))
        }

        // From here on the sender speaks of a third robot.
        (Some(k), None) => update_if(newer(k.robot)),
        (Some(k), Some(i)) if i.robot == me => update_if(newer(k.robot) && k.beats(&i)),
        (Some(k), Some(i)) if i.robot == sender => {
            if newer(k.robot) {
                Action::Update
            } else {
                Action::Reset
            }
        }
        (Some(k), Some(i)) if i.robot == k.robot => update_if(newer(k.robot)),
        (Some(k), Some(i)) => {
            let (of_theirs, of_mine) = (newer(k.robot), newer(i.robot));
            let is_known_better = stamps.mine(k.robot) > stamps.theirs(k.robot);
            if of_theirs && (of_mine || k.beats(&i)) {
                Action::Update
            } else if of_mine && is_known_better {
                Action::Reset
            } else {
                Action::Leave
            }
        }
    }
}
