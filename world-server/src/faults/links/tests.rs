//! Tests of link faults and of the attribution of deliveries.

use proptest::prelude::*;
use scenario::fault::{
    Corruption, Delay, LinkChance, LinkSelection, Loss, Partition, RadioQuality, RangeFault,
};
use scenario::testkit::default_setup;

use super::*;

use Delivery::{Corrupted, Cut, Damaged, Delayed, Dropped, Duplicate, Lost, Pending, Received};

const BLUE: RobotId = RobotId(0);
const GOLD: RobotId = RobotId(1);
const GREEN: RobotId = RobotId(2);

const NONE: [usize; 0] = [];

fn who(name: &str) -> LinkEnd {
    name.to_owned().into()
}

fn dropping(from: &str, to: &str, p: f64, burst_s: f64) -> Fault {
    Fault::Drop(Loss {
        from: who(from),
        to: who(to),
        p,
        burst_s,
    })
}

fn chance(from: &str, to: &str, p: f64) -> LinkChance {
    LinkChance {
        from: who(from),
        to: who(to),
        p,
    }
}

fn delaying(delay_s: f64, jitter_s: f64) -> Fault {
    Fault::Delay(Delay {
        from: LinkEnd::All,
        to: LinkEnd::All,
        delay_s,
        jitter_s,
    })
}

fn partition(groups: &[&[&str]], one_way: bool) -> Fault {
    let names = |group: &&[&str]| group.iter().map(|&name| name.to_owned()).collect();
    Fault::Partition(Partition {
        groups: groups.iter().map(names).collect(),
        one_way,
    })
}

fn hold(from: &str, to: &str) -> Fault {
    Fault::Hold(LinkSelection {
        from: who(from),
        to: who(to),
    })
}

/// Returns places in a row, 3 m apart.
fn place(robot: RobotId) -> Vec2 {
    Vec2::new(3.0 * robot.0 as f32, 1.0)
}

fn begin(links: &mut LinkFaults, tick: Tick, faults: &[Fault]) {
    let in_force = faults.iter().enumerate();
    links.begin(
        tick,
        in_force.map(|(index, fault)| (FaultIndex(index), fault)),
        place,
    );
}

fn with(faults: &[Fault]) -> LinkFaults {
    let mut links = LinkFaults::new(&default_setup(1));
    begin(&mut links, 10, faults);
    links
}

fn all_links() -> impl Iterator<Item = (RobotId, RobotId)> {
    let robots = [BLUE, GOLD, GREEN];
    let links = robots
        .into_iter()
        .flat_map(move |from| robots.map(|to| (from, to)));
    links.filter(|(from, to)| from != to)
}

fn held(links: &LinkFaults, receiver: RobotId) -> Vec<RobotId> {
    // Earlier contents are removed.
    let mut held = vec![receiver];
    links.write_held_senders(receiver, &mut held);
    held
}

/// Returns the directed links that the fault cuts.
fn cut(fault: Fault) -> Vec<(RobotId, RobotId)> {
    let links = with(&[fault]);
    let cut = LinkState {
        cut: true,
        ..LinkState::default()
    };
    all_links()
        .filter(|&(from, to)| match links.state(from, to) {
            Some(state) => {
                assert_eq!(state, cut);
                true
            }
            None => false,
        })
        .collect()
}

#[test]
fn links_without_faults_are_clear() {
    let links = with(&[Fault::Kill("blue".to_owned()), delaying(0.0, 0.0)]);
    assert!(all_links().all(|(from, to)| links.state(from, to).is_none()));
    assert_eq!(held(&links, BLUE), []);
}

#[test]
fn each_fault_cuts_the_expected_links() {
    assert_eq!(
        cut(Fault::Mute("gold".to_owned())),
        [(GOLD, BLUE), (GOLD, GREEN)]
    );
    assert_eq!(
        cut(Fault::Deaf("gold".to_owned())),
        [(BLUE, GOLD), (GREEN, GOLD)]
    );
    assert_eq!(
        cut(partition(&[&["blue", "gold"], &["green"]], false)),
        [(BLUE, GREEN), (GOLD, GREEN), (GREEN, BLUE), (GREEN, GOLD)]
    );
    // Later groups still receive from earlier groups. Green is in no group.
    assert_eq!(
        cut(partition(&[&["gold"], &["blue"]], true)),
        [(BLUE, GOLD)]
    );
    assert_eq!(
        cut(Fault::Range(RangeFault { range_m: 3.0 })),
        [(BLUE, GREEN), (GREEN, BLUE)]
    );
    assert_eq!(cut(Fault::Range(RangeFault { range_m: 6.0 })), []);
}

