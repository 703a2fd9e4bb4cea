//! All rows of CBBA's table in all cases, compared with an independent transcription (docs/allocators/cbba.md).

use proto::allocation::consensus::WinningBid;
use scenario::ids::RobotId;
use scenario::time::SimTime;

use super::rules::{Action, Stamps, merge_action};

/// The robots of the paper: the receiver i, the sender k, and two others, m and n.
const I: RobotId = RobotId(1);
const K: RobotId = RobotId(2);
const M: RobotId = RobotId(3);
const N: RobotId = RobotId(0);

/// The conditions of the rules: the sender's bid is larger (y), its news of M or N is newer, or its news of M is older.
struct Case {
    y: bool,
    newer_m: bool,
    older_m: bool,
    newer_n: bool,
}

type Rule = fn(&Case) -> Action;

/// The sender's claim, the receiver's claim, and the action.
const ROWS: [(Option<RobotId>, Option<RobotId>, Rule); 17] = [
    (Some(K), Some(I), |case| {
        if case.y {
            Action::Update
        } else {
            Action::Leave
        }
    }),
    (Some(K), Some(K), |_| Action::Update),
    (Some(K), Some(M), |case| {
        if case.newer_m || case.y {
            Action::Update
        } else {
            Action::Leave
        }
    }),
    (Some(K), None, |_| Action::Update),
    (Some(I), Some(I), |_| Action::Leave),
    (Some(I), Some(K), |_| Action::Reset),
    (Some(I), Some(M), |case| {
        if case.newer_m {
            Action::Reset
        } else {
            Action::Leave
        }
    }),
    (Some(I), None, |_| Action::Leave),
    (Some(M), Some(I), |case| {
        if case.newer_m && case.y {
            Action::Update
        } else {
            Action::Leave
        }
    }),
    (Some(M), Some(K), |case| {
        if case.newer_m {
            Action::Update
        } else {
            Action::Reset
        }
    }),
    (Some(M), Some(M), |case| {
        if case.newer_m {
            Action::Update
        } else {
            Action::Leave
        }
    }),
    (Some(M), Some(N), |case| {
        if case.newer_m && (case.newer_n || case.y) {
            Action::Update
        } else if case.newer_n && case.older_m {
            Action::Reset
        } else {
            Action::Leave
        }
    }),
    (Some(M), None, |case| {
        if case.newer_m {
            Action::Update
        } else {
            Action::Leave
        }
    }),
    (None, Some(I), |_| Action::Leave),
    (None, Some(K), |_| Action::Update),
    (None, Some(M), |case| {
        if case.newer_m {
            Action::Update
        } else {
            Action::Leave
        }
    }),
    (None, None, |_| Action::Leave),
];

/// The times of news of M and N; `None` for no news.
struct News {
    mine: [Option<u64>; 2],
    theirs: [Option<u64>; 2],
}

fn time_of(times: &[Option<u64>; 2], robot: RobotId) -> Option<SimTime> {
    times[usize::from(robot == N)].map(SimTime)
}

impl Stamps for News {
    fn own_news(&self, robot: RobotId) -> Option<SimTime> {
        time_of(&self.mine, robot)
    }
    fn sender_news(&self, robot: RobotId) -> Option<SimTime> {
        time_of(&self.theirs, robot)
    }
}

#[test]
fn every_row_matches_the_paper() {
    let times = [None, Some(1), Some(2)];
    let mut seen = 0;
    for (sender_claim, own_claim, rule) in ROWS {
        for code in 0..81 {
            let [a, b, c, d] = [code % 3, code / 3 % 3, code / 9 % 3, code / 27];
            let news = News {
                mine: [times[a], times[b]],
                theirs: [times[c], times[d]],
            };
            for (theirs, mine) in [(0.5, 0.4), (0.5, 0.5), (0.4, 0.5)] {
                let claim =
                    |robot: Option<RobotId>, value| robot.map(|robot| WinningBid { robot, value });
                let case = Case {
                    // Of equal bids the lower rank's is the larger one.
                    y: theirs > mine || (theirs == mine && sender_claim < own_claim),
                    newer_m: c > a,
                    older_m: a > c,
                    newer_n: d > b,
                };
                let done = merge_action(
                    I,
                    K,
                    claim(sender_claim, theirs),
                    claim(own_claim, mine),
                    &news,
                );
                let expected = rule(&case);
                assert_eq!(
                    done, expected,
                    "{sender_claim:?} {own_claim:?} {theirs} {mine} {code}"
                );
                seen += 1;
            }
        }
    }
    assert_eq!(seen, 17 * 81 * 3);
}
