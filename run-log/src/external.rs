//! foreign.bin: the recorded answers of robots with external controllers. A replay runs the controllers that this
//! program contains, and reads the answers of all others from this file.
//!
//! [`HEADER`] is followed by one frame per message, encoded as on the bus but without the seal. For each tick and
//! robot, the report that counted comes first, then the broadcasts that it lists, by index. A frame consists of its
//! length (4 bytes, little-endian) and a piece of one zlib stream, which is flushed after each frame. The frame of a
//! broadcast that did not reach the world is empty.

use flate2::{Compress, Compression, Decompress, FlushCompress, FlushDecompress};
use serde::Serialize;
use serde::de::DeserializeOwned;

use proto::codec::{CodecError, LIMIT_BYTES, decode, encode};
use proto::team::Broadcast;
use proto::tick::Report;

/// The first line of the file, with the protocol version of its messages.
pub const HEADER: &str = "answers, protocol version 14\n";

/// The size of a frame's length field, bytes.
const LENGTH_BYTES: usize = 4;

/// The space that a flushed frame can need in addition to its message, bytes.
const OVERHEAD_BYTES: usize = 64;

/// The output of one robot in one tick.
#[derive(Clone, Debug, PartialEq)]
pub struct ExternalAnswer {
    /// The report that counted in the tick.
    pub report: Report,
    /// The broadcasts of the report, by index; `None` for a broadcast that did not reach the world.
    pub broadcasts: Vec<Option<Broadcast>>,
}

/// An error of a damaged or unknown foreign.bin.
#[derive(Debug, thiserror::Error)]
pub enum ExternalError {
    /// The header is unknown, or has another protocol version.
    #[error(
        "unknown header '{0}'; this program reads '{start}'",
        start = HEADER.trim_end()
    )]
    Header(String),
    /// A frame contains no message, or a message of an unexpected type.
    #[error("frame {frame}: {why}; the file is damaged")]
    Frame {
        /// The frame's number, from 0.
        frame: usize,
        why: String,
    },
}

/// An encoder for a sequence of answers.
#[derive(Debug)]
pub struct ExternalWriter(Compress);

impl Default for ExternalWriter {
    fn default() -> Self {
        Self(Compress::new(Compression::fast(), true))
    }
}

impl ExternalWriter {
    /// Appends an answer to `bytes`. `broadcasts` contains the received broadcasts in any order; the first one with an
    /// index wins.
    ///
    /// # Errors
    /// Returns an error for a message above the size limit. `bytes` is then incomplete.
    pub fn add<'b>(
        &mut self,
        report: &Report,
        broadcasts: impl Iterator<Item = &'b Broadcast> + Clone,
        bytes: &mut Vec<u8>,
    ) -> Result<(), CodecError> {
        self.frame(report, bytes)?;
        for index in 0..report.broadcasts {
            match broadcasts
                .clone()
                .find(|broadcast| broadcast.index == index)
            {
                Some(broadcast) => self.frame(broadcast, bytes)?,
                None => bytes.extend([0; LENGTH_BYTES]),
            }
        }
        Ok(())
    }

    fn frame<T: Serialize>(&mut self, message: &T, bytes: &mut Vec<u8>) -> Result<(), CodecError> {
        let message = encode(message)?;
        let start = bytes.len();
        bytes.extend([0; LENGTH_BYTES]);
        let mut rest = message.as_slice();
        loop {
            bytes.reserve(rest.len() + OVERHEAD_BYTES);
            let (before, room) = (self.0.total_in(), bytes.capacity());
            // Compression fails only when the buffer is full, and space is reserved.
            let _ = self.0.compress_vec(rest, bytes, FlushCompress::Sync);
            rest = &rest[(self.0.total_in() - before) as usize..];
            if rest.is_empty() && bytes.len() < room {
                break;
            }
        }
        let length = (bytes.len() - start - LENGTH_BYTES) as u32;
        bytes[start..start + LENGTH_BYTES].copy_from_slice(&length.to_le_bytes());
        Ok(())
    }
}

