//! The table of ACBBA: what a robot does with what a teammate says of a task, by the times of bids, and whether it tells others (Johnson,
//! Ponda, Choi, How, AIAA 2010).

use alliance_proto::allocation::consensus::Claim;
use alliance_proto::ids::RobotId;
use alliance_proto::time::SimTime;

/// Who is believed to have a task, and when that came about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dated {
    /// Who, by which bid.
    pub claim: Option<Claim>,
    /// When the bid was made, or the task given up.
    pub made: SimTime,
}

/// What becomes of a belief.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// It stays as it is, and nothing is said.
    Leave,
    /// It stays as it is, and is told: the sender, or somebody else, should know.
    Tell,
    /// The sender's takes its place; it is told if who has the task, or by which bid, is new.
    Update,
    /// Nobody is believed to have the task, which is told.
    Reset,
    /// The robot's own bid was contested: it counts as made now, which is told.
    Assert,
}

/// What `me` (i) does when `sender` (k) says that `says` holds and it believes `believes`. Of equal bids that of the lower rank counts
/// as the larger one.
///
/// The larger bid wins whatever its time; times decide between words about the same winner, and between a claim and that it was given
/// up. Where a larger bid is the older one the paper gives both up: in a team in lockstep, not all of whom hear each other, the same
/// bids then come up again and again.
pub fn consensus(me: RobotId, sender: RobotId, says: Dated, believes: Dated) -> Action {
    let tell_unless = |holds| if holds { Action::Update } else { Action::Tell };
    match (says.claim, believes.claim) {
        (None, None) => Action::Leave,
        (None, Some(i)) if i.robot == me => Action::Assert,
        (None, Some(i)) => tell_unless(i.robot == sender || says.made > believes.made),

        (Some(k), None) if k.robot == me => Action::Tell,
        (Some(k), Some(i)) if k.robot == me => match i.robot {
            robot if robot == sender => Action::Reset,
            _ if says == believes => Action::Leave,
            _ => Action::Tell,
        },

        (Some(k), None) => tell_unless(k.robot == sender || says.made >= believes.made),
        (Some(k), Some(i)) if i.robot == me => {
            if k.beats(&i) {
                Action::Update
            } else {
                Action::Assert
            }
        }
        (Some(k), Some(i)) if i.robot == k.robot => {
            if says.claim == believes.claim && says.made <= believes.made {
                Action::Leave
            } else {
                tell_unless(says.made > believes.made)
            }
        }
        (Some(k), Some(i)) => tell_unless(i.robot == sender || k.beats(&i)),
    }
}
