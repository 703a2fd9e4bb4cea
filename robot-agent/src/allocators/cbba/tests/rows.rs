//! Every row of CBBA's table in every case, against a transcription in another form (ALLOCATORS.md §6).

use alliance_proto::allocation::consensus::Claim;
use alliance_proto::ids::RobotId;
use alliance_proto::time::SimTime;

use crate::allocators::cbba::table::{Action, Stamps, consensus};

/// The robots of the paper: the receiver, the sender, and two others.
const I: RobotId = RobotId(1);
const K: RobotId = RobotId(2);
const M: RobotId = RobotId(3);
const N: RobotId = RobotId(0);

/// What a rule asks: y, that the sender's bid is larger; M and N, that the sender's news of them is newer; m, that it is older of M.
struct Case {
    y: bool,
    newer_m: bool,
    older_m: bool,
    newer_n: bool,
}

type Rule = fn(&Case) -> Action;

/// Says, believes, what happens.
const ROWS: [(Option<RobotId>, Option<RobotId>, Rule); 17] = [
    (Some(K), Some(I), |it| {
        if it.y { Action::Update } else { Action::Leave }
    }),
    (Some(K), Some(K), |_| Action::Update),
    (Some(K), Some(M), |it| {
        if it.newer_m || it.y {
            Action::Update
        } else {
            Action::Leave
        }
    }),
    (Some(K), None, |_| Action::Update),
    (Some(I), Some(I), |_| Action::Leave),
    (Some(I), Some(K), |_| Action::Reset),
    (Some(I), Some(M), |it| {
        if it.newer_m {
            Action::Reset
        } else {
            Action::Leave
        }
    }),
    (Some(I), None, |_| Action::Leave),
    (Some(M), Some(I), |it| {
        if it.newer_m && it.y {
            Action::Update
        } else {
            Action::Leave
        }
    }),
    (Some(M), Some(K), |it| {
        if it.newer_m {
            Action::Update
        } else {
            Action::Reset
        }
    }),
    (Some(M), Some(M), |it| {
        if it.newer_m {
            Action::Update
        } else {
            Action::Leave
        }
    }),
    (Some(M), Some(N), |it| {
        if it.newer_m && (it.newer_n || it.y) {
            Action::Update
        } else if it.newer_n && it.older_m {
            Action::Reset
        } else {
            Action::Leave
        }
    }),
    (Some(M), None, |it| {
        if it.newer_m {
            Action::Update
        } else {
            Action::Leave
        }
    }),
    (None, Some(I), |_| Action::Leave),
    (None, Some(K), |_| Action::Update),
    (None, Some(M), |it| {
        if it.newer_m {
            Action::Update
        } else {
            Action::Leave
        }
    }),
    (None, None, |_| Action::Leave),
];

/// Times of news of M and N; `None` for no news.
struct News {
    mine: [Option<u64>; 2],
    theirs: [Option<u64>; 2],
}

fn of(times: &[Option<u64>; 2], robot: RobotId) -> Option<SimTime> {
    times[usize::from(robot == N)].map(SimTime)
}

impl Stamps for News {
    fn mine(&self, robot: RobotId) -> Option<SimTime> {
        of(&self.mine, robot)
    }
    fn theirs(&self, robot: RobotId) -> Option<SimTime> {
        of(&self.theirs, robot)
    }
}

#[test]
fn every_row_does_what_the_paper_says() {
    let times = [None, Some(1), Some(2)];
    let mut seen = 0;
    for (says, believes, rule) in ROWS {
        for code in 0..81 {
            let [a, b, c, d] = [code % 3, code / 3 % 3, code / 9 % 3, code / 27];
            let news = News {
                mine: [times[a], times[b]],
                theirs: [times[c], times[d]],
            };
            for (theirs, mine) in [(0.5, 0.4), (0.5, 0.5), (0.4, 0.5)] {
                let claim =
                    |robot: Option<RobotId>, value| robot.map(|robot| Claim { robot, value });
                let case = Case {
                    // Of equal bids that of the lower rank is the larger one.
                    y: theirs > mine || (theirs == mine && says < believes),
                    newer_m: c > a,
                    older_m: a > c,
                    newer_n: d > b,
                };
                let done = consensus(I, K, claim(says, theirs), claim(believes, mine), &news);
                let wanted = rule(&case);
                assert_eq!(done, wanted, "{says:?} {believes:?} {theirs} {mine} {code}");
                seen += 1;
            }
        }
    }
    assert_eq!(seen, 17 * 81 * 3);
}
