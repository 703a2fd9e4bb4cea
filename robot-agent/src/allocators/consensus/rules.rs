//! The rules of CBBA for merging a teammate's view of a task (Choi, Brunet, How 2009, Table I).

use proto::allocation::consensus::WinningBid;
use scenario::ids::RobotId;
use scenario::time::SimTime;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Keeps the current claim.
    Leave,
    /// Adopts the sender's claim.
    Update,
    /// Removes the claim, so that the task has no winner.
    Reset,
}

/// The times of news s_i and s_k on both sides; `None` without news.
pub trait Stamps {
    /// Returns the send time of the latest news of a robot that has reached the receiver.
    fn own_news(&self, robot: RobotId) -> Option<SimTime>;
    /// Returns the same time for the sender; for the sender itself it is the time of the message.
    fn sender_news(&self, robot: RobotId) -> Option<SimTime>;
}

/// Returns the action of the receiver `me` (i) on the claim of the `sender` (k), given its own stored claim. Of equal
/// bids the lower rank's counts as larger.
pub fn merge_action(
    me: RobotId,
    sender: RobotId,
    sender_claim: Option<WinningBid>,
    own_claim: Option<WinningBid>,
    stamps: &impl Stamps,
) -> Action {
    let newer = |robot| stamps.sender_news(robot) > stamps.own_news(robot);
    let update_if = |holds| {
        if holds { Action::Update } else { Action::Leave }
    };
    match (sender_claim, own_claim) {
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

        // In the remaining rules the sender's claim is about a third robot.
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
            let is_known_better = stamps.own_news(k.robot) > stamps.sender_news(k.robot);
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
