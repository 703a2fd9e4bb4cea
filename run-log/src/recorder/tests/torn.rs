//! Logs of killed processes, full disks and damaged files are complete up to a tick and readable.

use scenario::testkit::default_setup;
use std::collections::BTreeMap;

use crate::{AllocationRow, ExternalAnswer, InputLine, TableRow};
use proptest::prelude::*;
use proto::mission::Payload;
use proto::team::{BroadcastContent, Bulletin, BulletinKind};
use proto::telemetry;
use serde::Deserialize;

use super::*;

/// The columns of mission.csv of the drill.
#[derive(Clone, Debug, PartialEq, Deserialize)]
struct DrillRow {
    t_ms: SimTime,
    left: u32,
    held: u32,
    lost: u32,
    done: u32,
    last_ms: Option<SimTime>,
}

impl TableRow for DrillRow {
    const TABLE: Table = Table::Mission;
}

type Rows = (
    Vec<MotivationRow>,
    Vec<AllocationRow>,
    Vec<MessageRow>,
    Vec<SentRow>,
    Vec<HitRow>,
    Vec<EventRow>,
    Vec<PoseRow>,
    Vec<DrillRow>,
    Vec<TickRow>,
    Vec<InputLine>,
    Vec<ExternalAnswer>,
);

fn all_rows(log: &RunLog) -> Rows {
    (
        log.rows().unwrap(),
        log.rows().unwrap(),
        log.rows().unwrap(),
        log.rows().unwrap(),
        log.rows().unwrap(),
        log.rows().unwrap(),
        log.rows().unwrap(),
        log.rows().unwrap(),
        log.rows().unwrap(),
        log.inputs().unwrap(),
        log.external_answers().unwrap(),
    )
}

/// Returns a run of more than a second whose tables grow in some ticks only. Gold has no motivations and an external controller.
/// Its two broadcasts arrive in reverse order, and the second arrives twice.
pub fn run_of(ticks: usize) -> Vec<OwnedTick> {
    let mut kinds = sample();
    for kind in &mut kinds {
        kind.external = vec![false, true];
    }
    let broadcast = |index, byte| Broadcast {
        sender: GOLD,
        incarnation: 1,
        tick: 1,
        index,
        seq: u64::from(index),
        sent: SimTime(50),
        body: BroadcastContent::Bulletin(Bulletin {
            kind: BulletinKind::First,
            about: None,
            payload: Payload::Open(vec![byte; 30]),
        }),
    };
    kinds[1].broadcasts = vec![broadcast(1, 1), broadcast(0, 0), broadcast(1, 2)];
    kinds[1].hits = vec![FaultHits {
        fault: "f1".to_owned(),
        count: 3,
    }];
    let (_, gold) = kinds[1].robots[1].1.as_mut().unwrap();
    gold.broadcasts = 2;
    gold.allocation = vec![telemetry::AllocationRow {
        task: TaskId(1),
        behavior: BehaviorId(2),
        utility: 0.5,
        holder: Some(BLUE),
        state: BehaviorState::Hibernating,
    }];
    (0..ticks)
        .map(|tick| OwnedTick {
            tick: tick as u64,
            now: SimTime(tick as u64 * 400),
            ..kinds[[0, 2, 1, 2][tick % 4]].clone()
        })
        .collect()
}

/// Returns the logs of the run's first 0, 1, … `ticks` ticks, as files and as rows.
fn prefixes(level: LogLevel, ticks: usize) -> Vec<(BTreeMap<Table, Vec<u8>>, Rows)> {
    let ticks = run_of(ticks);
    (0..=ticks.len())
        .map(|end| {
            let (run, memory) = log(level, &ticks[..end]);
            let mut tables = memory.tables;
            // These files do not exist before their first row.
            for table in [
                Table::Inputs,
                Table::Allocation,
                Table::Sent,
                Table::Hits,
                Table::External,
            ] {
                tables.entry(table).or_default();
            }
            let rows = all_rows(&RunLog::from_tables(Path::new(""), run, tables.clone()));
            (tables, rows)
        })
        .collect()
}

/// Checks that a log is complete up to a number of ticks.
fn assert_ticks(log: &RunLog, ticks: usize, prefixes: &[(BTreeMap<Table, Vec<u8>>, Rows)]) {
    let last = log.last.map(|seal| seal.tick);
    assert_eq!(last, (ticks as u64).checked_sub(1));
    assert_eq!(all_rows(log), prefixes[ticks].1);
}

