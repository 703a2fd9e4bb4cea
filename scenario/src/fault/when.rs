//! Events as triggers: "blue activates find-locations-methodical".

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Problem;
use crate::mission::registry::Mission;
use crate::names::ANY;

/// A trigger by the next event that matches `ROBOT|any VERB [SUBJECT]`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(with = "String")]
pub struct EventTrigger {
    /// The robot of the event; `None` is `any`.
    pub robot: Option<String>,
    /// The verb of a [`TriggerEvent`] or of the mission.
    pub what: String,
    /// A behavior set or an object of the mission; `None` matches any, and is `any` or nothing in a text.
    pub subject: Option<String>,
}

/// The events of any mission that can trigger a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TriggerEvent {
    /// Activation of a behavior set.
    Activates,
    /// Hibernation of a behavior set.
    Hibernates,
    /// The start of waiting of a behavior set.
    Waits,
    /// The entry of the robot in a new incarnation.
    Joins,
    /// The end of the robot's agent.
    Dies,
}

impl TriggerEvent {
    /// The events in the order of their declaration.
    pub const ALL: [Self; 5] = [
        Self::Activates,
        Self::Hibernates,
        Self::Waits,
        Self::Joins,
        Self::Dies,
    ];

    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Activates => "activates",
            Self::Hibernates => "hibernates",
            Self::Waits => "waits",
            Self::Joins => "joins",
            Self::Dies => "dies",
        }
    }

    /// Returns all verbs of a mission, in display order.
    pub fn verbs(mission: Mission) -> impl Iterator<Item = &'static str> + Clone {
        let [first @ .., joins, dies] = Self::ALL.map(Self::as_str);
        let mission_verbs = mission.vocabulary().verbs.iter().map(|(verb, _)| *verb);
        first.into_iter().chain(mission_verbs).chain([joins, dies])
    }
}

impl EventTrigger {
    /// Returns true if the subject is a behavior set.
    #[must_use]
    pub fn has_behavior_set_subject(&self) -> bool {
        let [sets @ .., _, _] = TriggerEvent::ALL.map(TriggerEvent::as_str);
        sets.contains(&self.what.as_str())
    }

    /// Rejects an object of the mission that does not exist, so that the event never occurs.
    ///
    /// # Errors
    /// If `exists` is false for the object; `remedy` describes the objects of the verb.
    pub fn check_object(
        &self,
        exists: impl FnOnce(&str) -> bool,
        remedy: impl Into<String>,
    ) -> Result<(), Problem> {
        match &self.subject {
            Some(object) if !exists(object) => {
                let what = format!("'{} {object}' never happens", self.what);
                Err(Problem::at(["when"], what, remedy))
            }
            _ => Ok(()),
        }
    }

    /// Returns the number of an object such as `item-7`, whose prefix is `item-`.
    #[must_use]
    pub fn number_of(object: &str, prefix: &str) -> Option<usize> {
        let number = object.strip_prefix(prefix)?.parse().ok()?;
        (format!("{prefix}{number}") == object).then_some(number)
    }

    /// Returns true if a subject is not allowed.
    fn has_no_subject(&self) -> bool {
        let [.., joins, dies] = TriggerEvent::ALL.map(TriggerEvent::as_str);
        [joins, dies].contains(&self.what.as_str())
    }
}

/// A text that describes no event.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "'{0}' is not an event; write ROBOT or any, a verb, and if needed a behavior set or an object, as in \"blue activates report-progress\""
)]
pub struct WhenError(String);

impl FromStr for EventTrigger {
    type Err = WhenError;

    fn from_str(text: &str) -> Result<Self, WhenError> {
        let wrong = || WhenError(text.to_owned());
        let mut words = text.split_whitespace();
        let robot = words.next().ok_or_else(wrong)?;
        let verb = words.next().ok_or_else(wrong)?;
        let when = Self {
            robot: (robot != ANY).then(|| robot.to_owned()),
            what: verb.to_owned(),
            subject: words
                .next()
                .filter(|subject| *subject != ANY)
                .map(str::to_owned),
        };
        if words.next().is_some() || (when.subject.is_some() && when.has_no_subject()) {
            return Err(wrong());
        }
        Ok(when)
    }
}

impl fmt::Display for EventTrigger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let robot = self.robot.as_deref().unwrap_or(ANY);
        write!(f, "{robot} {}", self.what)?;
        match &self.subject {
            Some(subject) => write!(f, " {subject}"),
            None => Ok(()),
        }
    }
}

impl TryFrom<String> for EventTrigger {
    type Error = WhenError;

    fn try_from(text: String) -> Result<Self, WhenError> {
        text.parse()
    }
}

impl From<EventTrigger> for String {
    fn from(when: EventTrigger) -> Self {
        when.to_string()
    }
}
