//! The fault `radio`: named radio qualities, which are sets of link faults.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Target;
use crate::fault::Fault;
use crate::fault::checker::{Checked, Checker};
use crate::fault::spec::{FaultArgument, FaultGroup, FaultKind, FaultRange, FaultSpec};

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "radio",
        about: "Set the quality of all links by name",
        arguments: &[FaultArgument::at(
            "quality",
            "Name of the quality",
            FaultRange::Choice(&[
                (GOOD, "Set all links to 1 % loss and 20 to 50 ms delay"),
                (
                    POOR,
                    "Set all links to 15 % loss in bursts, 0.1 to 0.4 s delay, 1 % duplicates",
                ),
                (
                    SEVERE,
                    "Set all links to 40 % loss in long bursts, 0.3 to 1.5 s delay, 5 % duplicates, 5 % reordered",
                ),
            ]),
        )],
    },
    group: FaultGroup::Radio,
    takes_role: false,
    examples: &[
        (
            r#"{"radio": "good-radio"}"#,
            "all links: 1 % loss, 20 to 50 ms delay",
        ),
        (
            r#"{"radio": "poor-radio"}"#,
            "all links: 15 % loss in bursts of 0.5 s, 0.1 to 0.4 s delay, 1 % duplicates",
        ),
        (
            r#"{"radio": "severe-radio"}"#,
            "all links: 40 % loss in bursts of 2 s, 0.3 to 1.5 s delay, 5 % duplicates, 5 % reordered",
        ),
    ],
    commands: &[
        ("radio poor-radio", "until it is cleared"),
        ("good-radio", "until it is cleared"),
        ("poor-radio --for 1min", "for a minute"),
        ("severe-radio --for 1min", "for a minute"),
    ],
    check,
    ..FaultKind::OF_ROBOT
};

const GOOD: &str = "good-radio";
const POOR: &str = "poor-radio";
const SEVERE: &str = "severe-radio";

impl Target for RadioQuality {}

fn check(fault: &Fault, checker: &Checker<'_>) -> Checked {
    match fault {
        Fault::Radio(quality) if quality.link_quality().burst_s > 0.0 => {
            checker.bursts(["fault", "radio"])
        }
        _ => Ok(()),
    }
}

/// The quality of the radio on all links. The values are round numbers of this project for the default rate of one
/// heartbeat in 2 s. A good radio hardly affects a team, a poor one impairs it, and a severe one separates it at times.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RadioQuality {
    /// Loss of 1 %, delay of 20 to 50 ms.
    GoodRadio,
    /// Loss of 15 % in bursts of 0.5 s, delay of 0.1 to 0.4 s, 1 % duplicates.
    PoorRadio,
    /// Loss of 40 % in bursts of 2 s, delay of 0.3 to 1.5 s, 5 % duplicates, 5 % reordering.
    SevereRadio,
}

/// The effect of a radio quality on every link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkQuality {
    pub loss: f64,
    /// The mean length of a burst of losses, s.
    pub burst_s: f64,
    pub delay_s: f64,
    /// The maximum additional delay, s.
    pub jitter_s: f64,
    /// The share of messages that are delivered twice.
    pub duplicate: f64,
    /// The share of messages that the next one overtakes.
    pub reorder: f64,
}

impl RadioQuality {
    /// The qualities from best to worst.
    pub const ALL: [Self; 3] = [Self::GoodRadio, Self::PoorRadio, Self::SevereRadio];

    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::GoodRadio => GOOD,
            Self::PoorRadio => POOR,
            Self::SevereRadio => SEVERE,
        }
    }

    #[must_use]
    pub fn link_quality(self) -> LinkQuality {
        match self {
            Self::GoodRadio => LinkQuality {
                loss: 0.01,
                burst_s: 0.0,
                delay_s: 0.02,
                jitter_s: 0.03,
                duplicate: 0.0,
                reorder: 0.0,
            },
            Self::PoorRadio => LinkQuality {
                loss: 0.15,
                burst_s: 0.5,
                delay_s: 0.1,
                jitter_s: 0.3,
                duplicate: 0.01,
                reorder: 0.0,
            },
            Self::SevereRadio => LinkQuality {
                loss: 0.4,
                burst_s: 2.0,
                delay_s: 0.3,
                jitter_s: 1.2,
                duplicate: 0.05,
                reorder: 0.05,
            },
        }
    }
}
