//! foreign.bin: what robots whose minds are programs of their own have answered. A run is made again from its inputs and the minds
//! that this program has; of those that it has not, their answers are kept.
//!
//! After [`HEADER`] there is a frame for each message, as it was on the bus but for its seal: of each tick and robot the report that
//! counted, and after it the broadcasts that it lists, by index. A frame is its length, 4 bytes, little-endian, and so many bytes of
//! one zlib stream, which is flushed after each frame. The frame of a broadcast that never came to the world is empty.

use flate2::{Compress, Compression, Decompress, FlushCompress, FlushDecompress};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::codec::{CodecError, LIMIT_BYTES, decode, encode};
use crate::team::Broadcast;
use crate::tick::Report;

/// First line of the file. Its messages are of one version of the protocol.
pub const HEADER: &str = "answers, protocol version 10\n";

/// Bytes of a frame's length.
const LENGTH_BYTES: usize = 4;

/// Room that a flushed frame may take beyond its message, bytes.
const OVERHEAD_BYTES: usize = 64;

/// What a robot did in a tick.
#[derive(Clone, Debug, PartialEq)]
pub struct ForeignAnswer {
    /// Its report, which counted.
    pub report: Report,
    /// Its broadcasts, by index; `None`: it never came to the world.
    pub broadcasts: Vec<Option<Broadcast>>,
}

/// Why a file is none, or not whole.
#[derive(Debug, thiserror::Error)]
pub enum ForeignError {
    /// It begins otherwise, or is of another version.
    #[error(
        "it begins with '{0}', which this program does not read; it reads '{start}'",
        start = HEADER.trim_end()
    )]
    Header(String),
    /// A frame holds no message, or another one than should be there.
    #[error("frame {frame}: {why}; the file is damaged")]
    Frame {
        /// Which, from 0.
        frame: usize,
        /// Why.
        why: String,
    },
}

/// Encodes answers, one after the other.
#[derive(Debug)]
pub struct ForeignWriter(Compress);

impl Default for ForeignWriter {
    fn default() -> Self {
        Self(Compress::new(Compression::fast(), true))
    }
}

impl ForeignWriter {
    /// Adds an answer. `broadcasts` are those that came, in any order; of two of the same index the first one counts.
    pub fn add<'b>(
        &mut self,
        report: &Report,
        broadcasts: impl Iterator<Item = &'b Broadcast> + Clone,
        bytes: &mut Vec<u8>,
    ) {
        self.frame(report, bytes);
        for index in 0..report.broadcasts {
            match broadcasts.clone().find(|it| it.index == index) {
                Some(broadcast) => self.frame(broadcast, bytes),
                None => bytes.extend([0; LENGTH_BYTES]),
            }
        }
    }

    fn frame<T: Serialize>(&mut self, message: &T, bytes: &mut Vec<u8>) {
        // It came over the bus, or would have: it is not too large.
        let message = encode(message).unwrap_or_default();
        let start = bytes.len();
        bytes.extend([0; LENGTH_BYTES]);
        let mut rest = message.as_slice();
        loop {
            bytes.reserve(rest.len() + OVERHEAD_BYTES);
            let (before, room) = (self.0.total_in(), bytes.capacity());
            // It fails for want of room alone, and there is room.
            let _ = self.0.compress_vec(rest, bytes, FlushCompress::Sync);
            rest = &rest[(self.0.total_in() - before) as usize..];
            if rest.is_empty() && bytes.len() < room {
                break;
            }
        }
        let length = (bytes.len() - start - LENGTH_BYTES) as u32;
        bytes[start..start + LENGTH_BYTES].copy_from_slice(&length.to_le_bytes());
    }
}

/// Reads a file that has been cut where a tick ends.
///
/// # Errors
/// Any [`ForeignError`].
pub fn read(bytes: &[u8]) -> Result<Vec<ForeignAnswer>, ForeignError> {
    let Some(frames) = bytes.strip_prefix(HEADER.as_bytes()) else {
        let start = bytes.split(|byte| *byte == b'\n').next().unwrap_or(bytes);
        let start = String::from_utf8_lossy(&start[..start.len().min(60)]);
        return if bytes.is_empty() {
            Ok(Vec::new())
        } else {
            Err(ForeignError::Header(start.replace(char::is_control, " ")))
        };
    };
    let mut reader = Reader {
        frames,
        frame: 0,
        stream: Decompress::new(true),
    };
    let mut answers = Vec::new();
    while !reader.frames.is_empty() {
        let report = reader.message::<Report>()?;
        let report = report.ok_or_else(|| reader.damaged("a report is missing"))?;
        let mut broadcasts = Vec::new();
        for _ in 0..report.broadcasts {
            broadcasts.push(reader.message()?);
        }
        answers.push(ForeignAnswer { report, broadcasts });
    }
    Ok(answers)
}

struct Reader<'b> {
    frames: &'b [u8],
    frame: usize,
    stream: Decompress,
}

