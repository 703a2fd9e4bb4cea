//! Generated broadcasts of a robot that lies: anything that the message types allow.

use glam::Vec2;
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use proto::allocation::ble::{Eligibility, EligibleTask};
use proto::allocation::consensus::{
    BidChange, BidTable, Deltas, TableEntry, TimeStamp, WinningBid,
};
use proto::allocation::grape::{CoalitionMember, CoalitionPartition};
use proto::allocation::murdoch::{AuctionId, ContractStatus, Negotiation, NegotiationKind};
use proto::allocation::{AllocationMessage, OpenMessage};
use proto::mission::items::{
    Fact, ItemsBulletin, ItemsKnowledge, Locations, LooseItem, Withdrawal,
};
use proto::mission::{Payload, SharedKnowledge};
use proto::team::{
    Broadcast, BroadcastContent, Bulletin, BulletinKind, BulletinSubject, Heartbeat, TaskState,
};
use proto::tick::{Report, TickMessage};
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;

/// Returns the answer of a liar that stands still and sends its lies in turn, two in each tick.
#[must_use]
pub fn answer(
    lies: &[Broadcast],
    robot: RobotId,
    message: &TickMessage,
) -> (Report, Vec<Broadcast>) {
    let first = 2 * message.tick as usize;
    let next = lies.iter().cycle().skip(first % lies.len()).take(2);
    let addressed = next.zip(0..).map(|(lie, index)| Broadcast {
        sender: robot,
        incarnation: message.incarnation,
        tick: message.tick,
        index,
        ..lie.clone()
    });
    let broadcasts: Vec<Broadcast> = addressed.collect();
    let report = Report {
        robot,
        incarnation: message.incarnation,
        tick: message.tick,
        broadcasts: broadcasts.len() as u16,
        ..Report::default()
    };
    (report, broadcasts)
}

/// Returns the lies that a seed determines.
///
/// # Panics
/// Never panics, because no strategy rejects values.
#[must_use]
pub fn lies(seed: u64) -> Vec<Broadcast> {
    let mut bytes = [0; 32];
    bytes[..8].copy_from_slice(&seed.to_le_bytes());
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &bytes);
    let mut runner = TestRunner::new_with_rng(Config::default(), rng);
    let tree = vec(lie(), 1..30).new_tree(&mut runner);
    tree.expect("no strategy rejects values").current()
}

/// Returns a small number, as in a real message, or any number.
fn number() -> impl Strategy<Value = u16> {
    prop_oneof![3 => 0..4_u16, 1 => any::<u16>()]
}

fn task() -> impl Strategy<Value = TaskId> {
    number().prop_map(TaskId)
}

fn robot() -> impl Strategy<Value = RobotId> {
    number().prop_map(RobotId)
}

fn time() -> impl Strategy<Value = SimTime> {
    prop_oneof![3 => 0..60_000_u64, 1 => any::<u64>()].prop_map(SimTime)
}

/// Returns any floating-point number, also infinite ones and NaN.
fn real() -> impl Strategy<Value = f32> {
    prop_oneof![2 => 0.0..10.0_f32, 1 => any::<u32>().prop_map(f32::from_bits)]
}

fn point() -> impl Strategy<Value = Vec2> {
    (real(), real()).prop_map(Vec2::from)
}

fn fact<T: std::fmt::Debug>(value: impl Strategy<Value = T>) -> impl Strategy<Value = Fact<T>> {
    (value, robot(), time()).prop_map(|(value, seen_by, seen)| Fact {
        value,
        seen_by,
        seen,
    })
}

fn locations() -> impl Strategy<Value = Fact<Locations>> {
    fact((point(), point()).prop_map(|(min, max)| Locations { min, max }))
}

fn withdrawal() -> impl Strategy<Value = Withdrawal> {
    (robot(), time()).prop_map(|(finder, seen)| Withdrawal { finder, seen })
}

fn shared_knowledge() -> impl Strategy<Value = SharedKnowledge> {
    let loose = (point(), any::<bool>()).prop_map(|(at, present)| LooseItem { at, present });
    let items = (
        option::of(locations()),
        vec(withdrawal(), 0..4),
        vec((number(), fact(any::<bool>())), 0..4),
        vec(fact(loose), 0..4),
        option::of(fact(Just(()))),
    );
    let items =
        items.prop_map(
            |(locations, withdrawn, empty, loose, last_report)| ItemsKnowledge {
                locations,
                withdrawn,
                empty,
                loose,
                last_report,
            },
        );
    prop_oneof![
        Just(SharedKnowledge::Nothing),
        items.prop_map(SharedKnowledge::Items),
        vec(any::<u8>(), 0..600).prop_map(SharedKnowledge::Open),
    ]
}

