//! The state of the records is independent of the order and number of the reports.

use proptest::prelude::*;
use proto::allocation::consensus::WinningBid;
use scenario::ids::RobotId;
use scenario::time::SimTime;

use crate::allocators::cbba::records::Records;

fn report() -> impl Strategy<Value = (WinningBid, SimTime)> {
    (0..4_u32, 0..3_u8, 0..4_u64).prop_map(|(robot, value, made)| {
        let claim = WinningBid {
            robot: RobotId(robot),
            value: f32::from(value),
        };
        (claim, SimTime(made))
    })
}

fn records_after(reports: &[(WinningBid, SimTime)]) -> Records {
    let mut records = Records::default();
    for &(claim, made) in reports {
        records.receive(claim, made);
    }
    for record in records.iter_mut() {
        record.is_unsaid = false;
    }
    records
}

proptest! {
    #[test]
    fn neither_order_nor_repetition_counts(
        reports in prop::collection::vec(report(), 0..20),
        more in prop::collection::vec(any::<prop::sample::Index>(), 0..20),
        by in any::<u64>(),
    ) {
        let mut again = reports.clone();
        again.extend(more.iter().filter_map(|at| reports.get(at.index(reports.len().max(1)))));
        again.sort_by_key(|(claim, made)| {
            (u64::from(claim.robot.0) * 7 + made.0 * 5 + u64::from(claim.value as u8) * 3).wrapping_mul(by | 1)
        });
        prop_assert_eq!(records_after(&reports), records_after(&again));
    }

    /// A withdrawn bid never counts again, from any sender. A newer record is marked for sending.
    #[test]
    fn withdrawn_bids_stay_withdrawn(reports in prop::collection::vec(report(), 0..20), robot in 0..4_u32) {
        let robot = RobotId(robot);
        let mut records = records_after(&reports);
        records.receive(WinningBid { robot, value: 0.0 }, SimTime(10));
        for &(claim, made) in reports.iter().filter(|(claim, _)| claim.robot == robot) {
            for record in records.iter_mut() {
                record.is_unsaid = false;
            }
            prop_assert!(!records.receive(claim, made));
            prop_assert!(records.record_of(robot).unwrap().is_unsaid);
        }
        let best = records.best_except(RobotId(9));
        prop_assert!(best.is_none_or(|best| best.robot != robot));
    }

    /// The largest bid holds the place, and ties go to the lower rank; the robot's own bid is excluded.
    #[test]
    fn the_largest_bid_holds_the_place(reports in prop::collection::vec(report(), 0..20), me in 0..4_u32) {
        let mut last = std::collections::BTreeMap::new();
        for (claim, made) in &reports {
            let newest = last.entry(claim.robot).or_insert((*made, claim.value));
            if (*made, claim.value) > *newest {
                *newest = (*made, claim.value);
            }
        }
        let bids = last.into_iter().filter(|(robot, (_, value))| robot.0 != me && *value > 0.0);
        let expected = bids.rev().max_by(|a, b| a.1.1.total_cmp(&b.1.1)).map(|(robot, _)| robot);
        let best = records_after(&reports).best_except(RobotId(me));
        prop_assert_eq!(best.map(|claim| claim.robot), expected);
    }
}
