//! Tests of message delivery for single link states. `mixtures` tests arbitrary sequences of them.

mod mixtures;

use scenario::testkit::default_setup;
use std::collections::BTreeMap;

use crate::link::Probability;
use crate::mission::Payload;
use crate::readings::Readings;
use crate::team::{Bulletin, BulletinKind};
use crate::tick::ManifestEntry;

use super::*;

use Delivery::{
    Blocked, Corrupted, Cut, Damaged, Delayed, Dropped, Duplicate, Faded, Lost, Pending, Received,
};

const RECEIVER: RobotId = RobotId(2);
const STEP: SimTime = SimTime(50);

fn links(seed: u64) -> IncomingMessages {
    IncomingMessages {
        seed,
        ..IncomingMessages::new(RECEIVER, &default_setup(1))
    }
}

/// Creates the `index`-th broadcast of a sender in a tick. Its sequence number grows with time.
fn broadcast(sender: u32, tick: Tick, index: u16) -> Broadcast {
    Broadcast {
        sender: RobotId(sender),
        incarnation: 1,
        tick,
        index,
        seq: tick * 10 + u64::from(index),
        sent: SimTime(tick * STEP.0),
        body: BroadcastContent::Bulletin(Bulletin {
            kind: BulletinKind::Second,
            about: None,
            payload: Payload::Open(vec![7; 4]),
        }),
    }
}

/// Broadcasts of one sender in the previous tick: sender, count, link state.
type Sent = (u32, u16, Option<LinkState>);

fn message(tick: Tick, sent: &[Sent], held: &[u32]) -> TickMessage {
    TickMessage {
        incarnation: 1,
        tick,
        now: SimTime(tick * STEP.0),
        last_counted: None,
        manifest: sent
            .iter()
            .map(|&(sender, count, link)| ManifestEntry {
                sender: RobotId(sender),
                tick: tick - 1,
                incarnation: 1,
                count,
                link: link.map(Box::new),
            })
            .collect(),
        ground_truth: Vec::new(),
        held: held.iter().copied().map(RobotId).collect(),
        readings: Readings::default(),
    }
}

fn arrived(tick: Tick, sent: &[Sent]) -> Vec<Option<Arc<Broadcast>>> {
    sent.iter()
        .flat_map(|&(sender, count, _)| {
            (0..count).map(move |index| Some(Arc::new(broadcast(sender, tick - 1, index))))
        })
        .collect()
}

fn receive(links: &mut IncomingMessages, tick: Tick, sent: &[Sent], held: &[u32]) -> StepMessages {
    receive_message(links, &message(tick, sent, held), arrived(tick, sent))
}

fn receive_message(
    links: &mut IncomingMessages,
    message: &TickMessage,
    mut arrived: Vec<Option<Arc<Broadcast>>>,
) -> StepMessages {
    let mut messages = StepMessages::default();
    links.receive(message, &mut arrived, &mut messages);
    assert!(arrived.is_empty());
    messages
}

/// Returns sender, sequence number, delivery and time (in ticks) of each reception.
fn deliveries(messages: &StepMessages) -> Vec<(u32, u64, Delivery, u64)> {
    let receptions = messages.receptions.iter();
    receptions
        .map(|reception| {
            let seq = reception.content.map_or(u64::MAX, |summary| summary.seq);
            let at = reception.at.0 / STEP.0;
            (reception.sender.0, seq, reception.delivery, at)
        })
        .collect()
}

fn inbox(messages: &StepMessages) -> Vec<(u32, u64)> {
    let inbox = messages.inbox.iter();
    inbox
        .map(|broadcast| (broadcast.sender.0, broadcast.seq))
        .collect()
}

fn state(change: impl FnOnce(&mut LinkState)) -> Option<LinkState> {
    let mut state = LinkState::default();
    change(&mut state);
    Some(state)
}

fn always(change: fn(&mut LinkState) -> &mut Probability) -> Option<LinkState> {
    state(|state| *change(state) = Probability::ALWAYS)
}