#[test]
fn a_fault_affects_only_its_own_links() {
    let links = with(&[
        dropping("green", "all", 0.3, 0.0),
        Fault::Reorder(chance("all", "gold", 0.25)),
        Fault::Duplicate(chance("blue", "green", 1.0)),
    ]);
    let drop = Probability::from_share(0.3);
    let reorder = Probability::from_share(0.25);
    let clear = LinkState::default();
    let expected = [
        ((BLUE, GOLD), LinkState { reorder, ..clear }),
        (
            (BLUE, GREEN),
            LinkState {
                duplicate: Probability::ALWAYS,
                ..clear
            },
        ),
        ((GREEN, BLUE), LinkState { drop, ..clear }),
        (
            (GREEN, GOLD),
            LinkState {
                drop,
                reorder,
                ..clear
            },
        ),
    ];
    let states: Vec<_> = all_links()
        .filter_map(|link| Some((link, links.state(link.0, link.1)?)))
        .collect();
    assert_eq!(states, expected);
}

#[test]
fn faults_add_up_and_end() {
    let faults = [
        dropping("all", "all", 0.5, 0.0),
        dropping("blue", "gold", 0.5, 0.0),
        delaying(1.5, 0.25),
        delaying(0.1, 0.0),
    ];
    let mut links = with(&faults);
    let state = links.state(BLUE, GOLD).unwrap();
    assert_eq!(state.drop, Probability::from_share(0.75));
    assert_eq!((state.delay, state.jitter), (SimTime(1600), SimTime(250)));
    begin(&mut links, 11, &faults[..1]);
    let state = links.state(BLUE, GOLD).unwrap();
    assert_eq!(state.drop, Probability::from_share(0.5));
    assert_eq!(state.delay, SimTime(0));
    begin(&mut links, 12, &[]);
    assert_eq!(links.state(BLUE, GOLD), None);
}

#[test]
fn a_radio_quality_applies_its_terms_to_all_links() {
    let good = with(&[Fault::Radio(RadioQuality::GoodRadio)]);
    let expected = LinkState {
        drop: Probability::from_share(0.01),
        delay: SimTime(20),
        jitter: SimTime(30),
        ..LinkState::default()
    };
    assert!(all_links().all(|(from, to)| good.state(from, to) == Some(expected)));
    let severe = with(&[Fault::Radio(RadioQuality::SevereRadio)]);
    for (from, to) in all_links() {
        let state = severe.state(from, to).unwrap();
        assert!([Probability::NEVER, Probability::ALWAYS].contains(&state.drop));
        assert_eq!((state.delay, state.jitter), (SimTime(300), SimTime(1200)));
        assert_eq!(state.duplicate, Probability::from_share(0.05));
        assert_eq!(state.reorder, Probability::from_share(0.05));
    }
}

#[test]
fn held_senders_are_listed_until_the_fault_heals() {
    let mut links = with(&[hold("all", "blue"), hold("gold", "green")]);
    assert_eq!(held(&links, BLUE), [GOLD, GREEN]);
    assert_eq!(held(&links, GOLD), []);
    assert_eq!(held(&links, GREEN), [GOLD]);
    assert!(links.state(GOLD, BLUE).unwrap().hold);
    begin(&mut links, 11, &[]);
    assert_eq!(held(&links, BLUE), []);
}

/// Returns for each tick from 100 on whether a bursty fault makes a link bad.
fn course(seed: u64, link: (RobotId, RobotId), p: f64, burst_s: f64, ticks: Tick) -> Vec<bool> {
    let fault = [dropping("all", "all", p, burst_s)];
    let mut links = LinkFaults::new(&default_setup(seed));
    (100..100 + ticks)
        .map(|tick| {
            begin(&mut links, tick, &fault);
            // The second call is as after an order in the same tick.
            begin(&mut links, tick, &fault);
            let state = links.state(link.0, link.1).unwrap_or_default();
            assert!([Probability::NEVER, Probability::ALWAYS].contains(&state.drop));
            state.drop == Probability::ALWAYS
        })
        .collect()
}

