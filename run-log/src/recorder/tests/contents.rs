//! The exact contents of all files, and their reading.

use proptest::prelude::*;
use scenario::testkit::default_setup;

use super::*;
use scenario::mission::Target;

fn text(memory: &MemoryLog, table: Table) -> &str {
    std::str::from_utf8(&memory.tables[&table]).unwrap()
}

#[test]
fn every_file_of_a_full_log() {
    let (_, memory) = log(LogLevel::Full, &sample());
    let rows = |table: Table| {
        let text = text(&memory, table);
        text.strip_prefix(header(table)).expect("a header line")
    };
    assert_eq!(
        rows(Table::Motivations),
        "50,blue,find-methodical,find,100,0.1,1,1,1,1,active\n\
         50,blue,find-wander,find,0,0.1,1,0,1,1,hibernating\n"
    );
    assert_eq!(
        rows(Table::Messages),
        "50,blue,gold,1,0,heartbeat,executing,0,move(bottom),move(bottom),4,0,received\n\
         50,blue,gold,1,,,,,,,,0,lost\n"
    );
    assert_eq!(
        rows(Table::Events),
        "0,joined,blue,,,incarnation 1\n\
         0,joined,gold,,,incarnation 1\n\
         0,joined,green,,,incarnation 1\n\
         50,stalled,green,,,\n\
         50,hibernated,blue,move(top),reset-by gold,move(top)\n\
         50,activated,blue,find-methodical,threshold,find\n\
         50,detour,blue,,,\"left, \"\"0.4 m\"\"\"\n\
         50,done,blue,task-3,,\n\
         50,told,gold,,,\n"
    );
    assert_eq!(
        rows(Table::Poses),
        "0,blue,0.3,4.5,-2.5,0,0,,\n\
         0,gold,0.3,4,-2.5,0,0,,\n\
         0,green,0.3,3.5,-2.5,0,0,,\n\
         50,blue,0.325,4.5,-2.5,0.5,1,find-methodical,49999.75\n\
         50,gold,0.3,4,-2.5,0,0,,\n\
         50,green,0.3,3.5,-2.5,0,0,,\n\
         100,blue,0.3,4.5,-2.5,0,0,,\n\
         100,gold,0.3,4,-2.5,0,0,,\n\
         100,green,0.3,3.5,-2.5,0,0,,\n"
    );
    assert_eq!(rows(Table::Mission), "0,23,1,0,0,\n50,23,0,0,1,50\n");
    assert_eq!(
        rows(Table::Inputs),
        "{\"tick\":0,\"input\":{\"join\":{\"robot\":\"blue\",\"incarnation\":1}}}\n\
         {\"tick\":0,\"input\":{\"join\":{\"robot\":\"gold\",\"incarnation\":1}}}\n\
         {\"tick\":0,\"input\":{\"join\":{\"robot\":\"green\",\"incarnation\":1}}}\n\
         {\"tick\":1,\"input\":{\"stall-begin\":{\"robot\":\"green\"}}}\n"
    );
}

#[test]
fn rows_of_the_hash_table() {
    let (run, memory) = log(LogLevel::Full, &sample());
    let log = RunLog::from_tables(Path::new(""), run, memory.tables);
    let rows: Vec<TickRow> = log.rows().unwrap();
    let keys: Vec<_> = rows
        .iter()
        .map(|row| format!("{},{},{},{}", row.t_ms.0, row.tick, row.robot, row.section))
        .collect();
    let expected = "\
        0,0,world,inputs 0,0,blue,readings 0,0,blue,motivations 0,0,blue,commands 0,0,gold,readings \
        0,0,gold,motivations 0,0,gold,commands 0,0,world,state 0,0,world,motivations.csv 0,0,world,messages.csv \
        0,0,world,events.csv 0,0,world,poses.csv 0,0,world,mission.csv 0,0,world,inputs.jsonl 0,0,world,run \
        50,1,world,inputs 50,1,blue,readings 50,1,blue,messages 50,1,blue,motivations 50,1,blue,commands \
        50,1,gold,readings 50,1,gold,messages 50,1,gold,motivations 50,1,gold,commands 50,1,world,events \
        50,1,world,state 50,1,world,motivations.csv 50,1,world,messages.csv 50,1,world,events.csv \
        50,1,world,poses.csv 50,1,world,mission.csv 50,1,world,inputs.jsonl 50,1,world,run \
        100,2,blue,readings 100,2,blue,motivations 100,2,blue,commands 100,2,gold,readings 100,2,gold,motivations \
        100,2,gold,commands 100,2,world,state 100,2,world,poses.csv 100,2,world,run";
    assert_eq!(keys, expected.split(' ').collect::<Vec<_>>());
    let last = log.last.unwrap();
    assert_eq!((last.tick, last.now), (2, SimTime(100)));
    assert_eq!(log.run.hash, Some(format!("{:016x}", last.hash)));
}

#[test]
fn rows_of_every_input() {
    let robot = "green".to_owned();
    let mut ticks = sample();
    ticks.truncate(1);
    ticks[0].inputs = vec![
        Input::Gone {
            robot: robot.clone(),
            incarnation: 2,
            last_counted: Some(41),
            listed: true,
            moment: Some(3),
            scripted: false,
        },
        Input::Gone {
            robot: robot.clone(),
            incarnation: 3,
            last_counted: None,
            listed: false,
            moment: None,
            scripted: true,
        },
        Input::StallEnd {
            robot: robot.clone(),
            moment: None,
            scripted: false,
        },
        Input::Lost {
            receiver: robot,
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

#[test]
fn levels_write_their_tables() {
    let (_, full) = log(LogLevel::Full, &sample());
    let (_, summary) = log(LogLevel::Summary, &sample());
    let (_, off) = log(LogLevel::Off, &sample());
    let tables = |memory: &MemoryLog| memory.tables.keys().copied().collect::<Vec<_>>();
    // No allocator of this run writes the optional table.
    let always = Table::ALL.into_iter().filter(|table| !table.is_optional());
    assert_eq!(tables(&full), always.collect::<Vec<_>>());
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
        let log = RunLog::from_tables(Path::new(""), run, memory.tables);
        let pose = &log.rows::<PoseRow>().unwrap()[3];
        prop_assert_eq!(pose.x_m.to_bits(), x.to_bits());
        prop_assert_eq!(pose.energy.map(f32::to_bits), energy.map(f32::to_bits));
        let motivation = &log.rows::<MotivationRow>().unwrap()[0];
        prop_assert_eq!(motivation.motivation.to_bits(), m.to_bits());
    }
}