#[test]
fn a_missing_broadcast_is_logged_as_lost_with_its_sender() {
    let mut links = links(1);
    let message = message(5, &[(1, 2, state(|link| link.cut = true))], &[]);
    let messages = receive_message(
        &mut links,
        &message,
        vec![None, Some(Arc::new(broadcast(1, 4, 1)))],
    );
    assert!(messages.inbox.is_empty());
    assert_eq!(
        deliveries(&messages),
        [(1, u64::MAX, Lost, 5), (1, 41, Cut, 5)]
    );
    assert_eq!(messages.receptions[0].sent, SimTime(200));
    assert_eq!(messages.receptions[0].content, None);
}

#[test]
fn a_clear_link_delivers_at_once_in_order_of_rank_and_number() {
    let mut links = links(1);
    let messages = receive(
        &mut links,
        5,
        &[(0, 2, None), (1, 1, Some(LinkState::default()))],
        &[],
    );
    assert_eq!(inbox(&messages), [(0, 40), (0, 41), (1, 40)]);
    assert!(messages.receptions.iter().all(|r| r.delivery == Received));
    assert!(links.kept.is_empty() && links.copies.is_empty());
}

#[test]
fn probabilities_0_and_1_are_exact() {
    let mut links = links(1);
    let (all_lost, all_doubled) = (
        always(|link| &mut link.drop),
        always(|link| &mut link.duplicate),
    );
    for tick in 1..2000 {
        let messages = receive(
            &mut links,
            tick,
            &[(0, 1, all_lost), (1, 1, all_doubled)],
            &[],
        );
        let seq = (tick - 1) * 10;
        assert_eq!(
            deliveries(&messages)[..2],
            [(0, seq, Dropped, tick), (1, seq, Received, tick)]
        );
        let copies = if tick == 1 { 0 } else { 1 };
        assert_eq!(deliveries(&messages).len(), 2 + copies);
    }
}

#[test]
fn a_delay_is_rounded_up_to_whole_steps() {
    for (delay_ms, steps) in [(1, 1), (50, 1), (51, 2), (2000, 40)] {
        let mut links = links(1);
        let late = state(|link| link.delay = SimTime(delay_ms));
        let messages = receive(&mut links, 5, &[(1, 1, late)], &[]);
        assert_eq!(deliveries(&messages), [(1, 40, Pending, 5 + steps)]);
        for tick in 6..5 + steps {
            assert_eq!(receive(&mut links, tick, &[], &[]), StepMessages::default());
        }
        let messages = receive(&mut links, 5 + steps, &[], &[]);
        assert_eq!(deliveries(&messages), [(1, 40, Delayed, 5 + steps)]);
        assert_eq!(inbox(&messages), [(1, 40)]);
    }
}

#[test]
fn jitter_takes_every_value_evenly() {
    let mut counts = [0; 5];
    for tick in 0..10_000 {
        let broadcast = broadcast(1, tick, 0);
        let draws = Draws::new(1, RECEIVER, &broadcast, draws::block(&broadcast, 0));
        counts[draws.jitter_within(SimTime(4)).0 as usize] += 1;
    }
    // The expected count is 2000, with a standard deviation of 40.
    assert!(
        counts.iter().all(|count| (1840..2160).contains(count)),
        "{counts:?}"
    );
}

#[test]
fn observed_frequencies_match_the_probabilities() {
    for seed in [1, 2, 3] {
        let mut links = links(seed);
        let mut counts = BTreeMap::new();
        for tick in 1..=10_000 {
            let link = state(|link| {
                link.drop = Probability::from_share(0.3);
                link.duplicate = Probability::from_share(0.1);
            });
            for reception in receive(&mut links, tick, &[(0, 1, link)], &[]).receptions {
                *counts.entry(reception.delivery.as_str()).or_insert(0) += 1;
            }
        }
        // The standard deviations are 46 and 25.
        let (dropped, copies) = (counts["dropped"], counts["duplicate"]);
        assert!((2860..3140).contains(&dropped), "{counts:?}");
        assert_eq!(counts["received"], 10_000 - dropped);
        assert!((625..775).contains(&copies), "{counts:?}");
    }
}

