//! Named radio qualities: bundles of link faults.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Quality of the radio on all links. The figures are round numbers of this project, chosen so that a team at the default
/// heartbeat rate of 1 in 2 s hardly notices the first, works worse with the second, and falls apart at times with the third.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RadioQuality {
    /// 1 % loss, 20 to 50 ms late.
    GoodRadio,
    /// 15 % loss in bursts of half a second, 0.1 to 0.4 s late, 1 % twice.
    PoorRadio,
    /// 40 % loss in bursts of two seconds, 0.3 to 1.5 s late, 5 % twice, 5 % overtaken.
    SevereRadio,
}

/// What a radio quality does to every link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkTerms {
    /// Share of messages lost.
    pub loss: f64,
    /// Mean length of a burst of losses, s.
    pub burst_s: f64,
    /// Delay of every message, s.
    pub delay_s: f64,
    /// Up to this much more, s.
    pub jitter_s: f64,
    /// Share of messages that come twice.
    pub duplicate: f64,
    /// Share of messages that are overtaken.
    pub reorder: f64,
}

impl RadioQuality {
    /// All, best first.
    pub const ALL: [Self; 3] = [Self::GoodRadio, Self::PoorRadio, Self::SevereRadio];

    /// Its name.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::GoodRadio => "good-radio",
            Self::PoorRadio => "poor-radio",
            Self::SevereRadio => "severe-radio",
        }
    }

    /// Its figures.
    #[must_use]
    pub fn terms(self) -> LinkTerms {
        match self {
            Self::GoodRadio => LinkTerms {
                loss: 0.01,
                burst_s: 0.0,
                delay_s: 0.02,
                jitter_s: 0.03,
                duplicate: 0.0,
                reorder: 0.0,
            },
            Self::PoorRadio => LinkTerms {
                loss: 0.15,
                burst_s: 0.5,
                delay_s: 0.1,
                jitter_s: 0.3,
                duplicate: 0.01,
                reorder: 0.0,
            },
            Self::SevereRadio => LinkTerms {
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