#[test]
fn any_file_cut_or_damaged_at_any_byte() {
    for level in [LogLevel::Full, LogLevel::Compact] {
        check_cut_and_damaged(level);
    }
}

fn check_cut_and_damaged(level: LogLevel) {
    let (mut run, _) = log(level, &[]);
    run.outcome = RunOutcome::Running;
    let prefixes = prefixes(level, 4);
    let whole = &prefixes[4].0;
    for &table in whole.keys() {
        for byte in 0..=whole[&table].len() {
            let mut tables = whole.clone();
            let bytes = tables.get_mut(&table).unwrap();
            // A damaged ticks.csv is not tested, because no hash covers it.
            if byte < bytes.len() && table != Table::Ticks {
                bytes[byte] ^= 1;
            } else {
                bytes.truncate(byte);
            }
            let log = RunLog::from_tables(Path::new(""), run.clone(), tables);
            let ticks = prefixes
                .iter()
                .rposition(|(tables, _)| tables[&table].len() <= byte);
            assert_ticks(&log, ticks.unwrap_or(0), &prefixes);
            if table != Table::Ticks {
                assert_eq!(log.torn, (ticks != Some(4)).then_some(table));
            }
        }
    }
}

/// A sink that fails after a number of bytes, like that of a killed process.
pub struct Dying {
    pub memory: MemoryLog,
    pub bytes_left: usize,
}

impl Sink for Dying {
    fn append(&mut self, table: Table, bytes: &[u8]) -> Result<(), RecordError> {
        let end = bytes.len().min(self.bytes_left);
        self.bytes_left -= end;
        self.memory.append(table, &bytes[..end])?;
        if end < bytes.len() {
            return Err(RecordError::Broken);
        }
        Ok(())
    }

    fn replace(&mut self, document: Document, text: &str) -> Result<(), RecordError> {
        self.memory.replace(document, text)
    }
}

proptest! {
    #[test]
    fn killed_at_any_byte(
        fraction in 0.0..1.0_f64,
        flush_every in 1..4_usize,
        level in prop::sample::select(vec![LogLevel::Full, LogLevel::Compact, LogLevel::Summary]),
    ) {
        let ticks = run_of(12);
        let total: usize = log(level, &ticks).1.tables.values().map(Vec::len).sum();
        let bytes = (fraction * total as f64) as usize;
        let mut recorder = Recorder::new(&default_setup(7), level, MemoryLog::default()).unwrap();
        let mut run = recorder.finish(Outcome::Interrupted, Ending::default()).unwrap();
        run.outcome = RunOutcome::Running;

        let sink = Dying { memory: MemoryLog::default(), bytes_left: bytes };
        let mut flushed = 0;
        let memory = match Recorder::new(&default_setup(7), level, sink) {
            // Failed in the header lines. `any_file_cut_or_damaged_at_any_byte` covers such logs.
            Err(_) => return Ok(()),
            Ok(mut recorder) => {
                for tick in &ticks {
                    if tick.record(&mut recorder).is_err() {
                        break;
                    }
                    if (tick.tick as usize + 1).is_multiple_of(flush_every) {
                        if recorder.flush().is_err() {
                            break;
                        }
                        flushed = tick.tick as usize + 1;
                    }
                }
                recorder.into_sink().memory
            }
        };
        let torn = read(run, memory);
        let ticks_left = torn.last.map_or(0, |seal| seal.tick as usize + 1);
        // Everything flushed is present, except ticks that a summary had not sealed yet.
        let second = |tick: usize| ticks[tick].now.0 / 1000;
        let is_sealed = |&tick: &usize| level.has_every_tick() || tick == 0 || second(tick) != second(tick - 1);
        let sealed = (0..flushed).rev().find(is_sealed);
        prop_assert!(ticks_left >= sealed.map_or(0, |tick| tick + 1));
        let (run, memory) = log(level, &ticks[..ticks_left]);
        let expected = read(run, memory);
        prop_assert_eq!(torn.last, expected.last);
        prop_assert_eq!(all_rows(&torn), all_rows(&expected));
    }
}

