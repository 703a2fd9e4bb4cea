//! Every row of CBBA's table in every case, against a transcription in another form (ALLOCATORS.md §6), and the rows of ACBBA's.

use alliance_proto::allocation::consensus::Claim;
use alliance_proto::ids::RobotId;
use alliance_proto::time::SimTime;

use crate::allocators::cbba::delta_table::{self, Action as DeltaAction, Dated};
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

/// What happens in each row where the sender's word is older, of the same time, and newer: with a smaller bid, then with a larger one.
#[test]
fn every_row_of_acbba_does_what_its_page_says() {
    use DeltaAction::{Assert, Leave, Reset, Tell, Update};
    let rows = [
        (None, None, [Leave; 3], [Leave; 3]),
        (None, Some(I), [Assert; 3], [Assert; 3]),
        (None, Some(K), [Update; 3], [Update; 3]),
        (None, Some(M), [Tell, Tell, Update], [Tell, Tell, Update]),
        (Some(I), None, [Tell; 3], [Tell; 3]),
        (Some(I), Some(I), [Tell; 3], [Tell; 3]),
        (Some(I), Some(K), [Reset; 3], [Reset; 3]),
        (Some(I), Some(M), [Tell; 3], [Tell; 3]),
        (Some(K), None, [Update; 3], [Update; 3]),
        (Some(K), Some(I), [Assert; 3], [Update; 3]),
        (Some(K), Some(K), [Tell, Tell, Update], [Tell, Tell, Update]),
        (Some(K), Some(M), [Tell; 3], [Update; 3]),
        (
            Some(M),
            None,
            [Tell, Update, Update],
            [Tell, Update, Update],
        ),
        (Some(M), Some(I), [Assert; 3], [Update; 3]),
        (Some(M), Some(K), [Update; 3], [Update; 3]),
        (Some(M), Some(M), [Tell, Tell, Update], [Tell, Tell, Update]),
        (Some(M), Some(N), [Tell; 3], [Update; 3]),
    ];
    for (says, believes, smaller, larger) in rows {
        for (value, wanted) in [(0.4, smaller), (0.6, larger)] {
            for (made, wanted) in [(1, wanted[0]), (2, wanted[1]), (3, wanted[2])] {
                let dated = |robot: Option<RobotId>, value, made| Dated {
                    claim: robot.map(|robot| Claim { robot, value }),
                    made: SimTime(made),
                };
                let (theirs, mine) = (dated(says, value, made), dated(believes, 0.5, 2));
                let done = delta_table::consensus(I, K, theirs, mine);
                assert_eq!(done, wanted, "{says:?} {believes:?} {value} {made}");
            }
        }
    }
    // What is the same on both sides is left.
    for robot in [I, M] {
        let same = Dated {
            claim: Some(Claim { robot, value: 0.5 }),
            made: SimTime(1),
        };
        assert_eq!(delta_table::consensus(I, K, same, same), Leave);
    }
}