/// Decodes a file that ends with a complete tick.
pub fn read(bytes: &[u8]) -> Result<Vec<ExternalAnswer>, ExternalError> {
    let Some(frames) = bytes.strip_prefix(HEADER.as_bytes()) else {
        let start = bytes.split(|byte| *byte == b'\n').next().unwrap_or(bytes);
        let start = String::from_utf8_lossy(&start[..start.len().min(60)]);
        return if bytes.is_empty() {
            Ok(Vec::new())
        } else {
            Err(ExternalError::Header(start.replace(char::is_control, " ")))
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
        answers.push(ExternalAnswer { report, broadcasts });
    }
    Ok(answers)
}

struct Reader<'b> {
    frames: &'b [u8],
    frame: usize,
    stream: Decompress,
}

impl Reader<'_> {
    fn damaged(&self, why: &str) -> ExternalError {
        ExternalError::Frame {
            frame: self.frame,
            why: why.to_owned(),
        }
    }

    /// Returns the next message, or `None` if its frame is empty.
    fn message<T: DeserializeOwned>(&mut self) -> Result<Option<T>, ExternalError> {
        let Some((frame, rest)) = split_frame(self.frames) else {
            return Err(self.damaged("the file ends too early"));
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

    /// Inflates a frame. The inflater may return early with input and room left, so only a call that neither reads nor
    /// writes ends the frame.
    fn unpack(&mut self, packed: &[u8]) -> Result<Vec<u8>, ExternalError> {
        let mut message = Vec::with_capacity(4 * packed.len() + OVERHEAD_BYTES);
        let mut rest = packed;
        while message.len() <= LIMIT_BYTES {
            if message.len() == message.capacity() {
                message.reserve(message.len());
            }
            let (read, written) = (self.stream.total_in(), message.len());
            let unpacked = self
                .stream
                .decompress_vec(rest, &mut message, FlushDecompress::Sync);
            unpacked.map_err(|error| self.damaged(&error.to_string()))?;
            let read = (self.stream.total_in() - read) as usize;
            rest = &rest[read..];
            if read == 0 && message.len() == written {
                break;
            }
        }
        if rest.is_empty() && message.len() <= LIMIT_BYTES {
            Ok(message)
        } else {
            Err(self.damaged("the frame contains no message"))
        }
    }
}

/// Splits `bytes` into the first frame, with its length field, and the rest.
fn split_frame(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let length = bytes.first_chunk::<LENGTH_BYTES>()?;
    let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
    bytes.split_at_checked(length.checked_add(LENGTH_BYTES)?)
}

/// Returns the header line and the complete frames with their length fields.
pub(super) fn whole_frames(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let (header, mut frames) = match bytes.split_at_checked(HEADER.len()) {
        Some((header, frames)) if header == HEADER.as_bytes() => (Some(header), frames),
        // A file with another header is returned unchanged, and `read` rejects it.
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
    use proptest::prelude::*;
    use proto::allocation::{AllocationMessage, OpenMessage};
    use proto::join::PROTOCOL_VERSION;
    use proto::mission::SharedKnowledge;
    use proto::readings::Actuation;
    use proto::team::{BroadcastContent, Heartbeat, TaskState};
    use proto::telemetry::Motivation;
    use scenario::ids::{BehaviorId, RobotId};
    use scenario::time::SimTime;

    fn answer(tick: u64, robot: u32) -> ExternalAnswer {
        let broadcast = |index| Broadcast {
            sender: RobotId(robot),
            incarnation: 1,
            tick,
            index,
            seq: tick,
            sent: SimTime(50 * tick),
            body: BroadcastContent::Heartbeat(Heartbeat {
                state: TaskState::Idle,
                since: SimTime::ZERO,
                set: None,
                task: None,
                progress: 0,
                position: Some(glam::Vec2::new(tick as f32 / 7.0, 1.0)),
                carrying: false,
                shared_knowledge: SharedKnowledge::Open(vec![tick as u8; 500]),
            }),
        };
        let count = (tick % 4) as u16;
        ExternalAnswer {
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
            // The broadcast with index 1 is missing.
            broadcasts: (0..count)
                .map(|index| (index != 1).then(|| broadcast(index)))
                .collect(),
        }
    }

    fn written() -> (Vec<ExternalAnswer>, Vec<u8>) {
        let answers: Vec<_> = (0..40)
            .flat_map(|tick| [answer(tick, 0), answer(tick, 2)])
            .collect();
        let mut bytes = HEADER.as_bytes().to_vec();
        let mut writer = ExternalWriter::default();
        for answer in &answers {
            let received: Vec<_> = answer.broadcasts.iter().flatten().cloned().collect();
            writer
                .add(&answer.report, received.iter(), &mut bytes)
                .unwrap();
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
    fn answers_survive_a_round_trip_and_are_compressed() {
        let (answers, bytes) = written();
        assert_eq!(read(&bytes).unwrap(), answers);
        let plain: usize = answers
            .iter()
            .map(|answer| encode(&answer.report).unwrap().len())
            .sum();
        assert!(bytes.len() < plain, "{} of {plain}", bytes.len());
        assert_eq!(read(b"").unwrap(), []);
    }

    #[test]
    fn a_message_above_the_size_limit_is_an_error() {
        let mut report = answer(1, 0).report;
        report.motivations = vec![Motivation::default(); LIMIT_BYTES];
        let added = ExternalWriter::default().add(&report, [].iter(), &mut Vec::new());
        assert!(matches!(added, Err(CodecError::TooLarge(..))), "{added:?}");
    }

    proptest! {
        /// Content that repeats exactly, with a period above and below that of a message, and with noise.
        #[test]
        fn repeated_content_survives_a_round_trip(
            period in prop::collection::vec(any::<u8>(), 1..40),
            sizes in prop::collection::vec(0..1200_usize, 1..8),
            ticks in 1..400_u64,
            noise in 0..3_u64,
        ) {
            let answers: Vec<_> = (0..ticks)
                .map(|tick| {
                    let size = sizes[tick as usize % sizes.len()];
                    let bytes = period.iter().copied().cycle().take(size);
                    let changed = |byte: u8| byte ^ (noise * tick % 251) as u8;
                    let mut answer = answer(1, 0);
                    for broadcast in answer.broadcasts.iter_mut().flatten() {
                        broadcast.body = BroadcastContent::Allocation(AllocationMessage::Open(OpenMessage {
                            schema: "repeated".to_owned(),
                            bytes: bytes.clone().map(changed).collect(),
                        }));
                    }
                    answer
                })
                .collect();
            let mut bytes = HEADER.as_bytes().to_vec();
            let mut writer = ExternalWriter::default();
            for answer in &answers {
                let received: Vec<_> = answer.broadcasts.iter().flatten().cloned().collect();
                writer.add(&answer.report, received.iter(), &mut bytes).unwrap();
            }
            prop_assert_eq!(read(&bytes).unwrap(), answers);
        }
    }

    #[test]
    fn a_truncated_file_is_read_up_to_its_last_complete_frame() {
        let (answers, bytes) = written();
        for end in 0..bytes.len() {
            let whole: usize = whole_frames(&bytes[..end]).map(<[u8]>::len).sum();
            match read(&bytes[..whole]) {
                Ok(read) => assert_eq!(read, answers[..read.len()]),
                // The cut is inside the header or an answer.
                Err(ExternalError::Header(_)) => assert!(end < HEADER.len()),
                Err(ExternalError::Frame { why, .. }) => assert_eq!(why, "the file ends too early"),
            }
        }
    }

    #[test]
    fn most_damaged_bytes_are_detected() {
        let (answers, bytes) = written();
        // A few bits between frames have no meaning.
        let is_detected = |at: &usize| {
            let mut damaged = bytes.clone();
            damaged[*at] ^= 0x55;
            read(&damaged).map_or(true, |read| read != answers)
        };
        let places = (0..bytes.len()).step_by(11);
        let all = places.len();
        assert!(places.filter(is_detected).count() > all * 9 / 10);
        let error = read(b"PK\x03\x04zip").unwrap_err().to_string();
        assert_eq!(
            error,
            "unknown header 'PK  zip'; this program reads 'answers, protocol version 14'"
        );
    }
}