fn heartbeat() -> impl Strategy<Value = BroadcastContent> {
    use TaskState::{Executing, Idle, Released, Waiting};
    let state = prop::sample::select(vec![Executing, Waiting, Idle, Released]);
    let subject = (option::of(number()), option::of(task()), any::<u32>());
    let rest = (option::of(point()), any::<bool>(), shared_knowledge());
    (state, time(), subject, rest).prop_map(|(state, since, subject, rest)| {
        let (set, task, progress) = subject;
        let (position, carrying, shared_knowledge) = rest;
        BroadcastContent::Heartbeat(Heartbeat {
            state,
            since,
            set: set.map(BehaviorId),
            task,
            progress,
            position,
            carrying,
            shared_knowledge,
        })
    })
}

fn bulletin() -> impl Strategy<Value = BroadcastContent> {
    let kind = prop::sample::select(vec![BulletinKind::First, BulletinKind::Second]);
    let about =
        (task(), number(), any::<u32>()).prop_map(|(task, set, progress)| BulletinSubject {
            task,
            set: BehaviorId(set),
            progress,
        });
    let payload = prop_oneof![
        locations().prop_map(|value| Payload::Items(ItemsBulletin::PositionUpdate(value))),
        withdrawal().prop_map(|value| Payload::Items(ItemsBulletin::Withdrawal(value))),
        vec(any::<u8>(), 0..600).prop_map(Payload::Open),
    ];
    (kind, option::of(about), payload).prop_map(|(kind, about, payload)| {
        BroadcastContent::Bulletin(Bulletin {
            kind,
            about,
            payload,
        })
    })
}

fn allocation() -> impl Strategy<Value = BroadcastContent> {
    let open = ("[a-z/]{0,8}", vec(any::<u8>(), 0..40))
        .prop_map(|(schema, bytes)| AllocationMessage::Open(OpenMessage { schema, bytes }));
    let eligible = (task(), time(), real()).prop_map(|(task, round, utility)| EligibleTask {
        task,
        round,
        utility,
    });
    let ble = vec(eligible, 0..100).prop_map(|entries| {
        AllocationMessage::Ble(Eligibility {
            entries: entries.into(),
        })
    });
    let kind = prop_oneof![
        time().prop_map(|closes| NegotiationKind::Announce { closes }),
        real().prop_map(|utility| NegotiationKind::Bid { utility }),
        robot().prop_map(|winner| NegotiationKind::Renew { winner }),
        (any::<u32>(), 0..3_usize).prop_map(|(progress, status)| NegotiationKind::Ack {
            status: [
                ContractStatus::Ongoing,
                ContractStatus::Done,
                ContractStatus::Abort
            ][status],
            progress,
        }),
    ];
    let auction = (robot(), 0..3_u32, any::<u32>());
    let murdoch = (task(), time(), auction, kind).prop_map(|(task, round, auction, kind)| {
        let (auctioneer, incarnation, number) = auction;
        AllocationMessage::Murdoch(Negotiation {
            task,
            round,
            auction: AuctionId {
                auctioneer,
                incarnation,
                number,
            },
            word: kind,
        })
    });
    let entry = || {
        let bid = (robot(), real()).prop_map(|(robot, value)| WinningBid { robot, value });
        (task(), time(), option::of(bid)).prop_map(|(task, round, claim)| TableEntry {
            task,
            round,
            claim,
        })
    };
    let stamp = (robot(), any::<u32>()).prop_map(|(robot, age_ms)| TimeStamp { robot, age_ms });
    let table = (number(), number(), vec(entry(), 0..40), vec(stamp, 0..70));
    let table = table.prop_map(|(block, slot, beliefs, news)| {
        AllocationMessage::Table(BidTable {
            block,
            slot,
            beliefs,
            news,
        })
    });
    let change = (entry(), number(), time()).prop_map(|(belief, slot, made)| BidChange {
        belief,
        slot,
        made,
    });
    let deltas =
        vec(change, 0..40).prop_map(|entries| AllocationMessage::Deltas(Deltas { entries }));
    let member = (robot(), task(), time()).prop_map(|(robot, task, seen)| CoalitionMember {
        robot,
        task,
        seen,
    });
    let evolution = prop_oneof![0..50_u64, any::<u64>()];
    let version = (evolution, prop_oneof![0.0..1.0_f64, any::<f64>()]);
    let parts = prop_oneof![Just((0_u16, 1_u16)), (number(), number())];
    let grape = (version, parts, vec(member, 0..5)).prop_map(|(version, parts, members)| {
        AllocationMessage::Partition(CoalitionPartition {
            evolution: version.0,
            stamp: version.1,
            part: parts.0,
            parts: parts.1,
            members,
        })
    });
    prop_oneof![open, ble, murdoch, table, deltas, grape].prop_map(BroadcastContent::Allocation)
}

/// Returns a broadcast with any content and any times. The liar fills in its own address.
pub fn lie() -> impl Strategy<Value = Broadcast> {
    let content = prop_oneof![heartbeat(), bulletin(), allocation()];
    let seq = prop_oneof![3 => 0..4000_u64, 1 => any::<u64>()];
    (seq, time(), content).prop_map(|(seq, sent, body)| Broadcast {
        sender: RobotId(0),
        incarnation: 1,
        tick: 0,
        index: 0,
        seq,
        sent,
        body,
    })
}
