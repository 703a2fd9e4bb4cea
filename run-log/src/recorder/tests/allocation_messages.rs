//! allocation_messages.csv contains every entry of every message of an allocator.

use crate::AllocationMessageRow;
use proptest::prelude::*;
use proto::allocation::awareness::{Awareness, TaskCost};
use proto::allocation::ble::{Eligibility, EligibleTask};
use proto::allocation::consensus::{
    BidChange, BidTable, Deltas, TableEntry, TimeStamp, WinningBid,
};
use proto::allocation::dhba::{MatrixPart, MatrixRow, RowVersion};
use proto::allocation::grape::{CoalitionMember, CoalitionPartition};
use proto::allocation::murdoch::{AuctionId, ContractStatus, Negotiation, NegotiationKind};
use proto::allocation::ssi::{AuctionBid, Award, CostBid};
use proto::allocation::{AllocationMessage, OpenMessage};
use proto::team::BroadcastContent;

use super::*;

fn log_of(messages: Vec<AllocationMessage>) -> MemoryLog {
    let mut ticks = sample();
    let messages = messages.into_iter().zip(0..);
    ticks[1].allocation_messages = messages
        .map(|(message, index)| Broadcast {
            sender: GOLD,
            incarnation: 2,
            tick: 1,
            index,
            seq: 7 + u64::from(index),
            sent: SimTime(50),
            body: BroadcastContent::Allocation(message),
        })
        .collect();
    log(LogLevel::Full, &ticks).1
}

fn rows_of(memory: MemoryLog) -> Vec<AllocationMessageRow> {
    let run = log(LogLevel::Full, &sample()).0;
    let log = read(run, memory);
    log.rows().unwrap()
}

#[test]
fn every_kind_of_message_has_its_columns() {
    let (task, round) = (TaskId(0), SimTime(20));
    let entry = |claim| TableEntry { task, round, claim };
    let won = Some(WinningBid {
        robot: BLUE,
        value: 0.5,
    });
    let word = |word| {
        AllocationMessage::Murdoch(Negotiation {
            task,
            round,
            auction: AuctionId {
                auctioneer: BLUE,
                incarnation: 1,
                number: 3,
            },
            word,
        })
    };
    let memory = log_of(vec![
        AllocationMessage::Open(OpenMessage {
            schema: "mine/bid".to_owned(),
            bytes: vec![0, 0x1f, 0xff],
        }),
        AllocationMessage::Ble(Eligibility {
            entries: [EligibleTask {
                task,
                round,
                utility: 0.25,
            }]
            .into_iter()
            .collect(),
        }),
        word(NegotiationKind::Announce {
            closes: SimTime(100),
        }),
        word(NegotiationKind::Bid { utility: 0.75 }),
        word(NegotiationKind::Renew { winner: BLUE }),
        word(NegotiationKind::Ack {
            status: ContractStatus::Ongoing,
            progress: 4,
        }),
        AllocationMessage::Table(BidTable {
            block: 0,
            slot: 1,
            beliefs: vec![entry(won), entry(None)],
            news: vec![TimeStamp {
                robot: BLUE,
                age_ms: 30,
            }],
        }),
        AllocationMessage::Deltas(Deltas {
            entries: vec![BidChange {
                belief: entry(won),
                slot: 0,
                made: SimTime(40),
            }],
        }),
        AllocationMessage::Deltas(Deltas::default()),
        AllocationMessage::Partition(CoalitionPartition {
            evolution: 9,
            stamp: 0.125,
            part: 0,
            parts: 1,
            members: vec![CoalitionMember {
                robot: BLUE,
                task,
                seen: SimTime(45),
            }],
        }),
        AllocationMessage::Ssi(AuctionBid {
            auction: 5,
            bid: None,
            block: 0,
            awards: vec![Award {
                round,
                auction: 4,
                bid: CostBid {
                    task,
                    slot: 1,
                    cost: 7.5,
                },
            }],
        }),
        AllocationMessage::Dhba(MatrixPart {
            rows: vec![MatrixRow {
                version: RowVersion {
                    robot: GOLD,
                    made: Some(SimTime(40)),
                    seen: SimTime(50),
                },
                entries: vec![EligibleTask {
                    task,
                    round,
                    utility: 0.5,
                }],
            }],
            versions: vec![RowVersion {
                robot: BLUE,
                made: Some(SimTime(10)),
                seen: SimTime(45),
            }],
        }),
        AllocationMessage::Dhba(MatrixPart::default()),
        // Robots and tasks that do not exist.
        AllocationMessage::Partition(CoalitionPartition {
            members: vec![CoalitionMember {
                robot: RobotId(900),
                task: TaskId(900),
                seen: SimTime(0),
            }],
            ..CoalitionPartition::default()
        }),
        AllocationMessage::Impacts(BidTable {
            beliefs: vec![entry(Some(WinningBid {
                robot: BLUE,
                value: -12.5,
            }))],
            ..BidTable::default()
        }),
        AllocationMessage::Awareness(Awareness {
            block: 0,
            costs: vec![TaskCost {
                task,
                cost_s: 30.5,
                worth: 0.5,
            }],
        }),
    ]);
    let table = Table::AllocationMessages;
    insta::assert_snapshot!(str::from_utf8(&memory.tables[&table]).unwrap());
    let seal = "\n50,1,world,allocation_messages.csv,";
    assert!(
        str::from_utf8(&memory.tables[&Table::Ticks])
            .unwrap()
            .contains(seal)
    );
    assert_eq!(rows_of(memory).len(), 21);
    assert!(!log_of(Vec::new()).tables.contains_key(&table));
}

