//! Every kind of mistake in a parameter file. The snapshots contain the error messages.

use proptest::prelude::*;
use scenario::testkit::refusals;
use scenario::{ParameterFile, Problem, Setup};

use crate::waste::data::default_scenario;

fn resolve(text: &str) -> Result<(), Problem> {
    let file = ParameterFile::parse("p.properties", text.as_bytes())?;
    Setup::resolve(default_scenario(), 1, Some(&file)).map(drop)
}

/// Compares the errors of texts with the snapshot of this name.
fn refused(name: &str, texts: &[&str]) {
    insta::assert_snapshot!(name, refusals("p.properties", texts, resolve));
}

#[test]
fn mistakes_have_file_line_and_remedy() {
    refused(
        "keys",
        &[
            "treshold = 1",
            "# comment\n\nfastimpatience.report-progress = 1",
            "threshold.blue = 1",
            "fastImpatience = 1",
            "fastImpatience. = 1",
            "fastImpatience.gold.blue.report-progress = 1",
            "fastImpatience.move-spill(top = 1",
            "slowImpatience.report-progress = 1",
            "timeWillingToAffect.gold..report-progress = 1",
            "threshold = 1\n! comment\nthreshold : 2",
            "threshold = 1\nthres\\u00zz = 1",
        ],
    );
    refused(
        "values",
        &[
            "threshold",
            "threshold =",
            "threshold = high",
            "threshold = 0",
            "threshold = NaN",
            "threshold = 1e999",
            "threshold = 1,5",
            "timeBeforeYielding.report-progress = 2 min",
            "\n\nbroadcastRate.blue.report-progress = -1",
            "slowImpatience.gold.report-progress = inf",
            // A last line that ends in a backslash is read, too.
            "timeBeforeGivingUp.report-progress = 0\\",
        ],
    );
    refused(
        "rules_between_values",
        &[
            "threshold = 50\nfastImpatience.report-progress = 0.9",
            "slowImpatience.green.gold.report-progress = 25",
            "timeAllowedTillCeased.report-progress = 1",
        ],
    );
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
        if let Err(error) = resolve(&text) {
            prop_assert!(!error.to_string().contains('\n'));
        }
    }
}
