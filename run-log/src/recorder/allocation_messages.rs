//! The rows of allocation_messages.csv: the contents of allocators' messages, one row per entry.

use proto::allocation::AllocationMessage;
use proto::allocation::consensus::BidTable;
use proto::allocation::dhba::{MatrixPart, RowVersion};
use proto::allocation::murdoch::{AuctionId, ContractStatus, NegotiationKind};
use proto::allocation::ssi::{AuctionBid, CostBid};
use proto::team::{Broadcast, BroadcastContent};
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;

use super::names::Names;
use super::record::TickRecord;
use super::row::Row;

/// A part of a message, with the columns that its kind uses.
#[derive(Clone, Debug, Default)]
struct Entry {
    kind: &'static str,
    task: Option<TaskId>,
    slot: Option<u16>,
    robot: Option<RobotId>,
    bid: Option<f32>,
    round: Option<SimTime>,
    time: Option<SimTime>,
    auction: Option<AuctionId>,
    evolution: Option<u64>,
    stamp: Option<f64>,
    detail: String,
}

/// Encodes the allocation messages of a tick, by sender and index.
pub(super) fn encode(names: &Names, record: &TickRecord<'_>, rows: &mut Vec<u8>) {
    for broadcast in record.allocation_messages {
        if let BroadcastContent::Allocation(message) = &broadcast.body {
            for entry in entries(message, broadcast) {
                row(names, broadcast, &entry, rows);
            }
        }
    }
}

fn row(names: &Names, broadcast: &Broadcast, entry: &Entry, rows: &mut Vec<u8>) {
    let robot = |robot: RobotId| names.known_robot(robot);
    let auction = entry.auction.map_or_else(String::new, |auction| {
        let AuctionId {
            auctioneer,
            incarnation,
            number,
        } = auction;
        format!("{}/{incarnation}/{number}", robot(auctioneer))
    });
    let row = Row::new(rows)
        .number(broadcast.sent.0)
        .text(robot(broadcast.sender))
        .number(broadcast.incarnation)
        .number(broadcast.seq)
        .word(entry.kind)
        .text(names.task(entry.task))
        .optional(entry.slot)
        .text(entry.robot.map_or("", robot));
    let row = match entry.bid {
        Some(bid) => row.real(bid),
        None => row.text(""),
    };
    let row = row
        .optional(entry.round.map(|round| round.0))
        .optional(entry.time.map(|time| time.0))
        .text(&auction)
        .optional(entry.evolution);
    let row = match entry.stamp {
        Some(stamp) => row.real(stamp),
        None => row.text(""),
    };
    row.text(&entry.detail).end();
}

/// Returns the entries of a message. A message without entries has one row with the kind of the message.
fn entries(message: &AllocationMessage, broadcast: &Broadcast) -> Vec<Entry> {
    let sender = Some(broadcast.sender);
    let (kind, entries): (_, Vec<Entry>) = match message {
        AllocationMessage::Open(open) => {
            let bytes: String = open
                .bytes
                .iter()
                .map(|byte| format!("{byte:02x}"))
                .collect();
            let entry = Entry {
                kind: "open",
                detail: format!("{} {bytes}", open.schema),
                ..Entry::default()
            };
            ("open", vec![entry])
        }
        AllocationMessage::Ble(eligibility) => {
            let entries = eligibility.entries.iter().map(|eligible| Entry {
                kind: "eligibility",
                task: Some(eligible.task),
                robot: sender,
                bid: Some(eligible.utility),
                round: Some(eligible.round),
                ..Entry::default()
            });
            ("eligibility", entries.collect())
        }
        AllocationMessage::Murdoch(negotiation) => {
            let entry = Entry {
                task: Some(negotiation.task),
                round: Some(negotiation.round),
                auction: Some(negotiation.auction),
                ..of_auction(negotiation.word, broadcast.sender)
            };
            (entry.kind, vec![entry])
        }
        AllocationMessage::Table(table) => ("table", of_table("belief", table, broadcast)),
        AllocationMessage::Impacts(table) => ("impacts", of_table("impact", table, broadcast)),
        AllocationMessage::Deltas(deltas) => {
            let entries = deltas.entries.iter().map(|delta| Entry {
                kind: "delta",
                task: Some(delta.belief.task),
                slot: Some(delta.slot),
                robot: delta.belief.claim.map(|claim| claim.robot),
                bid: delta.belief.claim.map(|claim| claim.value),
                round: Some(delta.belief.round),
                time: Some(delta.made),
                ..Entry::default()
            });
            ("deltas", entries.collect())
        }
        AllocationMessage::Partition(partition) => {
            let common = Entry {
                kind: "partition",
                evolution: Some(partition.evolution),
                stamp: Some(partition.stamp),
                detail: format!(
                    "part {} of {}",
                    u32::from(partition.part) + 1,
                    partition.parts
                ),
                ..Entry::default()
            };
            let members = partition.members.iter().map(|member| Entry {
                kind: "member",
                task: Some(member.task),
                robot: Some(member.robot),
                time: Some(member.seen),
                ..common.clone()
            });
            let members: Vec<Entry> = members.collect();
            let is_empty = members.is_empty();
            ("partition", if is_empty { vec![common] } else { members })
        }
        AllocationMessage::Ssi(message) => ("ssi-bid", of_ssi(message, broadcast.sender)),
        AllocationMessage::Dhba(part) => ("dhba-part", of_dhba(part)),
        AllocationMessage::Awareness(awareness) => {
            let costs = awareness.costs.iter().map(|cost| Entry {
                kind: "awareness",
                task: Some(cost.task),
                robot: sender,
                bid: Some(cost.worth as f32),
                detail: format!("cost {} s", cost.cost_s),
                ..Entry::default()
            });
            ("awareness", costs.collect())
        }
    };
    if entries.is_empty() {
        let empty = Entry {
            kind,
            ..Entry::default()
        };
        return vec![empty];
    }
    entries
}