#[test]
fn contents_of_messages_do_not_change_the_hash() {
    let mut ticks = sample();
    let before = log(LogLevel::Full, &ticks).0.hash;
    ticks[1].allocation_messages = vec![Broadcast {
        sender: GOLD,
        incarnation: 1,
        tick: 1,
        index: 0,
        seq: 0,
        sent: SimTime(50),
        body: BroadcastContent::Allocation(AllocationMessage::Deltas(Deltas::default())),
    }];
    assert_eq!(log(LogLevel::Full, &ticks).0.hash, before);
}

proptest! {
    #[test]
    fn rows_survive_a_round_trip(
        schema in "\\PC{0,20}",
        bytes in prop::collection::vec(any::<u8>(), 0..200),
        value: f32,
        stamp in 0.0..1.0_f64,
        (evolution, round, seen) in any::<(u64, u64, u64)>(),
        (robot, task, slot) in any::<(u32, u32, u16)>(),
    ) {
        let (robot, task) = (RobotId(robot % 3), TaskId(task % 2));
        let value = if value.is_finite() { value } else { 0.0 };
        let entry = TableEntry { task, round: SimTime(round), claim: Some(WinningBid { robot, value }) };
        let change = BidChange { belief: entry, slot, made: SimTime(seen) };
        let member = CoalitionMember { robot, task, seen: SimTime(seen) };
        let rows = rows_of(log_of(vec![
            AllocationMessage::Open(OpenMessage { schema: schema.clone(), bytes: bytes.clone() }),
            AllocationMessage::Deltas(Deltas { entries: vec![change] }),
            AllocationMessage::Partition(CoalitionPartition { evolution, stamp, part: 0, parts: 1, members: vec![member] }),
        ]));
        let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        prop_assert_eq!(&rows[0].detail, &format!("{schema} {hex}"));
        prop_assert_eq!(rows[1].bid.map(f32::to_bits), Some(value.to_bits()));
        prop_assert_eq!((rows[1].round_ms, rows[1].time_ms, rows[1].slot), (Some(SimTime(round)), Some(SimTime(seen)), Some(slot)));
        prop_assert_eq!((rows[2].evolution, rows[2].stamp.map(f64::to_bits)), (Some(evolution), Some(stamp.to_bits())));
    }
}
