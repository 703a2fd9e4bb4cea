//! The tasks that a robot offers to its team, for rules in which all robots decide from the same utilities: BLE and DHBA.

use proto::allocation::ble::EligibleTask;
use scenario::ids::{BehaviorId, RobotId};
use smallvec::SmallVec;

use crate::allocator::Choice;
use crate::allocator::utility::Bid;

pub type Offers = SmallVec<[Offer; 6]>;

/// The robot's best behavior for a task.
#[derive(Clone, Copy, Debug)]
pub struct Offer {
    pub behavior: BehaviorId,
    pub entry: EligibleTask,
    pub bid: Bid,
}

/// Stores the behavior of the highest utility for each task, the best tasks first, at most `most`. `utility_of` returns
/// the utility of a choice, or `None` if the robot cannot start it.
pub fn weigh(
    offers: &mut Offers,
    robot: RobotId,
    choices: &[Choice],
    most: usize,
    utility_of: impl Fn(&Choice) -> Option<f32>,
) {
    offers.clear();
    for choice in choices {
        let Some(utility) = utility_of(choice) else {
            continue;
        };
        let (task, round) = (choice.task, choice.round);
        let offer = Offer {
            behavior: choice.behavior,
            entry: EligibleTask {
                task,
                round,
                utility,
            },
            bid: Bid {
                priority: choice.priority,
                utility: f64::from(utility),
                robot,
                task,
            },
        };
        match offers.iter_mut().find(|known| known.entry.task == task) {
            Some(known) if offer.bid.utility > known.bid.utility => *known = offer,
            Some(_) => {}
            None => offers.push(offer),
        }
    }
    offers.sort_unstable_by(|one, other| other.bid.order(&one.bid));
    offers.truncate(most);
}
