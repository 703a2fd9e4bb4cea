//! Every kind of mistake in a parameter file, with the exact error message.

use crate::waste::data::default_scenario;
use proptest::prelude::*;

use scenario::{ParameterFile, Setup};

fn refusal(text: &str) -> String {
    let file = ParameterFile::parse("p.properties", text.as_bytes());
    let resolved = file.and_then(|file| Setup::resolve(default_scenario(), 1, Some(&file)));
    match resolved {
        Ok(_) => format!("accepted: {text}"),
        Err(error) => error.to_string(),
    }
}

fn check(table: &[(&str, &str)]) {
    for (text, expected) in table {
        assert_eq!(refusal(text), *expected, "for {text:?}");
    }
}

#[test]
fn keys() {
    check(&[
        (
            "treshold = 1",
            "p.properties:1: treshold: unknown parameter; did you mean 'threshold'? (there are threshold, broadcastRate, timeAllowedTillCeased, fastImpatience, slowImpatience, timeWillingToAffect, timeBeforeYielding, timeBeforeGivingUp)",
        ),
        (
            "# comment\n\nfastimpatience.report-progress = 1",
            "p.properties:3: fastimpatience.report-progress: unknown parameter; did you mean 'fastImpatience'? (there are threshold, broadcastRate, timeAllowedTillCeased, fastImpatience, slowImpatience, timeWillingToAffect, timeBeforeYielding, timeBeforeGivingUp)",
        ),
        (
            "threshold.blue = 1",
            "p.properties:1: threshold.blue: the key has the wrong form; write threshold alone",
        ),
        (
            "fastImpatience = 1",
            "p.properties:1: fastImpatience: the key has the wrong form; write fastImpatience.SET or fastImpatience.ROBOT.SET",
        ),
        (
            "fastImpatience. = 1",
            "p.properties:1: fastImpatience.: the key has the wrong form; write fastImpatience.SET or fastImpatience.ROBOT.SET",
        ),
        (
            "fastImpatience.gold.blue.report-progress = 1",
            "p.properties:1: fastImpatience.gold.blue.report-progress: the key has the wrong form; write fastImpatience.SET or fastImpatience.ROBOT.SET",
        ),
        (
            "fastImpatience.move-spill(top = 1",
            "p.properties:1: fastImpatience.move-spill(top: the key has the wrong form; write fastImpatience.SET or fastImpatience.ROBOT.SET",
        ),
        (
            "slowImpatience.report-progress = 1",
            "p.properties:1: slowImpatience.report-progress: the key has the wrong form; write slowImpatience.TEAMMATE.SET or slowImpatience.TEAMMATE.ROBOT.SET",
        ),
        (
            "timeWillingToAffect.gold..report-progress = 1",
            "p.properties:1: timeWillingToAffect.gold..report-progress: the key has the wrong form; write timeWillingToAffect.TEAMMATE.SET or timeWillingToAffect.TEAMMATE.ROBOT.SET",
        ),
        (
            "threshold = 1\n! comment\nthreshold : 2",
            "p.properties:3: threshold: the key is already on line 1; state it once",
        ),
        (
            "threshold = 1\nthres\\u00zz = 1",
            "p.properties:2: malformed \\u escape; write four hexadecimal digits after \\u",
        ),
    ]);
}

#[test]
fn values() {
    check(&[
        (
            "threshold",
            "p.properties:1: threshold: the value is missing; write a number above 0",
        ),
        (
            "threshold =",
            "p.properties:1: threshold: the value is missing; write a number above 0",
        ),
        (
            "threshold = high",
            "p.properties:1: threshold: 'high' is not a number; write a number above 0",
        ),
        (
            "threshold = 0",
            "p.properties:1: threshold: 0 is out of range; it must be finite and above 0",
        ),
        (
            "threshold = NaN",
            "p.properties:1: threshold: NaN is out of range; it must be finite and above 0",
        ),
        (
            "threshold = 1e999",
            "p.properties:1: threshold: inf is out of range; it must be finite and above 0",
        ),
        (
            "threshold = 1,5",
            "p.properties:1: threshold: '1,5' is not a number; write a number above 0",
        ),
        (
            "timeBeforeYielding.report-progress = 2 min",
            "p.properties:1: timeBeforeYielding.report-progress: '2 min' is not a number; write a number above 0 s",
        ),
        (
            "\n\nbroadcastRate.blue.report-progress = -1",
            "p.properties:3: broadcastRate.blue.report-progress: -1 is out of range; it must be finite and above 0 Hz",
        ),
        (
            "slowImpatience.gold.report-progress = inf",
            "p.properties:1: slowImpatience.gold.report-progress: inf is out of range; it must be finite and above 0 motivation/s",
        ),
        (
            // A last line that ends in a backslash is read, too.
            "timeBeforeGivingUp.report-progress = 0\\",
            "p.properties:1: timeBeforeGivingUp.report-progress: 0 is out of range; it must be finite and above 0 s",
        ),
    ]);
}

#[test]
fn rules_between_values() {
    check(&[
        (
            "threshold = 50\nfastImpatience.report-progress = 0.9",
            "p.properties:2: fastImpatience.report-progress: blue's report-progress has slow impatience 1 toward gold with fast impatience 0.9; the rule is 0 < slow < fast",
        ),
        (
            "slowImpatience.green.gold.report-progress = 25",
            "p.properties:1: slowImpatience.green.gold.report-progress: gold's report-progress has slow impatience 25 toward green with fast impatience 25; the rule is 0 < slow < fast",
        ),
        (
            "timeAllowedTillCeased.report-progress = 1",
            "p.properties:1: timeAllowedTillCeased.report-progress: blue's report-progress has tau = 1 s with rho = 1 Hz; the rule is tau > 1/rho",
        ),
    ]);
}

proptest! {
    #[test]
    fn any_bytes_are_read_or_refused_in_one_line(bytes in any::<Vec<u8>>()) {
        if let Err(error) = ParameterFile::parse("p.properties", &bytes) {
            prop_assert!(!error.to_string().contains(char::is_control));
        }
    }

    #[test]
    fn any_key_and_value_are_read_or_refused_in_one_line(
        key in "(threshold|fastImpatience|slowImpatience|[a-z]{1,3})([.](blue|gold|report-progress|[a-z()]{0,5})){0,4}",
        separator in "[ =:\\\\\t]{1,2}",
        value in "[0-9e.+-]{0,6}|inf|nan|.{0,6}",
    ) {
        let text = format!("{key}{separator}{value}");
        prop_assert!(!refusal(&text).contains('\n'));
    }
}
