//! Tests of message delivery for mixtures of link states.

use std::collections::{BTreeMap, BTreeSet};

use proptest::prelude::*;

use super::*;

/// One tick of a script.
#[derive(Clone, Debug)]
struct TickInput {
    /// For each of two senders: the number of broadcasts, the link state, and whether it is held.
    senders: [(u16, LinkState, bool); 2],
    /// Whether the robot takes part.
    present: bool,
}

fn probability() -> impl Strategy<Value = Probability> {
    prop_oneof![
        4 => Just(Probability::NEVER),
        1 => Just(Probability::ALWAYS),
        2 => (0.0..1.0_f64).prop_map(Probability::from_share),
    ]
}

fn link_state() -> impl Strategy<Value = LinkState> {
    let span = || prop_oneof![2 => Just(0), 1 => 0..400_u64].prop_map(SimTime);
    let chances = (probability(), probability(), probability());
    let channel = (prop::bool::weighted(0.1), probability());
    (prop::bool::weighted(0.1), chances, channel, span(), span()).prop_map(
        |(cut, (drop, duplicate, reorder), (blocked, fade), delay, jitter)| LinkState {
            blocked,
            fade,
            cut,
            hold: false,
            drop,
            delay,
            jitter,
            duplicate,
            reorder,
            ..LinkState::default()
        },
    )
}

fn script() -> impl Strategy<Value = Vec<TickInput>> {
    let sender = || (0..3_u16, link_state(), prop::bool::weighted(0.2));
    let input = ([sender(), sender()], prop::bool::weighted(0.9));
    prop::collection::vec(
        input.prop_map(|(senders, present)| TickInput { senders, present }),
        1..60,
    )
}

/// Returns the receptions of a robot for each tick of a script; `None` for ticks without the robot.
fn play(seed: u64, script: &[TickInput]) -> Vec<Option<StepMessages>> {
    let mut links = links(seed);
    (1..)
        .zip(script)
        .map(|(tick, input)| {
            let sent: Vec<Sent> = (0..)
                .zip(&input.senders)
                .map(|(sender, &(count, link, hold))| {
                    (sender, count, Some(LinkState { hold, ..link }))
                })
                .collect();
            let held: Vec<u32> = (0..)
                .zip(&input.senders)
                .filter(|(_, (_, _, hold))| *hold)
                .map(|(sender, _)| sender)
                .collect();
            let messages = || receive(&mut links, tick, &sent, &held);
            input.present.then(messages)
        })
        .collect()
}

/// Returns the deliveries of one sender's messages.
fn of_sender(sender: u32, messages: &[Option<StepMessages>]) -> Vec<(u32, u64, Delivery, u64)> {
    let all = messages.iter().flatten().flat_map(deliveries);
    all.filter(|delivery| delivery.0 == sender).collect()
}

proptest! {
    #[test]
    fn each_message_has_one_final_delivery_or_is_in_flight(script in script(), seed: u64) {
        let mut in_flight = BTreeMap::new();
        let mut settled = BTreeSet::new();
        let mut audible = BTreeMap::new();
        let is_doubled = |sender: u32, seq: u64| {
            let (_, link, _) = script[(seq / 10) as usize].senders[sender as usize];
            link.duplicate == Probability::ALWAYS
        };
        for (tick, messages) in (1..).zip(play(seed, &script)) {
            let Some(messages) = messages else { continue };
            let input = &script[tick as usize - 1];
            let listed: usize = input.senders.iter().map(|sender| sender.0 as usize).sum();
            let mut expected = BTreeSet::new();
            for (place, (sender, seq, delivery, at)) in deliveries(&messages).into_iter().enumerate() {
                let key = (sender, seq);
                let is_listed = place < listed;
                prop_assert_eq!(is_listed, seq / 10 == tick - 1);
                if is_listed && !matches!(delivery, Received | Faded | Blocked) {
                    let (_, link, hold) = input.senders[sender as usize];
                    let effect = LinkState { hold, ..link }.effect_behind(delivery);
                    prop_assert!(effect.is_some(), "no effect explains {:?}", delivery);
                }
                match delivery {
                    Pending => {
                        prop_assert!(is_listed && at >= tick);
                        prop_assert!(in_flight.insert(key, at).is_none());
                    }
                    Received | Dropped | Faded | Blocked => {
                        prop_assert!(is_listed && at == tick && settled.insert(key));
                    }
                    Cut => {
                        prop_assert!(is_listed || (at < tick && in_flight.remove(&key).is_some()));
                        prop_assert!(settled.insert(key));
                    }
                    Delayed => {
                        prop_assert_eq!(at, tick);
                        prop_assert!(in_flight.remove(&key).is_some_and(|due| due <= at));
                        prop_assert!(settled.insert(key));
                    }
                    Duplicate => prop_assert_eq!(audible.remove(&key), Some(tick - 1)),
                    Lost => prop_assert!(false, "everything has arrived"),
                    Corrupted | Damaged => prop_assert!(false, "no bit flips"),
                }
                if matches!(delivery, Received | Delayed) {
                    audible.insert(key, tick);
                    expected.insert(key);
                }
            }
            // Messages from the previous step that are still listed had no copy.
            for (&(sender, seq), &at) in &audible {
                prop_assert!(at + 1 != tick || !is_doubled(sender, seq));
            }
            let sorted: Vec<_> = expected.into_iter().collect();
            prop_assert_eq!(inbox(&messages), sorted);
        }
    }

    #[test]
    fn another_link_does_not_change_deliveries(script in script(), other in script(), seed: u64) {
        let mut changed = script.clone();
        for (input, other) in changed.iter_mut().zip(&other) {
            input.senders[1] = other.senders[1];
        }
        let (one, two) = (play(seed, &script), play(seed, &changed));
        prop_assert_eq!(of_sender(0, &one), of_sender(0, &two));
        prop_assert_eq!(&one, &play(seed, &script));
    }

    #[test]
    fn an_added_fault_does_not_change_the_draws(drop in 0.0..1.0_f64, more in 0.0..1.0_f64, delay_ms in 0..500_u64) {
        let dropped = |link: LinkState| {
            let senders = [(1, link, false), (0, LinkState::default(), false)];
            let script = vec![TickInput { senders, present: true }; 200];
            let deliveries = of_sender(0, &play(9, &script)).into_iter();
            let dropped = deliveries.filter(|delivery| delivery.2 == Dropped);
            dropped.map(|delivery| delivery.1).collect::<BTreeSet<_>>()
        };
        let lossy = LinkState { drop: Probability::from_share(drop), ..LinkState::default() };
        let late = LinkState {
            delay: SimTime(delay_ms),
            jitter: SimTime(delay_ms),
            duplicate: Probability::from_share(more),
            reorder: Probability::from_share(more),
            ..lossy
        };
        prop_assert_eq!(dropped(lossy), dropped(late));
        let lossier = LinkState { drop: lossy.drop.or(Probability::from_share(more)), ..late };
        prop_assert!(dropped(lossy).is_subset(&dropped(lossier)));
    }
}
