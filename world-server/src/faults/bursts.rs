//! Loss bursts: Gilbert's model (1960) with a loss in every bad tick and in no good tick.
//!
//! Each directed link is a Markov chain of two states with one transition per tick. With probability q to leave the bad state
//! and r to enter it, bursts have a mean length of 1/q ticks, and a share r/(r + q) of all ticks is bad. A burst lasts at
//! least one tick. If a share needs r > 1, the bursts get longer.
//!
//! A chain draws one word per tick, with or without messages: the word `fault · 2⁴⁴ + tick` of its link's stream of
//! [`Purpose::Burst`]. The word of the tick in which the fault is applied selects the initial state.

use proto::link::Probability;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use scenario::ids::{RobotId, Tick};
use scenario::rng::{Purpose, link_stream};

use super::schedule::FaultIndex;

/// The bursts of one fault on all directed links among the robots.
#[derive(Clone, Debug)]
pub(super) struct Bursts {
    enter: Probability,
    leave: Probability,
    robots: u32,
    /// The current tick of the chains.
    tick: Tick,
    chains: Vec<Chain>,
}

#[derive(Clone, Debug)]
struct Chain {
    rng: ChaCha8Rng,
    bad: bool,
}

impl Bursts {
    /// Creates the chains of a fault that is applied in `tick`. A `share` of all ticks is bad, in bursts of `mean_ticks`.
    pub fn new(
        seed: u64,
        robots: u32,
        (fault, tick): (FaultIndex, Tick),
        share: f64,
        mean_ticks: f64,
    ) -> Self {
        let leave = 1.0 / mean_ticks.max(1.0);
        let good = 1.0 - share;
        // In the mean as many links enter as leave: good · r = share · q.
        let (enter, leave) = if share * leave <= good {
            (share * leave / good, leave)
        } else {
            (1.0, good / share)
        };
        let share = Probability::from_share(share);
        let links = (0..robots).flat_map(|sender| (0..robots).map(move |to| (sender, to)));
        let chains = links.map(|(sender, receiver)| {
            let mut rng = link_stream(seed, Purpose::Burst, RobotId(sender), RobotId(receiver));
            rng.set_word_pos((fault.0 as u128) << 44 | u128::from(tick));
            let bad = share.hits(rng.next_u32());
            Chain { rng, bad }
        });
        Self {
            enter: Probability::from_share(enter),
            leave: Probability::from_share(leave),
            robots,
            tick,
            chains: chains.collect(),
        }
    }

    /// Advances all chains to `tick`.
    pub fn advance(&mut self, tick: Tick) {
        while self.tick < tick {
            self.tick += 1;
            for chain in &mut self.chains {
                let draw = chain.rng.next_u32();
                chain.bad = if chain.bad {
                    !self.leave.hits(draw)
                } else {
                    self.enter.hits(draw)
                };
            }
        }
    }

    /// Checks whether all messages on the link are lost in this tick.
    pub fn is_bad(&self, sender: RobotId, receiver: RobotId) -> bool {
        self.chains[sender.index() * self.robots as usize + receiver.index()].bad
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SENDER: RobotId = RobotId(0);
    const RECEIVER: RobotId = RobotId(1);

    /// Measures the share of bad ticks and the mean length of a burst on one link.
    fn measure(seed: u64, share: f64, mean_ticks: f64) -> (f64, f64) {
        const TICKS: Tick = 400_000;
        let mut bursts = Bursts::new(seed, 2, (FaultIndex(0), 0), share, mean_ticks);
        let (mut bad, mut began, mut before) = (0, 0, false);
        for tick in 1..=TICKS {
            bursts.advance(tick);
            let now = bursts.is_bad(SENDER, RECEIVER);
            bad += u64::from(now);
            began += u64::from(now && !before);
            before = now;
        }
        (
            bad as f64 / TICKS as f64,
            bad as f64 / f64::max(began as f64, 1.0),
        )
    }

    #[test]
    fn share_and_length_match_the_request() {
        for seed in [1, 2, 3] {
            for (share, mean_ticks) in [(0.15, 10.0), (0.4, 40.0), (0.6, 3.0), (0.3, 1.0)] {
                let (bad, length) = measure(seed, share, mean_ticks);
                assert!((bad - share).abs() < 0.02, "{share} {mean_ticks}: {bad}");
                assert!(
                    (length / mean_ticks - 1.0).abs() < 0.05,
                    "{share} {mean_ticks}: {length}"
                );
            }
        }
    }

    #[test]
    fn a_share_too_large_for_its_bursts_makes_them_longer() {
        let (bad, length) = measure(1, 0.9, 2.0);
        assert!((bad - 0.9).abs() < 0.01, "{bad}");
        assert!((length - 9.0).abs() < 0.3, "{length}");
    }

    #[test]
    fn shares_0_and_1_are_exact() {
        for mean_ticks in [0.0, 1.0, 20.0] {
            assert_eq!(measure(1, 0.0, mean_ticks).0, 0.0);
            assert_eq!(measure(1, 1.0, mean_ticks).0, 1.0);
        }
    }

    #[test]
    fn a_chain_begins_in_its_long_run_state() {
        let bad = (0..4000)
            .filter(|&seed| {
                Bursts::new(seed, 2, (FaultIndex(3), 70), 0.25, 50.0).is_bad(SENDER, RECEIVER)
            })
            .count();
        // The mean is 1000, the standard deviation 27.
        assert!((910..1090).contains(&bad), "{bad}");
    }

    #[test]
    fn each_link_and_each_fault_has_its_own_chains() {
        let course = |fault, sender, receiver| {
            let mut bursts = Bursts::new(1, 3, (FaultIndex(fault), 5), 0.5, 4.0);
            let state = |tick| {
                bursts.advance(tick);
                bursts.is_bad(RobotId(sender), RobotId(receiver))
            };
            (6..200).map(state).collect::<Vec<_>>()
        };
        let courses = [
            course(0, 0, 1),
            course(0, 1, 0),
            course(0, 0, 2),
            course(1, 0, 1),
        ];
        for (place, one) in courses.iter().enumerate() {
            assert!(courses[..place].iter().all(|other| other != one));
        }
        assert_eq!(courses[0], course(0, 0, 1));
    }
}
