//! Deaths, new lives, forged words, new rounds, and what is under way.

use std::sync::Arc;

use alliance_proto::allocation::AllocationMessage;
use alliance_proto::allocation::consensus::{Belief, Claim, Delta, Deltas, News, Table};
use alliance_proto::codec::encoded_len;
use alliance_proto::ids::{RobotId, TaskId};
use alliance_proto::team::{Broadcast, Content};
use alliance_proto::telemetry::Reason;
use alliance_proto::time::SimTime;

use super::team::{Team, Work};
use crate::allocators::cbba::{Acbba, BundleConfig, Cbba, DeltaConfig};

const TAU: SimTime = SimTime(5000);

/// So many robots, each of which stands nearest to the task of its own rank, and next to nearest to the following one.
fn spread(robots: usize, tasks: usize) -> Work {
    let away =
        |robot: usize, task: usize| 10.0 + 5.0 * ((tasks * robots + task - robot) % tasks) as f64;
    Work {
        first_s: (0..robots)
            .map(|robot| (0..tasks).map(|task| away(robot, task)).collect())
            .collect(),
        after_s: vec![vec![10.0; tasks]; tasks],
        reward: vec![1.0; tasks],
        priority: vec![0; tasks],
        max_robots: vec![1; tasks],
    }
}

fn single() -> BundleConfig {
    BundleConfig {
        bundle: 1,
        ..BundleConfig::default()
    }
}

fn said_by(sender: u16, seq: u64, sent: SimTime, table: Table) -> Arc<Broadcast> {
    Arc::new(Broadcast {
        sender: RobotId(sender),
        incarnation: 1,
        tick: 0,
        index: 0,
        seq,
        sent,
        body: Content::Allocation(AllocationMessage::Table(table)),
    })
}

fn claims(task: u16, round: SimTime, claim: Option<(u16, f32)>) -> Table {
    Table {
        block: 0,
        slot: 0,
        beliefs: vec![Belief {
            task: TaskId(task),
            round,
            claim: claim.map(|(robot, value)| Claim {
                robot: RobotId(robot),
                value,
            }),
        }],
        news: Vec::new(),
    }
}

/// Of a killed robot the task is taken τ after its last word, to the step, by one that is free.
#[test]
fn the_task_of_the_dead_is_free_after_tau() {
    let mut team = Team::<Cbba>::new(1, spread(3, 2), &single(), TAU);
    while team.tick < 30 {
        team.step();
    }
    assert_eq!(team.active(), [Some(0), Some(1), None]);
    team.dead[1] = true;
    // It spoke at 0 s, at 1 s and with the first consensus.
    let last_word = SimTime(1000 * (team.now().0 / 1000));
    while team.active()[2].is_none() {
        team.step();
        assert!(team.tick < 1000);
    }
    let taken = SimTime(team.now().0 - 50);
    assert!(taken.since(last_word) <= TAU + SimTime(50), "{taken:?}");
    assert!(taken.since(last_word) >= TAU, "{taken:?}");
    assert_eq!(team.members[2].decision.reason, Some(Reason::Claimed));
    assert_eq!(team.active()[0], Some(0));
}

/// What a robot had in the life before is free at the first word of its new life.
#[test]
fn a_new_life_has_nothing() {
    let mut team = Team::<Cbba>::new(1, spread(2, 1), &single(), TAU);
    while team.tick < 10 {
        team.step();
    }
    assert_eq!(team.active(), [Some(0), None]);
    team.members[0] = team.newborn(0, 2, &single(), TAU);
    // It cannot do the task any more, and says so; the task would be kept for it for τ otherwise.
    team.can[0][0] = false;
    team.step();
    team.step();
    assert_eq!(team.active(), [None, Some(0)]);
}