/// Returns the deliveries of one message per tick over the link from a sender, and the received bodies.
fn send(
    seed: u64,
    sender: u32,
    ticks: Tick,
    link: Option<LinkState>,
) -> (BTreeMap<&'static str, u32>, Vec<BroadcastContent>) {
    let mut links = links(seed);
    let (mut counts, mut bodies) = (BTreeMap::new(), Vec::new());
    for tick in 1..=ticks {
        let messages = receive(&mut links, tick, &[(sender, 1, link)], &[]);
        for reception in messages.receptions {
            *counts.entry(reception.delivery.as_str()).or_insert(0) += 1;
        }
        bodies.extend(messages.inbox.iter().map(|message| message.body.clone()));
    }
    (counts, bodies)
}

#[test]
fn losses_have_the_first_of_their_reasons() {
    let mut link = LinkState {
        cut: true,
        blocked: true,
        fade: Probability::ALWAYS,
        drop: Probability::ALWAYS,
        corrupt: Probability::ALWAYS,
        ..LinkState::default()
    };
    let changes: [fn(&mut LinkState); 5] = [
        |_| {},
        |link| link.cut = false,
        |link| link.blocked = false,
        |link| link.fade = Probability::NEVER,
        |link| link.drop = Probability::NEVER,
    ];
    let mut reasons = Vec::new();
    for change in changes {
        change(&mut link);
        let messages = receive(&mut links(1), 5, &[(1, 1, Some(link))], &[]);
        assert!(messages.inbox.is_empty());
        reasons.push(messages.receptions[0].delivery);
    }
    assert_eq!(reasons, [Cut, Blocked, Faded, Dropped, Corrupted]);
}

/// The share of received messages lies within four standard deviations of its expectation, in both directions.
#[test]
fn fading_has_its_probability_on_each_link() {
    const MESSAGES: u32 = 20_000;
    for fade in [0.05, 0.3, 0.632] {
        let link = state(|link| link.fade = Probability::from_share(fade));
        let sender = |rank| send(7, rank, MESSAGES.into(), link).0;
        let counts = [sender(0), sender(1)];
        let deviation = (f64::from(MESSAGES) * fade * (1.0 - fade)).sqrt();
        for counts in &counts {
            let off = f64::from(counts["faded"]) - f64::from(MESSAGES) * fade;
            assert!(off.abs() < 4.0 * deviation, "{fade}: {counts:?}");
            assert_eq!(counts["received"] + counts["faded"], MESSAGES);
        }
        assert_ne!(counts[0], counts[1]);
    }
}

#[test]
fn bit_errors_damage_the_expected_share_of_messages() {
    const MESSAGES: u32 = 20_000;
    let payload = crate::codec::encode(&broadcast(0, 0, 0).body).unwrap();
    let bits = 8.0 * payload.len() as f64;
    for p in [0.0002, 0.002, 0.02] {
        let corrupt = |checksum| {
            let link = state(|link| {
                link.corrupt = Probability::from_share(p);
                link.checksum = checksum;
            });
            send(3, 0, MESSAGES.into(), link)
        };
        let (checked, bodies) = corrupt(true);
        let share = 1.0 - (1.0 - p).powf(bits);
        let (mean, messages) = (f64::from(MESSAGES) * share, f64::from(MESSAGES));
        let off = f64::from(checked["corrupted"]) - mean;
        assert!(
            off.abs() < 4.0 * (messages * share * (1.0 - share)).sqrt(),
            "{p}: {checked:?} and {mean}"
        );
        assert_eq!(checked["received"] + checked["corrupted"], MESSAGES);
        let sent = broadcast(0, 0, 0).body;
        assert!(bodies.iter().all(|body| *body == sent));

        let (unchecked, bodies) = corrupt(false);
        assert_eq!(unchecked["received"], checked["received"]);
        let lost = unchecked.get("corrupted").copied().unwrap_or_default();
        assert_eq!(unchecked["damaged"] + lost, checked["corrupted"]);
        let other = bodies.iter().filter(|body| **body != sent).count();
        assert_eq!(other, unchecked["damaged"] as usize);
    }
}

