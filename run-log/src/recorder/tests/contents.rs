//! The exact contents of all files, and their reading.

use proptest::prelude::*;
use scenario::testkit::default_setup;

use super::*;
use scenario::mission::Target;

fn text(memory: &MemoryLog, table: Table) -> &str {
    std::str::from_utf8(&memory.tables[&table]).unwrap()
}

/// The hashes of ticks.csv are left out.
#[test]
fn every_file_of_a_full_log() {
    let (run, memory) = log(LogLevel::Full, &sample());
    let mut files = String::new();
    for table in memory.tables.keys().filter(|table| **table != Table::Ticks) {
        files += &format!("## {}\n{}\n", table.file_name(), text(&memory, *table));
    }
    files += "## ticks.csv\n";
    for row in text(&memory, Table::Ticks).lines() {
        let (row, _) = row.rsplit_once(',').unwrap();
        files += &format!("{row}\n");
    }
    insta::assert_snapshot!(files);
    let log = read(run, memory);
    let last = log.last.unwrap();
    assert_eq!((last.tick, last.now), (2, SimTime(100)));
    assert_eq!(log.run.hash, Some(format!("{:016x}", last.hash)));
}

#[test]
fn rows_of_every_input() {
    let robot = "green".to_owned();
    let mut ticks = sample();
    ticks.truncate(1);
    let gone = |incarnation, last_counted, moment: Option<_>| Input::Gone {
        robot: robot.clone(),
        incarnation,
        last_counted,
        listed: moment.is_some(),
        moment,
        scripted: moment.is_none(),
    };
    ticks[0].inputs = vec![
        gone(2, Some(41), Some(3)),
        gone(3, None, None),
        Input::StallEnd {
            robot: robot.clone(),
            moment: None,
            scripted: false,
        },
        Input::Lost {
            receiver: robot.clone(),
            sender: "blue".to_owned(),
            sent_tick: 40,
            index: 1,
        },
    ];
    let (_, memory) = log(LogLevel::Summary, &ticks);
    assert_eq!(
        text(&memory, Table::Events).strip_prefix(header(Table::Events)),
        Some(
            "0,gone,green,,,incarnation 2; last counted in tick 41; last broadcasts listed\n\
             0,gone,green,,,incarnation 3; never counted; last broadcasts not listed\n\
             0,back,green,,,\n\
             0,lost,green,blue,,broadcast 1 of tick 40\n"
        )
    );
}

/// A full log has one row per target and tick, and the seals cover this table.
#[test]
fn targets_have_a_table() {
    let mut ticks = sample();
    ticks[1].targets = vec![
        Target {
            at: Vec2::new(1.5, -0.25),
            observers: 2,
        },
        Target {
            at: Vec2::ZERO,
            observers: 0,
        },
    ];
    let (_, full) = log(LogLevel::Full, &ticks);
    assert_eq!(
        text(&full, Table::Targets),
        "t_ms,target,x_m,y_m,observers\n50,t0,1.5,-0.25,2\n50,t1,0,0,0\n"
    );
    assert!(text(&full, Table::Ticks).contains("\n50,1,world,targets.csv,"));
    let (_, summary) = log(LogLevel::Summary, &ticks);
    assert!(!summary.tables.contains_key(&Table::Targets));
}

/// Only ticks with a sent broadcast, or with an effect, have rows. The seals cover both tables.
#[test]
fn sent_broadcasts_and_effects_of_faults_have_tables() {
    let mut ticks = sample();
    let (_, report) = ticks[2].blue();
    (report.broadcasts, report.broadcast_bytes) = (2, 250);
    let hits = |fault: &str, count| FaultHits {
        fault: fault.to_owned(),
        count,
    };
    ticks[1].hits = vec![hits("noise", 1), hits("f2, late", 7)];
    let (_, full) = log(LogLevel::Full, &ticks);
    let sent = "t_ms,robot,messages,bytes\n50,gold,2,250\n100,blue,2,250\n";
    assert_eq!(text(&full, Table::Sent), sent);
    let hits = "t_ms,fault,hits\n50,noise,1\n50,\"f2, late\",7\n";
    assert_eq!(text(&full, Table::Hits), hits);
    let seals = text(&full, Table::Ticks);
    assert!(seals.contains("\n50,1,world,hits.csv,") && seals.contains("\n100,2,world,sent.csv,"));
    let (_, compact) = log(LogLevel::Compact, &ticks);
    assert_eq!(text(&compact, Table::Sent), sent);
    let (_, summary) = log(LogLevel::Summary, &ticks);
    assert!(!summary.tables.contains_key(&Table::Hits));
}