/// Returns the bid of a message, also an empty one, and the awards.
fn of_ssi(message: &AuctionBid, sender: RobotId) -> Vec<Entry> {
    let entry = |kind, auction: u32, bid: Option<CostBid>| Entry {
        kind,
        task: bid.map(|bid| bid.task),
        slot: bid.map(|bid| bid.slot),
        robot: Some(sender),
        bid: bid.map(|bid| bid.cost),
        detail: format!("auction {auction}"),
        ..Entry::default()
    };
    let awards = message.awards.iter().map(|award| Entry {
        round: Some(award.round),
        ..entry("ssi-award", award.auction, Some(award.bid))
    });
    let bid = entry("ssi-bid", message.auction, message.bid);
    std::iter::once(bid).chain(awards).collect()
}

/// Returns the versions of the rows in a message, each with its entries, and the other versions.
fn of_dhba(part: &MatrixPart) -> Vec<Entry> {
    let version = |kind, version: &RowVersion| Entry {
        kind,
        robot: Some(version.robot),
        time: version.made,
        detail: format!("seen {}", version.seen.0),
        ..Entry::default()
    };
    let rows = part.rows.iter().flat_map(|row| {
        let entries = row.entries.iter().map(|entry| Entry {
            kind: "dhba-entry",
            task: Some(entry.task),
            robot: Some(row.version.robot),
            bid: Some(entry.utility),
            round: Some(entry.round),
            time: row.version.made,
            ..Entry::default()
        });
        std::iter::once(version("dhba-row", &row.version)).chain(entries)
    });
    let versions = part.versions.iter();
    let versions = versions.map(|known| version("dhba-version", known));
    rows.chain(versions).collect()
}

/// Returns the entries of a consensus table: those of its tasks, of the given kind, and the time stamps.
fn of_table(kind: &'static str, table: &BidTable, broadcast: &Broadcast) -> Vec<Entry> {
    let beliefs = table.beliefs.iter().map(|belief| Entry {
        kind,
        task: Some(belief.task),
        slot: Some(table.slot),
        robot: belief.claim.map(|claim| claim.robot),
        bid: belief.claim.map(|claim| claim.value),
        round: Some(belief.round),
        ..Entry::default()
    });
    let news = table.news.iter().map(|news| Entry {
        kind: "news",
        slot: Some(table.slot),
        robot: Some(news.robot),
        time: Some(SimTime(broadcast.sent.0.saturating_sub(news.age_ms.into()))),
        detail: format!("block {}", table.block),
        ..Entry::default()
    });
    beliefs.chain(news).collect()
}

fn of_auction(content: NegotiationKind, sender: RobotId) -> Entry {
    match content {
        NegotiationKind::Announce { closes } => Entry {
            kind: "announce",
            time: Some(closes),
            ..Entry::default()
        },
        NegotiationKind::Bid { utility } => Entry {
            kind: "bid",
            robot: Some(sender),
            bid: Some(utility),
            ..Entry::default()
        },
        NegotiationKind::Renew { winner } => Entry {
            kind: "renew",
            robot: Some(winner),
            ..Entry::default()
        },
        NegotiationKind::Ack { status, progress } => {
            let status = match status {
                ContractStatus::Ongoing => "ongoing",
                ContractStatus::Done => "done",
                ContractStatus::Abort => "abort",
            };
            Entry {
                kind: "ack",
                robot: Some(sender),
                detail: format!("{status}; progress {progress}"),
                ..Entry::default()
            }
        }
    }
}
