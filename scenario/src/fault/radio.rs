//! Named radio qualities: sets of link faults.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
            Self::GoodRadio => "good-radio",
            Self::PoorRadio => "poor-radio",
            Self::SevereRadio => "severe-radio",
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
