//! The task allocation algorithms, one folder or file each. They implement [`crate::allocator`] and do not depend on a
//! mission. A new one is added here: its module and its entry in the list.
//!
//! Some modules are shared: `claims` (the claims of teammates, for [`first_come`] and [`learned`]), `offers` (the tasks
//! that a robot offers, for [`ble`] and [`dhba`]), and `consensus` (the agreement on winners of [`cbba`], [`hipc`] and
//! [`pi`]).

pub mod alliance;
pub mod ble;
pub mod cbba;
mod claims;
mod consensus;
pub mod dhba;
pub mod first_come;
pub mod grape;
pub mod hipc;
pub mod lalliance;
pub mod learned;
#[cfg(test)]
mod links;
pub mod murdoch;
pub mod nearest;
mod offers;
pub mod oracle;
pub mod pi;
pub mod random;
pub mod ssi;
pub mod static_assignment;
#[cfg(test)]
mod team;
pub mod threshold;

use crate::allocator::AllocatorKind;

/// Returns the allocators of every program, in the order of lists and messages.
pub(crate) fn built_in() -> Vec<AllocatorKind> {
    vec![
        alliance::kind(),
        lalliance::kind(),
        AllocatorKind::new::<nearest::Nearest>(
            "nearest",
            "the applicable task of the highest utility, regardless of teammates",
        ),
        AllocatorKind::new::<nearest::NearestSilent>(
            "nearest-silent",
            "like nearest, with the radio off: no messages, not even shared knowledge of the mission",
        ),
        AllocatorKind::new::<first_come::FirstCome>(
            "first-come",
            "the best task that no teammate reports to execute; kept until one unit is done",
        ),
        AllocatorKind::new::<random::Random>(
            "random",
            "a random applicable task, drawn again at intervals",
        ),
        AllocatorKind::new::<static_assignment::Fixed>(
            "static",
            "the tasks assigned to the robot before the start",
        ),
        AllocatorKind::new::<oracle::Oracle>(
            "oracle",
            "a reference: the best assignment in each step, from ground truth that robots do not have",
        ),
        AllocatorKind::new::<ble::Ble>(
            "ble",
            "broadcast of local eligibility: in each step every robot computes the best pairs of robots and tasks",
        ),
        AllocatorKind::new::<murdoch::Murdoch>(
            "murdoch",
            "auctions: the best bid of the free robots wins a contract, renewed while the winner answers",
        ),
        AllocatorKind::new::<cbba::Cbaa>(
            "cbaa",
            "bids for one task at a time, with consensus on the winners",
        ),
        AllocatorKind::new::<cbba::Cbba>(
            "cbba",
            "bids for a bundle of tasks, with consensus on the winners",
        ),
        AllocatorKind::new::<cbba::Acbba>("acbba", "like cbba, but sends only changes"),
        AllocatorKind::new::<grape::Grape>(
            "grape",
            "each robot moves to the coalition of the highest utility, until no robot moves",
        ),
        AllocatorKind::new::<threshold::Threshold>(
            "threshold",
            "draws tasks; longer due times and more practice raise the probability",
        ),
        AllocatorKind::new::<ssi::Ssi>(
            "ssi",
            "sequential single-item auctions: the lowest bid by the team objective wins one task, until none is left",
        ),
        AllocatorKind::new::<dhba::Dhba>(
            "dhba",
            "every robot solves the same assignment by the Hungarian method, from rows that the team exchanges",
        ),
        AllocatorKind::new::<pi::Pi>(
            "pi",
            "performance impact: a task moves to the robot whose list it delays least",
        ),
        AllocatorKind::new::<hipc::Hipc>(
            "hipc",
            "like cbba, but a robot leaves tasks to teammates that it predicts to bid more",
        ),
        AllocatorKind::new::<learned::Learned>(
            "learned",
            "the task with the highest score of a trained network, from a file of weights",
        ),
    ]
}