#[test]
fn bursts_have_their_share_and_their_length_in_seconds() {
    for seed in [1, 2, 3] {
        let bad = course(seed, (BLUE, GOLD), 0.3, 1.0, 100_000);
        let count = bad.iter().filter(|&&bad| bad).count();
        let bursts = bad.chunk_by(|a, b| a == b).filter(|run| run[0]).count();
        // The mean burst is 20 ticks long.
        let (share, length) = (count as f64 / 1e5, count as f64 / bursts as f64);
        assert!((share - 0.3).abs() < 0.03, "{share}");
        assert!((length - 20.0).abs() < 1.5, "{length}");
    }
}

proptest! {
    #[test]
    fn bursts_are_the_same_in_every_replay(seed: u64, p in 0.0..=1.0_f64, burst_s in 0.01..3.0_f64) {
        let one = course(seed, (BLUE, GOLD), p, burst_s, 50);
        prop_assert_eq!(&one, &course(seed, (BLUE, GOLD), p, burst_s, 50));
        // Other faults and missing queries change nothing.
        let faults = [dropping("all", "all", p, burst_s), dropping("all", "all", 0.0, 1.0)];
        let mut links = LinkFaults::new(&default_setup(seed));
        for tick in 100..150 {
            begin(&mut links, tick, &faults);
        }
        let bad = links.state(BLUE, GOLD).is_some();
        prop_assert_eq!(one.last(), Some(&bad));
    }
}

fn reception(sender: RobotId, sent_tick: Tick, delivery: Delivery) -> Reception {
    Reception {
        at: SimTime(0),
        sender,
        incarnation: 1,
        sent: SimTime(sent_tick * 50),
        delivery,
        content: None,
    }
}

fn causes(links: &LinkFaults, sender: RobotId, sent_tick: Tick, delivery: Delivery) -> Vec<usize> {
    let reception = reception(sender, sent_tick, delivery);
    let causes = links.causes(BLUE, &reception);
    causes.map(|fault| fault.0).collect()
}

#[test]
fn each_delivery_is_attributed_to_its_possible_faults() {
    let links = with(&[
        dropping("gold", "blue", 0.3, 0.0),
        dropping("green", "blue", 0.3, 0.0),
        delaying(0.0, 0.1),
        Fault::Reorder(chance("gold", "blue", 0.5)),
        Fault::Duplicate(chance("gold", "all", 0.5)),
        partition(&[&["blue"], &["gold"]], false),
        Fault::Mute("gold".to_owned()),
        Fault::Deaf("gold".to_owned()),
    ]);
    assert_eq!(causes(&links, GOLD, 9, Dropped), [0]);
    assert_eq!(causes(&links, GREEN, 9, Dropped), [1]);
    assert_eq!(causes(&links, GOLD, 9, Pending), [2, 3]);
    assert_eq!(causes(&links, GREEN, 9, Pending), [2]);
    assert_eq!(causes(&links, GOLD, 9, Cut), [5, 6]);
    for delivery in [Received, Lost, Delayed] {
        assert_eq!(causes(&links, GOLD, 9, delivery), NONE);
    }
    // The message was sent earlier and kept; it is due while the receiver is out.
    assert_eq!(causes(&links, GOLD, 7, Cut), NONE);
}

#[test]
fn burst_losses_are_attributed_to_the_burst_and_holds_precede_delays() {
    let links = with(&[
        dropping("all", "all", 1.0, 2.0),
        dropping("all", "all", 0.0, 2.0),
        delaying(1.0, 0.0),
        hold("gold", "blue"),
    ]);
    assert_eq!(causes(&links, GOLD, 9, Dropped), [0]);
    assert_eq!(causes(&links, GOLD, 9, Pending), [3]);
    assert_eq!(causes(&links, GREEN, 9, Pending), [2]);
}