/// C6, and words that no robot would say: nothing of it takes a task from whoever has it.
#[test]
fn empty_and_forged_words_take_nothing() {
    let wild = [
        claims(0, SimTime::ZERO, None),
        claims(0, SimTime::ZERO, Some((1, f32::NAN))),
        claims(0, SimTime::ZERO, Some((1, f32::INFINITY))),
        claims(0, SimTime::ZERO, Some((1, -1.0))),
        claims(0, SimTime::ZERO, Some((9, 1e9))),
        claims(0, SimTime(u64::MAX), Some((1, 1e9))),
        claims(7, SimTime::ZERO, Some((1, 1e9))),
        Table {
            slot: 3,
            ..claims(0, SimTime::ZERO, Some((1, 1e9)))
        },
        Table {
            news: vec![News {
                robot: RobotId(2),
                age_ms: u32::MAX,
            }],
            ..claims(0, SimTime::ZERO, Some((2, 1e9)))
        },
    ];
    for table in wild {
        let mut team = Team::<Cbba>::new(1, spread(3, 1), &single(), TAU);
        for _ in 0..4 {
            team.step();
        }
        assert_eq!(team.active(), [Some(0), None, None]);
        let now = team.now();
        team.whisper(0, said_by(1, 1000, now.since(SimTime(50)), table.clone()));
        team.step();
        assert_eq!(team.active()[0], Some(0), "{table:?}");
        // Nor does it have to take it again, which it would tell.
        assert_eq!(team.members[0].decision.say, [], "{table:?}");
    }
    // A better bid does.
    let mut team = Team::<Cbba>::new(1, spread(3, 1), &single(), TAU);
    for _ in 0..4 {
        team.step();
    }
    let sent = team.now().since(SimTime(50));
    let better = claims(0, SimTime::ZERO, Some((1, 1e9)));
    team.whisper(0, said_by(1, 1000, sent, better.clone()));
    team.step();
    assert_eq!(team.active()[0], None);
    assert_eq!(team.members[0].decision.reason, Some(Reason::Outbid));
    // Neither a word of the future nor one that has been overtaken counts.
    for (seq, sent) in [(1001, SimTime(1 << 40)), (999, sent), (1000, sent)] {
        let mut later = Team::<Cbba>::new(1, spread(3, 1), &single(), TAU);
        for _ in 0..4 {
            later.step();
        }
        let idle = claims(0, SimTime::ZERO, None);
        later.whisper(0, said_by(1, 1000, later.now().since(SimTime(50)), idle));
        later.step();
        later.whisper(0, said_by(1, seq, sent, better.clone()));
        later.step();
        assert_eq!(later.active()[0], Some(0), "{seq} {sent:?}");
    }
}

/// A newer round of a task voids the claim to the older one, whoever hears of it first.
#[test]
fn a_new_round_is_negotiated_anew() {
    let mut team = Team::<Cbba>::new(1, spread(2, 1), &single(), TAU);
    for _ in 0..10 {
        team.step();
    }
    assert_eq!(team.active(), [Some(0), None]);
    team.work.first_s = vec![vec![50.0], vec![5.0]];
    team.round[0] = SimTime(400);
    for _ in 0..3 {
        team.step();
    }
    assert_eq!(team.active(), [None, Some(0)]);
}

/// What is said of an older round takes nothing, and leaves nothing to a robot that begins anew and has yet to hear of the newer one.
#[test]
fn older_rounds_are_void() {
    let mut team = Team::<Cbba>::new(1, spread(2, 1), &single(), TAU);
    team.round[0] = SimTime(100);
    for _ in 0..10 {
        team.step();
    }
    assert_eq!(team.active(), [Some(0), None]);
    let sent = team.now().since(SimTime(50));
    let better = claims(0, SimTime(50), Some((1, 1e9)));
    team.whisper(0, said_by(1, 1000, sent, better));
    team.step();
    assert_eq!(team.active(), [Some(0), None]);

    team.dead[0] = true;
    let mut reborn = said_by(0, 0, sent, claims(0, SimTime::ZERO, None));
    Arc::make_mut(&mut reborn).incarnation = 2;
    team.whisper(1, reborn);
    team.step();
    assert_eq!(team.active()[1], Some(0));
}

/// For τ a claim is worth what it was when it was made; then what is under way has its bonus, and a nearer newcomer does not get it.
#[test]
fn what_has_begun_in_earnest_is_kept() {
    for (steps, keeps) in [(40, false), (110, true)] {
        let mut team = Team::<Cbba>::new(1, spread(2, 1), &single(), TAU);
        team.can[1][0] = false;
        for _ in 0..steps {
            team.step();
        }
        team.can[1][0] = true;
        team.work.first_s[1][0] = 1.0;
        for _ in 0..3 {
            team.step();
        }
        let wanted = if keeps {
            [Some(0), None]
        } else {
            [None, Some(0)]
        };
        assert_eq!(team.active(), wanted, "after {steps} steps");
    }
}

