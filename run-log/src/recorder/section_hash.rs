//! The hash of one section of a tick.

use prefetch::prefetch;
use proto::codec;
use serde::Serialize;
use xxhash_rust::xxh3::xxh3_64;

/// A hash function of sections with a buffer for their encoding. Each thread needs one of its own.
#[derive(Clone, Default)]
pub struct SectionHash {
    /// A reusable buffer that begins with the encoding of the current section.
    room: Vec<u8>,
}

impl SectionHash {
    #[inline]
    pub(super) fn prefetch(&self) {
        prefetch(&*self.room);
    }

    pub(super) fn of(&mut self, content: &impl Serialize) -> u64 {
        let length = codec::encode_into(content, &mut self.room)
            // Sections are plain data of known length and are written to memory, which cannot fail.
            .expect("a section can be encoded");
        xxh3_64(&self.room[..length])
    }
}
