//! Serialization of short lists. The encoding is that of any list, and a list with few entries needs no heap memory.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};
use serde::ser::{Serialize, Serializer};
use smallvec::{Array, SmallVec};

/// The largest number of entries. Longer lists exceed the size limit of an allocator's message.
const MOST: usize = super::OPEN_MESSAGE_MAX;

pub fn serialize<A: Array, S: Serializer>(list: &SmallVec<A>, to: S) -> Result<S::Ok, S::Error>
where
    A::Item: Serialize,
{
    list.as_slice().serialize(to)
}

pub fn deserialize<'de, A: Array, D: Deserializer<'de>>(from: D) -> Result<SmallVec<A>, D::Error>
where
    A::Item: Deserialize<'de>,
{
    struct Few<A>(PhantomData<A>);

    impl<'de, A: Array<Item: Deserialize<'de>>> Visitor<'de> for Few<A> {
        type Value = SmallVec<A>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "at most {MOST} entries")
        }

        fn visit_seq<S: SeqAccess<'de>>(self, mut entries: S) -> Result<SmallVec<A>, S::Error> {
            let mut list = SmallVec::new();
            while let Some(entry) = entries.next_element()? {
                if list.len() == MOST {
                    return Err(S::Error::invalid_length(MOST + 1, &self));
                }
                list.push(entry);
            }
            Ok(list)
        }
    }

    from.deserialize_seq(Few(PhantomData))
}
