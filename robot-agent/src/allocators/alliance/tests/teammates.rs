//! The activities that received messages imply for a teammate.

use super::*;
use crate::allocators::alliance::teammates::Teammates;

use TaskState::{Executing, Idle, Released, Waiting};

const TAU: SimTime = SimTime(5000);

/// A message of gold: (incarnation, sequence number, state, task).
type Message = (u32, u64, TaskState, usize);

/// Returns gold's activity on move(top) after these messages: (executes, waits).
fn after(messages: &[Message], now: u64) -> (bool, bool) {
    let mut teammates = Teammates::default();
    for &(incarnation, seq, state, index) in messages {
        let mut message = heartbeat(GOLD, seq, ms(1000), state, ms(500), index);
        message.incarnation = incarnation;
        teammates.receive(ms(1000), &message, |_| true);
    }
    let executes = teammates.is_occupied(task(TOP), 1, TAU, ms(now));
    let has_turn = teammates.has_place_for((ms(800), GREEN), task(TOP), 1, TAU, ms(now));
    (executes, !executes && !has_turn)
}

#[test]
fn the_latest_message_decides() {
    let executes = (true, false);
    let waits = (false, true);
    let neither = (false, false);
    let table: [(&[Message], _); 18] = [
        (&[], neither),
        (&[(1, 0, Executing, TOP)], executes),
        (&[(1, 0, Executing, BOTTOM)], neither),
        (&[(1, 0, Waiting, TOP)], waits),
        (&[(1, 0, Waiting, BOTTOM)], neither),
        (&[(1, 0, Executing, TOP), (1, 1, Waiting, TOP)], waits),
        (&[(1, 0, Executing, TOP), (1, 1, Waiting, BOTTOM)], neither),
        (
            &[(1, 0, Executing, TOP), (1, 1, Released, BOTTOM)],
            executes,
        ),
        (&[(1, 0, Executing, TOP), (1, 1, Idle, TOP)], neither),
        (&[(1, 0, Waiting, TOP), (1, 1, Executing, TOP)], executes),
        (&[(1, 0, Waiting, TOP), (1, 1, Executing, BOTTOM)], neither),
        (&[(1, 0, Waiting, TOP), (1, 1, Waiting, BOTTOM)], waits),
        (&[(1, 0, Waiting, TOP), (1, 1, Released, TOP)], neither),
        (&[(1, 0, Waiting, TOP), (1, 1, Released, BOTTOM)], waits),
        (&[(1, 0, Waiting, TOP), (1, 1, Idle, TOP)], neither),
        (&[(1, 5, Executing, TOP), (2, 0, Released, BOTTOM)], neither),
        (&[(1, 5, Waiting, TOP), (2, 0, Released, BOTTOM)], neither),
        // The later message arrives first.
        (&[(1, 1, Executing, TOP), (1, 0, Idle, TOP)], executes),
    ];
    for (messages, expected) in table {
        assert_eq!(after(messages, 1000), expected, "{messages:?}");
    }
}

#[test]
fn a_message_is_valid_for_tau() {
    for state in [Executing, Waiting] {
        assert_ne!(after(&[(1, 0, state, TOP)], 5999), (false, false));
        assert_eq!(after(&[(1, 0, state, TOP)], 6000), (false, false));
    }
}

#[test]
fn wishes_are_ordered_by_age_and_then_by_rank() {
    let mut teammates = Teammates::default();
    let wish = heartbeat(GOLD, 1, ms(1000), Waiting, ms(500), TOP);
    teammates.receive(ms(1000), &wish, |_| true);
    let table = [
        ((499, GREEN), true),
        ((500, BLUE), true),
        ((500, GREEN), false),
        ((501, BLUE), false),
    ];
    for ((since, robot), has_turn) in table {
        let wish = (ms(since), robot);
        assert_eq!(
            teammates.has_place_for(wish, task(TOP), 1, TAU, ms(1000)),
            has_turn
        );
        // With two places, one earlier wish does not matter.
        assert!(teammates.has_place_for(wish, task(TOP), 2, TAU, ms(1000)));
    }
}
