//! Messages on their way: one row each, when all is said about it.

use super::*;

/// A reception of gold's `seq`-th message by blue.
fn reception(seq: u64, at_ms: u64, delivery: Delivery) -> Reception {
    Reception {
        at: SimTime(at_ms),
        sender: GOLD,
        incarnation: 1,
        sent: SimTime(0),
        delivery,
        said: Some(Said {
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

/// Ticks in which blue, in these lives, reports these receptions and nothing else happens.
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

/// Time, receiver, number and fate of each row, read back from a log that is whole to its end.
fn rows(ticks: &[OwnedTick]) -> Vec<(u64, String, u64, String)> {
    let (run, memory) = log(LogLevel::Full, ticks);
    let lines = text_lines(&memory.tables[&Table::Messages]);
    let log = RunLog::from_tables(Path::new(""), run, memory.tables);
    let last = log.last.expect("a seal");
    assert_eq!(last.tick, ticks.len() as u64 - 1);
    assert_eq!(Some(format!("{:016x}", last.hash)), log.run.hash);
    let rows: Vec<MessageRow> = log.rows().unwrap();
    assert_eq!(rows.len() + 1, lines, "with the header line");
    let brief = |row: MessageRow| (row.t_ms.0, row.receiver, row.seq.unwrap(), row.fate);
    rows.into_iter().map(brief).collect()
}

fn row(t_ms: u64, seq: u64, fate: &str) -> (u64, String, u64, String) {
    (t_ms, "blue".to_owned(), seq, fate.to_owned())
}

#[test]
fn a_late_message_has_its_row_when_it_is_heard_or_missed() {
    let ticks = ticks([
        (
            1,
            vec![
                reception(0, 50, Delivery::Pending),
                reception(1, 0, Delivery::Heard),
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
            row(0, 1, "heard"),
            row(0, 3, "cut"),
            row(50, 1, "duplicate"),
            row(100, 2, "delayed"),
            row(50, 0, "cut"),
        ]
    );
    let figures = log(LogLevel::Off, &ticks).0.result.robots["blue"].clone();
    assert_eq!((figures.messages_heard, figures.messages_lost), (2, 2));
    assert_eq!(
        (figures.messages_delayed, figures.messages_duplicate),
        (1, 1)
    );
}

#[test]
fn what_is_on_its_way_to_a_robot_that_dies_is_pending_then() {
    let pending = |seq| vec![reception(seq, 500, Delivery::Pending)];
    let mut ticks = ticks([
        (1, pending(0)),
        (1, pending(1)),
        (2, pending(0)),
        (2, vec![]),
    ]);
    // Another robot's death, and an earlier incarnation's, are not blue's.
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
fn what_is_on_its_way_when_the_run_ends_is_pending_then() {
    let ticks = ticks([
        (1, vec![reception(0, 500, Delivery::Pending)]),
        (1, vec![reception(1, 50, Delivery::Heard)]),
    ]);
    assert_eq!(rows(&ticks), [row(50, 1, "heard"), row(500, 0, "pending")]);
}

#[test]
fn a_pending_message_is_in_the_hash_at_every_level() {
    let hash = |level, fate| {
        let ticks = ticks([(1, vec![reception(0, 50, fate)])]);
        log(level, &ticks).0.hash.unwrap()
    };
    let full = hash(LogLevel::Full, Delivery::Pending);
    assert_eq!(full, hash(LogLevel::Off, Delivery::Pending));
    assert_ne!(full, hash(LogLevel::Full, Delivery::Heard));
}
