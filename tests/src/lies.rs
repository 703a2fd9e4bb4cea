//! Broadcasts of a robot that lies: anything that the message types allow, and damaged messages of the fuzzers' corpus.

use proto::codec::decode;
use proto::mission::SharedKnowledge;
use proto::team::{Broadcast, BroadcastContent, Heartbeat, TaskState};
use proto::tick::{Report, TickMessage};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::ids::RobotId;
use scenario::testkit::drawn_unbounded;
use scenario::time::SimTime;

use crate::damage::{self, DAMAGES};

/// The number of lies of a robot.
const LIES: usize = 30;

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

/// Returns the heartbeat of a robot without a task.
#[must_use]
pub fn heartbeat() -> Broadcast {
    Broadcast {
        sender: RobotId(0),
        incarnation: 1,
        tick: 0,
        index: 0,
        seq: 0,
        sent: SimTime::ZERO,
        body: BroadcastContent::Heartbeat(Heartbeat {
            state: TaskState::Idle,
            since: SimTime::ZERO,
            set: None,
            task: None,
            progress: 0,
            position: None,
            carrying: false,
            shared_knowledge: SharedKnowledge::Nothing,
        }),
    }
}

/// Returns the lies that a seed determines. One half is drawn from the type of broadcasts, the other half are messages of
/// any mission and allocator with up to three damages that are still broadcasts.
///
/// # Panics
/// Panics without the corpus.
#[must_use]
pub fn lies(seed: u64) -> Vec<Broadcast> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let decode_corpus = damage::corpus("decode").into_iter();
    let broadcasts = decode_corpus.filter(|(name, _)| name.starts_with("broadcast-"));
    let all: Vec<_> = damage::corpus("received")
        .into_iter()
        .chain(broadcasts)
        .collect();
    let mut lies = Vec::new();
    while lies.len() < LIES {
        let mut bytes = all[rng.random_range(0..all.len())].1.clone();
        damage::apply(&DAMAGES, &mut bytes, 0..4, &mut rng);
        lies.extend(decode(&bytes));
        lies.push(drawn_unbounded(rng.random()));
    }
    lies
}