/// The expected payloads are those of `corrupted` in tests/python/agent.py, an independent implementation.
#[test]
fn the_flipped_bits_are_those_of_the_specification() {
    let link = state(|link| link.corrupt = Probability::from_share(0.05));
    let mut links = links(7);
    let mut damaged = Vec::new();
    for tick in 1..=60 {
        let messages = receive(&mut links, tick, &[(1, 1, link)], &[]);
        if messages.receptions[0].delivery != Damaged {
            continue;
        }
        let BroadcastContent::Bulletin(bulletin) = &messages.inbox[0].body else {
            panic!("a message of another kind");
        };
        damaged.push((tick - 1, bulletin.payload.clone()));
    }
    let payloads = [
        (1, [7, 71, 7, 7]),
        (7, [7, 7, 7, 71]),
        (8, [7, 7, 6, 7]),
        (9, [7, 231, 3, 7]),
        (15, [5, 7, 7, 7]),
        (24, [79, 7, 7, 7]),
        (28, [7, 7, 23, 7]),
        (39, [7, 71, 39, 7]),
        (49, [7, 79, 7, 23]),
    ];
    let payloads = payloads.map(|(tick, bytes)| (tick, Payload::Open(bytes.to_vec())));
    assert_eq!(damaged, payloads);
}

#[test]
fn a_damaged_message_may_be_late_and_doubled() {
    let link = state(|link| {
        link.corrupt = Probability::from_share(0.02);
        link.delay = STEP;
        link.duplicate = Probability::ALWAYS;
    });
    let (counts, _) = send(1, 1, 400, link);
    let arrived = counts["damaged"] + counts["delayed"];
    assert!(
        counts["damaged"] > 50 && counts["delayed"] > 50,
        "{counts:?}"
    );
    assert!(counts["pending"] - arrived <= 1, "{counts:?}");
    assert!(arrived - counts["duplicate"] <= 1, "{counts:?}");
    assert!(!counts.contains_key("received"));
}

#[test]
fn held_messages_arrive_together_when_their_sender_is_released() {
    let mut links = links(1);
    let hold = state(|link| {
        link.hold = true;
        link.delay = SimTime(500);
    });
    let messages = receive(&mut links, 5, &[(0, 1, hold), (1, 2, hold)], &[0, 1]);
    assert_eq!(
        deliveries(&messages),
        [
            (0, 40, Pending, 5),
            (1, 40, Pending, 5),
            (1, 41, Pending, 5)
        ]
    );
    assert_eq!(inbox(&receive(&mut links, 6, &[(1, 1, hold)], &[0, 1])), []);
    let messages = receive(&mut links, 7, &[(1, 1, None)], &[0]);
    assert_eq!(inbox(&messages), [(1, 40), (1, 41), (1, 50), (1, 60)]);
    assert_eq!(
        deliveries(&messages)[1..],
        [
            (1, 40, Delayed, 7),
            (1, 41, Delayed, 7),
            (1, 50, Delayed, 7)
        ]
    );
    assert_eq!(inbox(&receive(&mut links, 8, &[], &[])), [(0, 40)]);
}

#[test]
fn an_overtaken_message_arrives_one_step_after_the_next_message_of_its_sender() {
    let mut links = links(1);
    let reorder = always(|link| &mut link.reorder);
    let messages = receive(&mut links, 5, &[(0, 1, reorder), (1, 1, reorder)], &[]);
    assert_eq!(
        deliveries(&messages),
        [(0, 40, Pending, 5), (1, 40, Pending, 5)]
    );
    // A message of another sender overtakes nothing. The next message of the same sender overtakes, for any draw.
    assert_eq!(
        inbox(&receive(&mut links, 6, &[(1, 1, reorder)], &[])),
        [(1, 50)]
    );
    let messages = receive(&mut links, 7, &[(1, 1, reorder)], &[]);
    assert_eq!(inbox(&messages), [(1, 40)]);
    assert_eq!(
        deliveries(&messages),
        [(1, 60, Pending, 7), (1, 40, Delayed, 7)]
    );
    assert_eq!(
        inbox(&receive(&mut links, 8, &[(0, 1, None)], &[])),
        [(0, 70)]
    );
    assert_eq!(inbox(&receive(&mut links, 9, &[], &[])), [(0, 40)]);
}