/// A task of higher priority takes a robot from what it is at, however far that has come.
#[test]
fn higher_priority_goes_first() {
    let mut work = spread(1, 2);
    work.priority[1] = 1;
    let mut team = Team::<Cbba>::new(1, work, &single(), TAU);
    team.can[0][1] = false;
    for _ in 0..110 {
        team.step();
    }
    assert_eq!(team.active(), [Some(0)]);
    team.can[0][1] = true;
    team.step();
    assert_eq!(team.active(), [Some(1)]);
}

/// After a minute without progress the bonus is gone, and whoever stands nearer gets the task.
#[test]
fn a_claim_that_leads_to_nothing_loses_its_bonus() {
    let mut team = Team::<Cbba>::new(1, spread(2, 1), &single(), TAU);
    team.can[1][0] = false;
    for _ in 0..110 {
        team.step();
    }
    team.can[1][0] = true;
    team.work.first_s[1][0] = 1.0;
    let mut progressed = false;
    while team.active()[1].is_none() {
        if team.tick == 600 {
            team.progressed[0].push(TaskId(0));
            progressed = true;
        }
        team.step();
        assert!(team.tick < 2000);
    }
    assert!(progressed);
    // A minute after its progress at 30 s, and a step until that is heard.
    assert_eq!(team.tick, 600 + 1200 + 2);
}

/// G4 in a large team with many tasks, all of which are claimed.
#[test]
fn messages_are_bounded_in_any_team() {
    let tasks = 200;
    let mut work = spread(150, tasks);
    for task in 0..tasks {
        work.max_robots[task] = 1 + task % 4;
    }
    let config = BundleConfig {
        bundle: 4,
        refresh_s: 0.2,
    };
    let mut team = Team::<Cbba>::new(1, work, &config, TAU);
    let mut longest = 0;
    for _ in 0..8 {
        team.step();
        for member in &team.members {
            assert!(member.decision.say.len() <= 1 + tasks);
            let lengths = member
                .decision
                .say
                .iter()
                .map(|it| encoded_len(it).unwrap());
            longest = longest.max(lengths.max().unwrap_or(0));
        }
    }
    assert!(longest > 300, "{longest}");
    assert!(longest <= 1200, "{longest}");
}

/// With the largest numbers everywhere, too.
#[test]
fn the_largest_table_fits_a_message() {
    let belief = |task| Belief {
        task: TaskId(u16::MAX - task),
        round: SimTime(u64::from(u32::MAX) + 1),
        claim: Some(Claim {
            robot: RobotId(u16::MAX),
            value: 1.0,
        }),
    };
    let news = News {
        robot: RobotId(u16::MAX),
        age_ms: 60_000,
    };
    let table = AllocationMessage::Table(Table {
        block: u16::MAX,
        slot: u16::MAX,
        beliefs: (0..32).map(belief).collect(),
        news: vec![news; 64],
    });
    assert!(encoded_len(&table).unwrap() <= 1200);
}

/// ACBBA: whoever gives a task up believes at once what it knows of the bids of others; a smaller one than its own was none before.
#[test]
fn what_is_given_up_belongs_to_the_next() {
    let mut team = Team::<Acbba>::new(1, spread(2, 1), &DeltaConfig::default(), TAU);
    team.dead[1] = true;
    for _ in 0..4 {
        team.step();
    }
    let made = team.now().since(SimTime(50));
    let delta = Delta {
        belief: claims(0, SimTime::ZERO, Some((1, 0.1))).beliefs[0],
        slot: 0,
        made,
    };
    let mut word = said_by(1, 1000, made, Table::default());
    let entries = vec![delta];
    Arc::make_mut(&mut word).body =
        Content::Allocation(AllocationMessage::Deltas(Deltas { entries }));
    team.whisper(0, word);
    let holder = |team: &Team<Acbba>| team.members[0].allocator.0.beliefs.holder(TaskId(0));
    team.step();
    assert_eq!(holder(&team), Some(RobotId(0)));
    team.can[0][0] = false;
    team.step();
    assert_eq!(holder(&team), Some(RobotId(1)));
}
