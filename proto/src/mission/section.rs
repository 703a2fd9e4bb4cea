//! The section of a scenario that is its mission's own, in a type of the mission's own.

use std::any::Any;
use std::fmt::Debug;

use serde::de::DeserializeOwned;
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

use super::data::{Mission, NO_MISSION};
use crate::scenario::{Problem, Unread};

/// What a scenario says of its mission. In a file it is the table `[NAME]`.
#[derive(Clone, Debug)]
pub struct MissionSection {
    mission: Mission,
    values: Box<dyn Section>,
}

/// The type of a mission's section: any that can be read, written and compared.
pub trait Section: Any + Debug + Send + Sync + erased_serde::Serialize {
    /// A copy.
    fn boxed(&self) -> Box<dyn Section>;
    /// Whether the other one is of the same type and says the same.
    fn is_same(&self, other: &dyn Section) -> bool;
}

impl<T: Any + Clone + Debug + PartialEq + Send + Serialize + Sync> Section for T {
    fn boxed(&self) -> Box<dyn Section> {
        Box::new(self.clone())
    }

    fn is_same(&self, other: &dyn Section) -> bool {
        (other as &dyn Any).downcast_ref::<T>() == Some(self)
    }
}

impl Clone for Box<dyn Section> {
    fn clone(&self) -> Self {
        (**self).boxed()
    }
}

impl MissionSection {
    /// A section of that mission, whose type it is.
    #[must_use]
    pub fn new(mission: Mission, values: impl Section) -> Self {
        let values = Box::new(values);
        Self { mission, values }
    }

    /// The section as it stands in a file.
    ///
    /// # Errors
    /// The first key or value that does not fit.
    pub fn read(mission: Mission, text: Unread<'_>) -> Result<Self, Problem> {
        let values = mission.section(text.completed(&mission.parameters()))?;
        Ok(Self { mission, values })
    }

    /// The mission whose it is.
    #[must_use]
    pub fn mission(&self) -> Mission {
        self.mission
    }

    /// The values, if that is their type.
    #[must_use]
    pub fn values<T: Any>(&self) -> Option<&T> {
        (&*self.values as &dyn Any).downcast_ref()
    }

    /// The same, to be written to.
    pub fn values_mut<T: Any>(&mut self) -> Option<&mut T> {
        (&mut *self.values as &mut dyn Any).downcast_mut()
    }
}

/// That of no mission.
impl Default for MissionSection {
    fn default() -> Self {
        Self {
            mission: NO_MISSION,
            values: Box::new(()),
        }
    }
}

impl PartialEq for MissionSection {
    fn eq(&self, other: &Self) -> bool {
        self.mission == other.mission && self.values.is_same(&*other.values)
    }
}

impl Serialize for MissionSection {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        struct Values<'a>(&'a dyn Section);

        impl Serialize for Values<'_> {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                erased_serde::serialize(self.0, serializer)
            }
        }

        if self.mission == NO_MISSION {
            return serializer.serialize_map(Some(0))?.end();
        }
        let mut map = serializer.serialize_map(Some(1))?;
        map.serialize_entry(self.mission.name(), &Values(&*self.values))?;
        map.end()
    }
}

/// Reads a section as a value of that type, for [`MissionData::section`](super::data::MissionData::section).
///
/// # Errors
/// The first key or value that does not fit.
pub fn section<T: Section + DeserializeOwned>(
    text: Unread<'_>,
) -> Result<Box<dyn Section>, Problem> {
    Ok(Box::new(text.to::<T>()?))
}
