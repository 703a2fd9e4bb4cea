//! Messages in flight have one row, written when the delivery is final.

use super::*;

/// Returns a reception of gold's `seq`-th message by blue.
fn reception(seq: u64, at_ms: u64, delivery: Delivery) -> Reception {
    Reception {
        at: SimTime(at_ms),
        sender: GOLD,
        incarnation: 1,
        sent: SimTime(0),
        delivery,
        content: Some(BroadcastSummary {
            seq,
            kind: BroadcastKind::Heartbeat,
            state: None,
            since: None,
            set: None,
            task: None,
            progress: None,
        }),
    }
}

/// Returns ticks in which blue, in the given incarnation, reports these receptions and nothing else happens.
fn ticks<const N: usize>(receptions: [(u32, Vec<Reception>); N]) -> Vec<OwnedTick> {
    let quiet = &sample()[2];
    (0..)
        .zip(receptions)
        .map(|(tick, (incarnation, receptions))| {
            let mut owned = OwnedTick {
                tick,
                now: SimTime(tick * 50),
                ..quiet.clone()
            };
            let (_, report) = owned.blue();
            report.incarnation = incarnation;
            report.receptions = receptions;
            owned
        })
        .collect()
}

fn death(robot: &str, incarnation: u32) -> Input {
    Input::Gone {
        robot: robot.to_owned(),
        incarnation,
        last_counted: None,
        listed: true,
        moment: None,
        scripted: false,
    }
}

fn text_lines(bytes: &[u8]) -> usize {
    bytes.split_inclusive(|&byte| byte == b'\n').count()
}

/// Returns time, receiver, sequence number and delivery of each row of a complete log.
fn rows(ticks: &[OwnedTick]) -> Vec<(u64, String, u64, String)> {
    let (run, memory) = log(LogLevel::Full, ticks);
    let lines = text_lines(&memory.tables[&Table::Messages]);
    let log = read(run, memory);
    let last = log.last.expect("a seal");
    assert_eq!(last.tick, ticks.len() as u64 - 1);
    assert_eq!(Some(format!("{:016x}", last.hash)), log.run.hash);
    let rows: Vec<MessageRow> = log.rows().unwrap();
    assert_eq!(rows.len() + 1, lines, "with the header line");
    let columns = |row: MessageRow| (row.t_ms.0, row.receiver, row.seq.unwrap(), row.delivery);
    rows.into_iter().map(columns).collect()
}

fn row(t_ms: u64, seq: u64, delivery: &str) -> (u64, String, u64, String) {
    (t_ms, "blue".to_owned(), seq, delivery.to_owned())
}

#[test]
fn a_delayed_message_has_its_row_when_it_is_delivered_or_cut() {
    let ticks = ticks([
        (
            1,
            vec![
                reception(0, 50, Delivery::Pending),
                reception(1, 0, Delivery::Received),
                reception(2, 50, Delivery::Pending),
                reception(3, 0, Delivery::Cut),
            ],
        ),
        (1, vec![reception(1, 50, Delivery::Duplicate)]),
        (
            1,
            vec![
                reception(2, 100, Delivery::Delayed),
                reception(0, 50, Delivery::Cut),
            ],
        ),
    ]);
    assert_eq!(
        rows(&ticks),
        [
            row(0, 1, "received"),
            row(0, 3, "cut"),
            row(50, 1, "duplicate"),
            row(100, 2, "delayed"),
            row(50, 0, "cut"),
        ]
    );
    let figures = log(LogLevel::Off, &ticks).0.result.robots["blue"].clone();
    assert_eq!((figures.messages_received, figures.messages_lost), (2, 2));
    assert_eq!(
        (figures.messages_delayed, figures.messages_duplicate),
        (1, 1)
    );
}

#[test]
fn messages_in_flight_to_a_dead_robot_stay_pending() {
    let pending = |seq| vec![reception(seq, 500, Delivery::Pending)];
    let mut ticks = ticks([
        (1, pending(0)),
        (1, pending(1)),
        (2, pending(0)),
        (2, vec![]),
    ]);
    // The deaths of another robot and of an earlier incarnation do not concern blue.
    ticks[0].inputs = vec![death("gold", 1)];
    ticks[1].inputs = vec![death("blue", 1)];
    ticks[2].inputs = vec![death("blue", 1)];
    ticks[3].inputs = vec![death("blue", 2)];
    let expected = [
        row(500, 0, "pending"),
        row(500, 1, "pending"),
        row(500, 0, "pending"),
    ];
    assert_eq!(rows(&ticks), expected);
    assert_eq!(rows(&ticks[..2]), expected[..2]);
}

#[test]
fn messages_in_flight_at_the_end_of_the_run_stay_pending() {
    let ticks = ticks([
        (1, vec![reception(0, 500, Delivery::Pending)]),
        (1, vec![reception(1, 50, Delivery::Received)]),
    ]);
    assert_eq!(
        rows(&ticks),
        [row(50, 1, "received"), row(500, 0, "pending")]
    );
}

#[test]
fn a_pending_message_is_in_the_hash_at_every_level() {
    let hash = |level, delivery| {
        let ticks = ticks([(1, vec![reception(0, 50, delivery)])]);
        log(level, &ticks).0.hash.unwrap()
    };
    let full = hash(LogLevel::Full, Delivery::Pending);
    assert_eq!(full, hash(LogLevel::Off, Delivery::Pending));
    assert_ne!(full, hash(LogLevel::Full, Delivery::Received));
}
