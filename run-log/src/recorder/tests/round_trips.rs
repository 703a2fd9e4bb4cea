//! Every file of a run is read as it was written, with any text and any number.

use crate::InputLine;
use proptest::prelude::*;
use scenario::testkit::drawn;

use super::*;

fn written(change: impl FnOnce(&mut OwnedTick)) -> RunLog {
    let mut ticks = sample();
    change(&mut ticks[1]);
    let (run, memory) = log(LogLevel::Full, &ticks);
    read(run, memory)
}

proptest! {
    #[test]
    fn inputs_survive_a_round_trip(seed: u64, count in 0..20_u64) {
        // JSON has no infinite numbers, and the checks of orders and poses refuse them.
        let is_order = |input: &Input| match input {
            Input::Order { .. } | Input::Body(_) => true,
            Input::Branch(branch) => branch.faults.is_some(),
            _ => false,
        };
        let inputs = (0..count).map(|number| drawn(seed.wrapping_add(number)));
        let inputs: Vec<Input> = inputs.filter(|input| !is_order(input)).collect();
        let log = written(|tick| tick.inputs.clone_from(&inputs));
        let lines = log.inputs().unwrap().into_iter();
        let read: Vec<Input> = lines.filter(|line: &InputLine| line.tick == 1).map(|line| line.input).collect();
        prop_assert_eq!(read, inputs);
        prop_assert_eq!(log.excess, []);
    }

    /// Control characters become blanks, so that each row is one line.
    #[test]
    fn texts_of_events_survive_a_round_trip(texts: [String; 3]) {
        let log = written(|tick| {
            let event = &mut tick.events[0];
            [event.subject, event.reason, event.detail] = texts.clone();
        });
        let rows: Vec<EventRow> = log.rows().unwrap();
        let blank = |text: &String| text.replace(|c: char| c.is_ascii_control(), " ");
        let texts = texts.each_ref().map(blank);
        let has_texts = |row: &EventRow| [&row.subject, &row.reason, &row.detail] == texts.each_ref();
        prop_assert_eq!(rows.iter().filter(|row| has_texts(row)).count(), 1);
    }

    #[test]
    fn run_json_survives_a_round_trip(
        (version, build) in any::<(String, String)>(),
        (unscripted, count, time) in any::<(bool, u64, u64)>(),
        value in prop::num::f64::NORMAL | prop::num::f64::ZERO | prop::num::f64::SUBNORMAL,
    ) {
        let mut run = log(LogLevel::Full, &sample()).0;
        (run.version, run.unscripted) = (version, unscripted);
        run.agent_builds.insert("gold".to_owned(), build);
        run.result.sim_time_ms = SimTime(time);
        run.result.mission.add("any.value", value);
        run.result.robots.get_mut("gold").unwrap().messages_sent = count;
        let text = run.to_json();
        let read = RunFile::parse(text.as_bytes(), &scenario::testkit::vocabulary()).unwrap();
        prop_assert_eq!(read.to_json(), text);
        prop_assert_eq!(read, run);
    }
}
