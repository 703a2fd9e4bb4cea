//! An event as a trigger: "blue activates find-locations-methodical".

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The next event that fits triggers: `ROBOT|any VERB [SUBJECT]`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(with = "String")]
pub struct When {
    /// Who does it; `None` is `any`.
    pub robot: Option<String>,
    /// What it does.
    pub what: Happening,
    /// With what: a behavior set or an item; `None`: with whatever it may be.
    pub subject: Option<String>,
}

/// What a robot can do to trigger a fault, with the `kind` that it has in events.csv.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Happening {
    /// A behavior set becomes active.
    Activates,
    /// A behavior set hibernates.
    Hibernates,
    /// A behavior set begins to wait.
    Waits,
    /// It picks up an item.
    Picks,
    /// It lets an item fall to the floor.
    Drops,
    /// It delivers an item.
    Delivers,
    /// It reports the progress.
    Reports,
    /// It broadcasts the locations that it has found.
    Finds,
    /// It takes part in a new incarnation.
    Joins,
    /// It dies.
    Dies,
}

impl Happening {
    /// All, in the order of their declaration.
    pub const ALL: [Self; 10] = [
        Self::Activates,
        Self::Hibernates,
        Self::Waits,
        Self::Picks,
        Self::Drops,
        Self::Delivers,
        Self::Reports,
        Self::Finds,
        Self::Joins,
        Self::Dies,
    ];

    /// The verb.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Activates => "activates",
            Self::Hibernates => "hibernates",
            Self::Waits => "waits",
            Self::Picks => "picks",
            Self::Drops => "drops",
            Self::Delivers => "delivers",
            Self::Reports => "reports",
            Self::Finds => "finds",
            Self::Joins => "joins",
            Self::Dies => "dies",
        }
    }

    /// Whether its subject is a behavior set.
    #[must_use]
    pub fn is_about_a_set(self) -> bool {
        matches!(self, Self::Activates | Self::Hibernates | Self::Waits)
    }

    /// Whether its subject is an item.
    #[must_use]
    pub fn is_about_an_item(self) -> bool {
        matches!(self, Self::Picks | Self::Drops | Self::Delivers)
    }
}

/// Words that name no event.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' names no event; write ROBOT or any, then one of {verbs}, then a behavior set or item if need be, as in \"blue activates report-progress\"", verbs = Happening::ALL.map(Happening::as_str).join(", "))]
pub struct WhenError(String);

impl FromStr for When {
    type Err = WhenError;

    fn from_str(text: &str) -> Result<Self, WhenError> {
        let wrong = || WhenError(text.to_owned());
        let mut words = text.split_whitespace();
        let robot = words.next().ok_or_else(wrong)?;
        let verb = words.next().ok_or_else(wrong)?;
        let what = Happening::ALL
            .into_iter()
            .find(|what| what.as_str() == verb)
            .ok_or_else(wrong)?;
        let subject = words.next().map(str::to_owned);
        let has_subjects = what.is_about_a_set() || what.is_about_an_item();
        if words.next().is_some() || (subject.is_some() && !has_subjects) {
            return Err(wrong());
        }
        Ok(Self {
            robot: (robot != "any").then(|| robot.to_owned()),
            what,
            subject,
        })
    }
}

impl fmt::Display for When {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let robot = self.robot.as_deref().unwrap_or("any");
        write!(f, "{robot} {}", self.what.as_str())?;
        match &self.subject {
            Some(subject) => write!(f, " {subject}"),
            None => Ok(()),
        }
    }
}

impl TryFrom<String> for When {
    type Error = WhenError;

    fn try_from(text: String) -> Result<Self, WhenError> {
        text.parse()
    }
}

impl From<When> for String {
    fn from(when: When) -> Self {
        when.to_string()
    }
}
