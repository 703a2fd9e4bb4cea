//! A compact log has the same rows as a full log, and only those that differ from their prediction are written.

use proptest::prelude::*;

use super::repeated::any_run;
use super::*;
use crate::compact::{CompactForm, MotivationRule, PredictedRows};
use crate::rows::TableRow;

const REDUCED: [Table; 4] = [
    Table::Motivations,
    Table::Allocation,
    Table::Messages,
    Table::Poses,
];

/// Returns a reduced table of both logs with all rows.
fn both(ticks: &[OwnedTick], table: Table) -> [String; 2] {
    [LogLevel::Full, LogLevel::Compact].map(|level| {
        let (run, memory) = log(level, ticks);
        let log = read(run, memory);
        let bytes = log.full_table(table, None).unwrap();
        String::from_utf8(bytes.into_owned()).unwrap()
    })
}

proptest! {
    #[test]
    fn a_compact_log_contains_every_row_of_a_full_log(ticks in any_run()) {
        for table in REDUCED {
            let [full, compact] = both(&ticks, table);
            prop_assert_eq!(full, compact);
        }
    }
}

/// Returns a run in which the motivations of blue follow `levels`.
fn motivated(levels: impl IntoIterator<Item = Option<Motivation>>) -> Vec<OwnedTick> {
    let levels = (0..).zip(levels);
    levels
        .map(|(tick, level)| {
            let mut owned = OwnedTick {
                tick,
                now: SimTime(tick * 50),
                ..sample()[2].clone()
            };
            owned.robots[0].1 = level.map(|level| {
                let motivations = vec![level];
                (
                    Readings::default(),
                    Report {
                        motivations,
                        ..report(BLUE, tick)
                    },
                )
            });
            owned
        })
        .collect()
}

/// Returns the rows of motivations.csv in a compact log, after a check of all rows.
#[track_caller]
fn written(ticks: &[OwnedTick]) -> Vec<String> {
    let [full, compact] = both(ticks, Table::Motivations);
    assert_eq!(full, compact);
    let (_, memory) = log(LogLevel::Compact, ticks);
    let text = str::from_utf8(&memory.tables[&Table::Motivations]).unwrap();
    text.lines().skip(1).map(ToOwned::to_owned).collect()
}

#[test]
fn a_motivation_that_grows_to_the_threshold_has_one_row() {
    let mut level = motivation(0, 0.0);
    level.impatience = 1.0 / 3.0;
    let mut levels = Vec::new();
    for _ in 0..10_000 {
        levels.push(Some(level));
        level.motivation = (level.motivation + level.impatience * 0.05).min(100.0);
    }
    assert_eq!(level.motivation, 100.0);
    assert_eq!(written(&motivated(levels)).len(), 1);
}

#[test]
fn a_change_a_pause_and_a_withheld_motivation_have_rows() {
    let level = motivation(0, 7.0);
    let reset = Motivation {
        motivation: 0.0,
        impatience_reset: false,
        ..level
    };
    // The motivation stays although all factors are 1.
    let withheld = Motivation {
        motivation: 0.0,
        ..level
    };
    let mut levels = vec![Some(level), Some(reset), Some(reset), None, None];
    levels.extend([Some(withheld); 50]);
    let rows = written(&motivated(levels));
    let times = rows.iter().map(|row| row.split(',').next().unwrap());
    assert_eq!(times.collect::<Vec<_>>(), ["0", "50", "150", "250", "300"]);
    assert_eq!(rows[2], "150,blue,,,,,,,,,");
}

#[test]
fn a_repeated_message_has_no_contents() {
    let mut ticks = sample();
    let (_, blue) = ticks[1].robots[0].1.as_ref().unwrap();
    let received = blue.receptions[0];
    let (_, gold) = ticks[1].robots[1].1.as_mut().unwrap();
    gold.receptions = vec![received];
    ticks[1].blue().1.receptions = vec![received];
    let (_, memory) = log(LogLevel::Compact, &ticks);
    let text = str::from_utf8(&memory.tables[&Table::Messages]).unwrap();
    let rows: Vec<&str> = text.lines().skip(1).collect();
    assert_eq!(rows.len(), 2);
    assert!(rows[0].starts_with("50,blue,gold,1,0,heartbeat,"));
    assert_eq!(rows[1], "50,gold,gold,,,,,,,,,,");
}

#[test]
fn rows_that_fit_no_tick_or_robot_are_errors() {
    let level = motivation(0, 7.0);
    let (run, memory) = log(LogLevel::Compact, &motivated([Some(level), Some(level)]));
    let table = &memory.tables[&Table::Motivations];
    let rows = |more: &str| {
        let text = [table, more.as_bytes()].concat();
        let CompactForm::Predicted(form) = MotivationRow::FORM else {
            panic!("motivations are predicted");
        };
        let (rule, roster) = (MotivationRule::new(&run.setup), &run.setup.roster);
        let times = [0, 50].map(SimTime);
        let mut rows = PredictedRows::new(form, rule, &text, roster, &times);
        let mut count = 0;
        while rows.advance().map_err(|error| error.to_string())?.is_some() {
            count += 1;
        }
        Ok::<_, String>(count)
    };
    assert_eq!(rows("").unwrap(), 2);
    assert_eq!(rows("50,blue,,,,,,,,,\n").unwrap(), 1);
    for (more, reason) in [
        ("0,blue,,,,,,,,,\n", "line 4: the row is out of order"),
        (
            "100,blue,,,,,,,,,\n",
            "line 4: the row is out of order, or belongs to no complete tick",
        ),
        (
            "50,red,,,,,,,,,\n",
            "line 4: there is no robot 'red' in run.json",
        ),
        (
            "x,blue,,,,,,,,,\n",
            "line 4: the time is not a whole number",
        ),
        (
            "50,blue,other,t,1,1,1,1,1,1,waiting\n",
            "line 4: no earlier row has this robot",
        ),
    ] {
        let error = rows(more).unwrap_err();
        assert!(error.contains(reason), "{more}: {error}");
    }
}