#[test]
fn an_overtaken_message_is_no_earlier_than_its_delay() {
    let mut links = links(1);
    let both = state(|link| {
        link.reorder = Probability::ALWAYS;
        link.delay = SimTime(500);
    });
    receive(&mut links, 5, &[(1, 1, both)], &[]);
    receive(&mut links, 6, &[(1, 1, None)], &[]);
    for tick in 7..15 {
        assert_eq!(receive(&mut links, tick, &[], &[]), StepMessages::default());
    }
    assert_eq!(inbox(&receive(&mut links, 15, &[], &[])), [(1, 40)]);
}

#[test]
fn a_second_copy_arrives_one_step_later_and_is_ignored() {
    let mut links = links(1);
    let twice = always(|link| &mut link.duplicate);
    let late = state(|link| {
        link.duplicate = Probability::ALWAYS;
        link.delay = SimTime(100);
    });
    let messages = receive(&mut links, 5, &[(0, 1, twice), (1, 1, late)], &[]);
    assert_eq!(inbox(&messages), [(0, 40)]);
    let messages = receive(&mut links, 6, &[], &[]);
    assert_eq!(deliveries(&messages), [(0, 40, Duplicate, 6)]);
    assert!(messages.inbox.is_empty());
    assert_eq!(inbox(&receive(&mut links, 7, &[], &[])), [(1, 40)]);
    let messages = receive(&mut links, 8, &[], &[]);
    assert_eq!(deliveries(&messages), [(1, 40, Duplicate, 8)]);
    assert!(messages.inbox.is_empty());
}

#[test]
fn a_message_that_is_due_while_the_robot_is_absent_is_cut() {
    let mut links = links(1);
    let late = state(|link| {
        link.delay = SimTime(100);
        link.duplicate = Probability::ALWAYS;
    });
    receive(&mut links, 5, &[(1, 1, late)], &[]);
    receive(&mut links, 6, &[(1, 1, late)], &[]);
    // The robot is absent in tick 7, in which the first message is due, and present for the second one.
    let messages = receive(&mut links, 8, &[], &[]);
    assert_eq!(
        deliveries(&messages),
        [(1, 40, Cut, 7), (1, 50, Delayed, 8)]
    );
    assert_eq!(inbox(&messages), [(1, 50)]);
    // The robot is absent again, so the copy is dropped.
    assert_eq!(receive(&mut links, 10, &[], &[]), StepMessages::default());
}

#[test]
fn the_number_of_kept_messages_is_limited() {
    let mut links = links(1);
    let hold = state(|link| link.hold = true);
    for tick in 1..=CAPACITY as u64 {
        receive(&mut links, tick, &[(1, 1, hold)], &[1]);
    }
    let tick = CAPACITY as u64 + 1;
    let messages = receive(&mut links, tick, &[(1, 1, hold)], &[1]);
    assert_eq!(deliveries(&messages)[0].2, Dropped);
    assert_eq!(
        receive(&mut links, tick + 1, &[], &[]).inbox.len(),
        CAPACITY
    );
}

#[test]
fn a_message_of_another_kind_does_not_change_the_draws() {
    let draw = |seed, broadcast: &Broadcast, index| {
        Draws::new(seed, RECEIVER, broadcast, draws::block(broadcast, index))
    };
    let drawn = |seed, sender, tick, index| draw(seed, &broadcast(sender, tick, 7), index);
    let draws = [
        drawn(1, 0, 4, 0),
        drawn(2, 0, 4, 0),
        drawn(1, 1, 4, 0),
        drawn(1, 0, 5, 0),
        drawn(1, 0, 4, 1),
    ];
    for (place, one) in draws.iter().enumerate() {
        assert!(draws[..place].iter().all(|other| other != one));
    }
    // The index among all broadcasts of a tick depends on other kinds, so it does not affect the draws.
    assert_eq!(draw(1, &broadcast(0, 4, 0), 0), drawn(1, 0, 4, 0));
}
