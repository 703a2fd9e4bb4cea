//! The mission's section of a scenario, in the mission's own type.

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

/// The values that a scenario states for its mission. In a file they are the table `[NAME]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MissionSection(Option<Stated>);

/// A stated section. Only the mission can name the types of itself and of its section.
#[derive(Clone, Debug)]
struct Stated {
    name: &'static str,
    mission: Arc<dyn Any + Send + Sync>,
    values: Box<dyn Section>,
}

/// The type of a mission's section, which can be written, copied and compared.
pub trait Section: Any + Debug + Send + Sync + erased_serde::Serialize {
    /// Returns a copy of the section.
    fn clone_box(&self) -> Box<dyn Section>;
    /// Returns true if the other section has the same type and equal values.
    fn equals(&self, other: &dyn Section) -> bool;
}

impl<T: Any + Clone + Debug + PartialEq + Send + Serialize + Sync> Section for T {
    fn clone_box(&self) -> Box<dyn Section> {
        Box::new(self.clone())
    }

    fn equals(&self, other: &dyn Section) -> bool {
        (other as &dyn Any).downcast_ref::<T>() == Some(self)
    }
}

impl Clone for Box<dyn Section> {
    fn clone(&self) -> Self {
        (**self).clone_box()
    }
}

impl MissionSection {
    /// Creates a section of the mission with this name.
    pub(super) fn from_values(
        name: &'static str,
        mission: Arc<dyn Any + Send + Sync>,
        values: Box<dyn Section>,
    ) -> Self {
        Self(Some(Stated {
            name,
            mission,
            values,
        }))
    }

    /// Returns the mission's name, or `None` without a mission.
    #[must_use]
    pub fn name(&self) -> Option<&'static str> {
        Some(self.0.as_ref()?.name)
    }

    /// Returns the mission if it has this type.
    pub(super) fn mission<T: Any>(&self) -> Option<&T> {
        self.0.as_ref()?.mission.downcast_ref()
    }

    /// Returns the values if they have this type.
    #[must_use]
    pub fn values<T: Any>(&self) -> Option<&T> {
        (&*self.0.as_ref()?.values as &dyn Any).downcast_ref()
    }

    /// Returns the values for writing if they have this type.
    pub fn values_mut<T: Any>(&mut self) -> Option<&mut T> {
        (&mut *self.0.as_mut()?.values as &mut dyn Any).downcast_mut()
    }
}

/// Compares missions by their names.
impl PartialEq for Stated {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name && self.values.equals(&*other.values)
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

        let mut map = serializer.serialize_map(Some(self.0.iter().count()))?;
        if let Some(stated) = &self.0 {
            map.serialize_entry(stated.name, &Values(&*stated.values))?;
        }
        map.end()
    }
}