#[test]
fn a_duplicate_is_attributed_to_the_faults_in_force_when_its_message_was_listed() {
    let faults = [
        Fault::Duplicate(chance("all", "all", 0.5)),
        Fault::Radio(RadioQuality::SevereRadio),
    ];
    let mut links = with(&faults);
    begin(&mut links, 20, &faults[..1]);
    begin(&mut links, 30, &[]);
    let copy = |links: &LinkFaults, sent_tick| {
        let mut causes = causes(links, GOLD, sent_tick, Duplicate);
        causes.sort_unstable();
        causes
    };
    // The faults are in force in ticks 10 to 19 and 10 to 29. A manifest lists the messages of the tick before.
    assert_eq!(copy(&links, 8), NONE);
    assert_eq!(copy(&links, 9), [0, 1]);
    assert_eq!(copy(&links, 18), [0, 1]);
    assert_eq!(copy(&links, 19), [0]);
    assert_eq!(copy(&links, 28), [0]);
    assert_eq!(copy(&links, 29), NONE);
    // The first fault is in force again.
    begin(&mut links, 40, &faults[..1]);
    assert_eq!(copy(&links, 28), [0]);
    assert_eq!(copy(&links, 38), NONE);
    assert_eq!(copy(&links, 39), [0]);
}

#[test]
fn damage_is_attributed_to_its_fault_also_when_it_arrives_late() {
    let corrupt = |to: &str, checksum| {
        Fault::Corrupt(Corruption {
            from: LinkEnd::All,
            to: who(to),
            p: 0.25,
            checksum,
        })
    };
    let faults = [corrupt("blue", false), corrupt("all", true)];
    let mut links = with(&faults);
    let state = links.state(GOLD, BLUE).unwrap();
    assert_eq!(state.corrupt, Probability::from_share(0.375));
    assert!(
        state.checksum,
        "one of the faults leaves the checksum intact"
    );
    assert_eq!(causes(&links, GOLD, 9, Corrupted), [0, 1]);
    assert!(!with(&faults[..1]).state(GOLD, BLUE).unwrap().checksum);
    assert_eq!(with(&faults[..1]).state(GOLD, GREEN), None);
    begin(&mut links, 20, &[]);
    assert_eq!(causes(&links, GOLD, 9, Damaged), [0, 1]);
    assert_eq!(causes(&links, GOLD, 19, Damaged), NONE);
    assert_eq!(causes(&links, GOLD, 9, Corrupted), NONE);
}

#[test]
fn in_order_stepping_delivers_to_later_robots_in_the_same_tick() {
    let mut setup = default_setup(1);
    setup.step_order = StepOrder::InOrder;
    let mut links = LinkFaults::new(&setup);
    begin(&mut links, 10, &[Fault::Deaf("gold".to_owned())]);
    let causes = |sender, sent_tick| {
        let reception = reception(sender, sent_tick, Cut);
        links.causes(GOLD, &reception).count()
    };
    assert_eq!(causes(BLUE, 10), 1);
    assert_eq!(causes(BLUE, 9), 0);
    assert_eq!(causes(GREEN, 9), 1);
    assert_eq!(causes(GREEN, 10), 0);
}

#[test]
fn a_periodic_fault_needs_bounded_memory_and_its_latest_duplicates_are_attributed() {
    const PERIODS: Tick = 2000;
    let fault = [Fault::Duplicate(chance("gold", "blue", 0.5))];
    let mut links = LinkFaults::new(&default_setup(1));
    for period in 0..PERIODS {
        begin(&mut links, 10 * period, &fault);
        begin(&mut links, 10 * period + 5, &[]);
    }
    let ranges: usize = links
        .healed
        .iter()
        .map(|healed| healed.in_force.len())
        .sum();
    assert_eq!((links.healed.len(), ranges), (1, MAX_RANGES));
    // A message is listed in the tick after its own.
    let last = 10 * (PERIODS - 1);
    assert_eq!(causes(&links, GOLD, last, Duplicate), [0]);
    assert_eq!(causes(&links, GOLD, last - 10 * 200, Duplicate), [0]);
    assert_eq!(
        causes(&links, GOLD, last + 5, Duplicate),
        NONE,
        "between two periods"
    );
}