#[test]
fn levels_write_their_tables() {
    let (_, full) = log(LogLevel::Full, &sample());
    let (_, compact) = log(LogLevel::Compact, &sample());
    let (_, summary) = log(LogLevel::Summary, &sample());
    let (_, off) = log(LogLevel::Off, &sample());
    let tables = |memory: &MemoryLog| memory.tables.keys().copied().collect::<Vec<_>>();
    // Of the optional tables, the run has rows for one.
    let is_kept = |table: &Table| !table.is_optional() || *table == Table::Sent;
    let always = Table::ALL.into_iter().filter(is_kept);
    assert_eq!(tables(&full), always.collect::<Vec<_>>());
    assert_eq!(tables(&compact), tables(&full));
    assert_eq!(
        tables(&summary),
        [Table::Events, Table::Mission, Table::Inputs, Table::Ticks]
    );
    assert_eq!(tables(&off), [Table::Inputs]);
    for memory in [&summary, &off] {
        for (table, bytes) in &memory.tables {
            assert!(
                *table == Table::Ticks || full.tables[table] == *bytes,
                "{table:?}"
            );
        }
    }
    // The first tick of the second and the last tick of the run.
    let seals = text(&summary, Table::Ticks)
        .lines()
        .filter(|line| line.contains(",run,"));
    assert_eq!(
        seals.map(|line| &line[..4]).collect::<Vec<_>>(),
        ["0,0,", "100,"]
    );
}

#[test]
fn run_file_reads_back() {
    for level in [LogLevel::Full, LogLevel::Summary, LogLevel::Off] {
        let (run, memory) = log(level, &sample());
        let text = &memory.documents[&Document::Run];
        assert_eq!(
            RunFile::parse(text.as_bytes(), &scenario::testkit::vocabulary()).unwrap(),
            run
        );
        let json: serde_json::Value = serde_json::from_str(text).unwrap();
        assert_eq!(json["outcome"], "time-limit");
        assert_eq!(json["seed"], 7);
        assert_eq!(json["alliance"]["robots"]["gold"]["rank"], 1);
    }
}

#[test]
fn the_outcome_of_an_unfinished_run_is_running() {
    let recorder = Recorder::new(&default_setup(7), LogLevel::Full, MemoryLog::default()).unwrap();
    let text = &recorder.sink.documents[&Document::Run];
    let json: serde_json::Value = serde_json::from_str(text).unwrap();
    assert_eq!(json["outcome"], "running");
    assert_eq!(json["hash"], serde_json::Value::Null);
    let headers: Vec<_> = recorder
        .sink
        .tables
        .iter()
        .map(|(table, bytes)| (*table, bytes.as_slice()))
        .collect();
    // inputs.jsonl has no header line.
    let expected = Table::ALL
        .into_iter()
        .filter(|table| *table != Table::Inputs && !table.is_optional());
    assert_eq!(
        headers,
        expected
            .map(|table| (table, header(table).as_bytes()))
            .collect::<Vec<_>>()
    );
}

proptest! {
    #[test]
    fn floats_read_back_to_the_same_bits(
        x in any::<f32>().prop_filter("finite", |x| x.is_finite()),
        energy in proptest::option::of(any::<f32>().prop_filter("finite", |x| x.is_finite())),
        m in any::<f64>().prop_filter("finite", |m| m.is_finite()),
    ) {
        let mut ticks = sample();
        ticks[1].robots[0].0.pose.position.x = x;
        ticks[1].robots[0].0.energy_j = energy;
        ticks[1].blue().1.motivations[0].motivation = m;
        let (run, memory) = log(LogLevel::Full, &ticks);
        let log = read(run, memory);
        let pose = &log.rows::<PoseRow>().unwrap()[3];
        prop_assert_eq!(pose.x_m.to_bits(), x.to_bits());
        prop_assert_eq!(pose.energy.map(f32::to_bits), energy.map(f32::to_bits));
        let motivation = &log.rows::<MotivationRow>().unwrap()[0];
        prop_assert_eq!(motivation.motivation.to_bits(), m.to_bits());
    }
}