#[test]
fn no_bytes_follow_a_torn_row() {
    let sink = Dying {
        memory: MemoryLog::default(),
        bytes_left: 2000,
    };
    let mut recorder = Recorder::new(&default_setup(7), LogLevel::Full, sink).unwrap();
    for tick in run_of(4) {
        tick.record(&mut recorder).unwrap();
    }
    assert!(recorder.flush().is_err());
    recorder.sink.bytes_left = usize::MAX;
    let torn = recorder.sink.memory.clone();
    assert!(matches!(recorder.flush(), Err(RecordError::Broken)));
    assert!(
        recorder
            .finish(Outcome::TimeLimit, Ending::default())
            .is_err()
    );
    assert_eq!(recorder.sink.memory, torn);
}

#[test]
fn a_folder_reads_like_memory() {
    let path = tempfile::tempdir().unwrap();
    let folder = Folder::create(path.path()).unwrap();
    let mut recorder = Recorder::new(&default_setup(7), LogLevel::Full, folder).unwrap();
    for tick in sample() {
        tick.record(&mut recorder).unwrap();
    }
    recorder
        .write_host(&serde_json::json!({"pids": {"blue": 42}}))
        .unwrap();
    let run = recorder
        .finish(Outcome::TimeLimit, Ending::default())
        .unwrap();

    let (expected, memory) = log(LogLevel::Full, &sample());
    assert_eq!(run, expected);
    for (table, bytes) in &memory.tables {
        assert_eq!(
            &std::fs::read(path.path().join(table.file_name())).unwrap(),
            bytes
        );
    }
    let opened = RunLog::open(path.path(), &scenario::testkit::vocabulary()).unwrap();
    assert_eq!(opened.run, expected);
    assert_eq!(all_rows(&opened), all_rows(&read(run, memory)));

    let mut names: Vec<_> = std::fs::read_dir(path.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(
        names,
        [
            "events.csv",
            "host.json",
            "inputs.jsonl",
            "logs",
            "messages.csv",
            "mission.csv",
            "motivations.csv",
            "poses.csv",
            "run.json",
            "sent.csv",
            "ticks.csv",
        ]
    );
}

#[test]
fn answers_of_an_external_controller_are_logged_at_any_level_with_their_broadcasts() {
    let ticks = run_of(3);
    for level in [LogLevel::Full, LogLevel::Summary, LogLevel::Off] {
        let (run, memory) = log(level, &ticks);
        let answers = read(run, memory).external_answers();
        let answers = answers.unwrap();
        let (tick_1, _) = (&ticks[2], assert_eq!(answers.len(), 3));
        let (_, report) = tick_1.robots[1].1.as_ref().unwrap();
        assert_eq!(&answers[2].report, report);
        let broadcasts: Vec<_> = answers[2].broadcasts.iter().flatten().collect();
        assert_eq!(broadcasts, [&tick_1.broadcasts[1], &tick_1.broadcasts[0]]);
    }
}

#[test]
fn a_folder_holds_one_run() {
    let path = tempfile::tempdir().unwrap();
    let folder = Folder::create(path.path()).unwrap();
    Recorder::new(&default_setup(7), LogLevel::Off, folder).unwrap();
    let error = Folder::create(path.path()).unwrap_err();
    assert_eq!(
        error.to_string(),
        format!("{} already holds a run", path.path().display())
    );
}

#[test]
fn a_log_that_is_off_has_complete_inputs() {
    let (run, memory) = log(LogLevel::Off, &sample());
    let lines = memory.tables[&Table::Inputs].clone();
    let torn = BTreeMap::from([(Table::Inputs, lines[..lines.len() - 1].to_vec())]);
    let log = RunLog::from_tables(Path::new(""), run, torn);
    assert_eq!(log.last, None);
    assert_eq!(log.inputs().unwrap().len(), 3);
}

#[test]
fn an_error_names_the_file_that_is_not_a_run() {
    let path = tempfile::tempdir().unwrap();
    let run_json = path.path().join("run.json");
    let error = |folder: &Path| {
        let opened = RunLog::open(folder, &scenario::testkit::vocabulary());
        opened.unwrap_err().to_string()
    };
    let name = path.path().display();
    let expected = format!("{name} is not the folder of a run: it has no run.json");
    assert_eq!(error(path.path()), expected);
    let expected = format!("{name}/no is not the folder of a run: there is no such folder");
    assert_eq!(error(&path.path().join("no")), expected);
    std::fs::write(&run_json, "{\"version\"").unwrap();
    let place = format!("{}: ", run_json.display());
    assert!(error(path.path()).starts_with(&place));
}