impl Reader<'_> {
    fn damaged(&self, why: &str) -> ForeignError {
        ForeignError::Frame {
            frame: self.frame,
            why: why.to_owned(),
        }
    }

    /// The next message; `None`: its frame is empty.
    fn message<T: DeserializeOwned>(&mut self) -> Result<Option<T>, ForeignError> {
        let Some((frame, rest)) = split_frame(self.frames) else {
            return Err(self.damaged("it ends too early"));
        };
        let packed = &frame[LENGTH_BYTES..];
        let message = if packed.is_empty() {
            None
        } else {
            let message = self.unpack(packed)?;
            let decoded =
                decode(&message).map_err(|error: CodecError| self.damaged(&error.to_string()))?;
            Some(decoded)
        };
        self.frames = rest;
        self.frame += 1;
        Ok(message)
    }

    fn unpack(&mut self, packed: &[u8]) -> Result<Vec<u8>, ForeignError> {
        let mut message = Vec::with_capacity(4 * packed.len() + OVERHEAD_BYTES);
        let start = self.stream.total_in();
        loop {
            let read = (self.stream.total_in() - start) as usize;
            let unpacked =
                self.stream
                    .decompress_vec(&packed[read..], &mut message, FlushDecompress::Sync);
            unpacked.map_err(|error| self.damaged(&error.to_string()))?;
            let read = (self.stream.total_in() - start) as usize;
            if read == packed.len() && message.len() < message.capacity() {
                return Ok(message);
            }
            if message.len() < message.capacity() || message.len() > LIMIT_BYTES {
                return Err(self.damaged("it holds no message"));
            }
            message.reserve(message.len());
        }
    }
}

/// The first frame, with its length, and what follows it.
fn split_frame(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let length = bytes.first_chunk::<LENGTH_BYTES>()?;
    let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
    bytes.split_at_checked(length.checked_add(LENGTH_BYTES)?)
}

/// The header line and the frames, with their lengths, without a torn last one.
pub(super) fn whole_frames(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let (header, mut frames) = match bytes.split_at_checked(HEADER.len()) {
        Some((header, frames)) if header == HEADER.as_bytes() => (Some(header), frames),
        // What is no such file is read, and refused there.
        _ => ((!bytes.is_empty()).then_some(bytes), &[][..]),
    };
    header.into_iter().chain(std::iter::from_fn(move || {
        let (frame, rest) = split_frame(frames)?;
        frames = rest;
        Some(frame)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{BehaviorId, RobotId};
    use crate::join::PROTOCOL_VERSION;
    use crate::mission::Lore;
    use crate::readings::Actuation;
    use crate::team::{Content, Heartbeat, TaskState};
    use crate::telemetry::Motivation;
    use crate::time::SimTime;

    fn answer(tick: u64, robot: u16) -> ForeignAnswer {
        let broadcast = |index| Broadcast {
            sender: RobotId(robot),
            incarnation: 1,
            tick,
            index,
            seq: tick,
            sent: SimTime(50 * tick),
            body: Content::Heartbeat(Heartbeat {
                state: TaskState::Idle,
                since: SimTime::ZERO,
                set: None,
                task: None,
                progress: 0,
                position: Some(glam::Vec2::new(tick as f32 / 7.0, 1.0)),
                carrying: false,
                lore: Lore::Open(vec![tick as u8; 500]),
            }),
        };
        let count = (tick % 4) as u16;
        ForeignAnswer {
            report: Report {
                robot: RobotId(robot),
                incarnation: 1,
                tick,
                actuation: Actuation {
                    speed_m_s: tick as f32 / 3.0,
                    ..Actuation::default()
                },
                broadcasts: count,
                active: (tick.is_multiple_of(3)).then_some(BehaviorId(2)),
                motivations: vec![Motivation::default(); 6],
                ..Report::default()
            },
            // One of three never came.
            broadcasts: (0..count)
                .map(|index| (index != 1).then(|| broadcast(index)))
                .collect(),
        }
    }

    fn written() -> (Vec<ForeignAnswer>, Vec<u8>) {
        let answers: Vec<_> = (0..40)
            .flat_map(|tick| [answer(tick, 0), answer(tick, 2)])
            .collect();
        let mut bytes = HEADER.as_bytes().to_vec();
        let mut writer = ForeignWriter::default();
        for answer in &answers {
            let came: Vec<_> = answer.broadcasts.iter().flatten().cloned().collect();
            writer.add(&answer.report, came.iter(), &mut bytes);
        }
        (answers, bytes)
    }

    #[test]
    fn the_header_names_the_protocol() {
        assert_eq!(
            HEADER,
            format!("answers, protocol version {PROTOCOL_VERSION}\n")
        );
    }

    #[test]
    fn answers_come_back_and_take_less_room_than_they_did() {
        let (answers, bytes) = written();
        assert_eq!(read(&bytes).unwrap(), answers);
        let plain: usize = answers
            .iter()
            .map(|it| encode(&it.report).unwrap().len())
            .sum();
        assert!(bytes.len() < plain, "{} of {plain}", bytes.len());
        assert_eq!(read(b"").unwrap(), []);
    }

    #[test]
    fn cut_anywhere_the_whole_frames_are_read() {
        let (answers, bytes) = written();
        for end in 0..bytes.len() {
            let whole: usize = whole_frames(&bytes[..end]).map(<[u8]>::len).sum();
            match read(&bytes[..whole]) {
                Ok(read) => assert_eq!(read, answers[..read.len()]),
                // In the middle of the header, or of an answer.
                Err(ForeignError::Header(_)) => assert!(end < HEADER.len()),
                Err(ForeignError::Frame { why, .. }) => assert_eq!(why, "it ends too early"),
            }
        }
    }

    #[test]
    fn damaged_anywhere_it_is_refused_or_read() {
        let (answers, bytes) = written();
        // Some bits between frames mean nothing.
        let is_seen = |at: &usize| {
            let mut damaged = bytes.clone();
            damaged[*at] ^= 0x55;
            read(&damaged).map_or(true, |read| read != answers)
        };
        let places = (0..bytes.len()).step_by(11);
        let all = places.len();
        assert!(places.filter(is_seen).count() > all * 9 / 10);
        let error = read(b"PK\x03\x04zip").unwrap_err().to_string();
        assert_eq!(
            error,
            "it begins with 'PK  zip', which this program does not read; it reads 'answers, protocol version 10'"
        );
    }
}
