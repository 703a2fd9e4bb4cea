//! Encoding of requests and replies, for the world and its clients.

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{Reply, Request};
use crate::codec::{CodecError, LIMIT_BYTES};
use crate::keys::KeyExpressions;
use crate::secret::{OpenError, SEAL_BYTES, Secret};

/// The maximum length of a nonce, bytes.
const MAX_NONCE_BYTES: usize = 64;

/// The maximum number of characters quoted from an invalid message.
const MAX_QUOTED: usize = 300;

/// The encoding of a request and of its reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// bincode, with the seal at its end.
    Bincode,
    /// JSON, with the seal in the attachment.
    Json,
}

impl Format {
    /// Returns the form for a zenoh encoding. Every encoding except `application/json` means bincode.
    #[must_use]
    pub fn from_zenoh(encoding: &str) -> Self {
        // A parameter such as the character set may follow.
        match encoding.split(';').next() {
            Some("application/json") => Self::Json,
            _ => Self::Bincode,
        }
    }

    #[must_use]
    pub fn encoding(self) -> &'static str {
        match self {
            Self::Bincode => "zenoh/bytes",
            Self::Json => "application/json",
        }
    }
}

/// A message in the form that is sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EncodedMessage {
    pub payload: Vec<u8>,
    /// The seal, if the form puts it into the attachment.
    pub attachment: Option<String>,
}

/// An error while a message is read or written. It displays as one line.
#[derive(Debug, thiserror::Error)]
pub enum WireError {
    /// A message larger than [`LIMIT_BYTES`].
    #[error("{0} bytes are more than the limit of {LIMIT_BYTES}")]
    TooLarge(usize),
    /// A JSON message without an attachment.
    #[error(
        "no seal; attach the HMAC-SHA256 of key expression, zero byte and text in hexadecimal, with the run's token as the key"
    )]
    NoSeal,
    /// A seal of another text, key or run.
    #[error(
        "wrong seal; attach the HMAC-SHA256 of key expression, zero byte and text in hexadecimal, with the run's token as the key"
    )]
    WrongSeal,
    /// Bytes without a valid seal.
    #[error(
        "not sealed by a member of this run for this key{}",
        if *.looks_like_json { "; send JSON with the encoding application/json" } else { "" }
    )]
    Unsealed {
        /// True if the payload looks like JSON, so that its encoding is probably missing.
        looks_like_json: bool,
    },
    /// A sealed text that is not a message of the expected type.
    #[error("malformed JSON: {}", quotable(.0))]
    Json(serde_json::Error),
    /// Sealed bytes that are not a message of the expected type.
    #[error(transparent)]
    Codec(#[from] CodecError),
    /// A nonce with a wrong length or with control characters.
    #[error("nonce: use 1 to {MAX_NONCE_BYTES} bytes without control characters")]
    Nonce,
}

/// Returns an error's text, which quotes the sender's message. Escapes and a length limit keep the quote from breaking
/// the line, controlling a terminal or filling a log.
fn quotable(error: &serde_json::Error) -> String {
    let mut text: String = error
        .to_string()
        .chars()
        .take(MAX_QUOTED)
        .flat_map(|c| {
            let escaped = c.is_control().then(|| c.escape_default());
            let plain = (!c.is_control()).then_some(c);
            escaped.into_iter().flatten().chain(plain)
        })
        .collect();
    if error.to_string().chars().count() > MAX_QUOTED {
        text += "…";
    }
    text
}

/// The encoder and decoder of a run's control topic.
#[derive(Clone)]
pub struct ControlTopic {
    key: String,
    secret: Secret,
}

impl ControlTopic {
    /// Creates the control topic of the run with these keys and this secret.
    #[must_use]
    pub fn new(keys: &KeyExpressions, secret: Secret) -> Self {
        Self {
            key: keys.control(),
            secret,
        }
    }

    /// Returns the topic's key expression.
    #[must_use]
    pub fn key(&self) -> &str {
        &self.key
    }

    /// Encodes and seals a client's request.
    ///
    /// # Errors
    /// Returns an error if the request is too large or its nonce is invalid.
    pub fn write_request(
        &self,
        form: Format,
        request: &Request,
    ) -> Result<EncodedMessage, WireError> {
        check_nonce(&request.nonce)?;
        self.write(form, &self.key, request)
    }

    /// Decodes a request in the world. Invalid bytes cause neither a panic nor an allocation above the size limit.
    ///
    /// # Errors
    /// Returns any [`WireError`]. Its text goes to the client in zenoh's error reply.
    pub fn read_request(
        &self,
        form: Format,
        payload: &[u8],
        attachment: Option<&[u8]>,
    ) -> Result<Request, WireError> {
        let request: Request = self.read(form, &self.key, payload, attachment)?;
        check_nonce(&request.nonce)?;
        Ok(request)
    }

    /// Encodes and seals the world's reply to the request of this form and nonce.
    pub fn write_reply(
        &self,
        form: Format,
        nonce: &str,
        reply: &Reply,
    ) -> Result<EncodedMessage, WireError> {
        self.write(form, &self.reply_key(nonce), reply)
    }

    /// Decodes the reply to a client's request of this form and nonce.
    ///
    /// # Errors
    /// Returns any [`WireError`]. The seal of a reply to another request is wrong.
    pub fn read_reply(
        &self,
        form: Format,
        nonce: &str,
        payload: &[u8],
        attachment: Option<&[u8]>,
    ) -> Result<Reply, WireError> {
        self.read(form, &self.reply_key(nonce), payload, attachment)
    }

    /// Returns the key that binds the seal of a reply to its request.
    fn reply_key(&self, nonce: &str) -> String {
        format!("{}/{nonce}", self.key)
    }

    fn write<T: Serialize>(
        &self,
        form: Format,
        key: &str,
        message: &T,
    ) -> Result<EncodedMessage, WireError> {
        match form {
            Format::Bincode => Ok(EncodedMessage {
                payload: self.secret.seal(key, message)?,
                attachment: None,
            }),
            Format::Json => {
                let payload = serde_json::to_vec(message).map_err(WireError::Json)?;
                check_size(payload.len(), LIMIT_BYTES)?;
                let attachment = Some(self.secret.mark_text(key, &payload));
                Ok(EncodedMessage {
                    payload,
                    attachment,
                })
            }
        }
    }

    fn read<T: DeserializeOwned>(
        &self,
        form: Format,
        key: &str,
        payload: &[u8],
        attachment: Option<&[u8]>,
    ) -> Result<T, WireError> {
        match form {
            Format::Bincode => {
                check_size(payload.len(), LIMIT_BYTES + SEAL_BYTES)?;
                self.secret.open(key, payload).map_err(|error| match error {
                    OpenError::Unsealed => WireError::Unsealed {
                        looks_like_json: payload.trim_ascii_start().starts_with(b"{"),
                    },
                    OpenError::Codec(error) => error.into(),
                })
            }
            Format::Json => {
                check_size(payload.len(), LIMIT_BYTES)?;
                let mark = attachment.ok_or(WireError::NoSeal)?;
                let expected = self.secret.mark_text(key, payload);
                if !mark.eq_ignore_ascii_case(expected.as_bytes()) {
                    return Err(WireError::WrongSeal);
                }
                serde_json::from_slice(payload).map_err(WireError::Json)
            }
        }
    }
}

fn check_size(bytes: usize, limit: usize) -> Result<(), WireError> {
    if bytes > limit {
        return Err(WireError::TooLarge(bytes));
    }
    Ok(())
}

/// Checks a nonce. The seal of the reply covers it, where a zero byte would be a separator.
fn check_nonce(nonce: &str) -> Result<(), WireError> {
    let fits = (1..=MAX_NONCE_BYTES).contains(&nonce.len());
    if fits && !nonce.chars().any(char::is_control) {
        return Ok(());
    }
    Err(WireError::Nonce)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::control::{Armed, ClockCommand, ControlCommand};
    use scenario::fault::{Fault, Order};
    use scenario::testkit::one_of_each;
    use scenario::time::SimTime;

    const FORMS: [Format; 2] = [Format::Bincode, Format::Json];

    fn wire() -> ControlTopic {
        ControlTopic::new(&KeyExpressions::new("r"), Secret::from_token("abc"))
    }

    fn request(nonce: &str, command: ControlCommand) -> Request {
        Request {
            nonce: nonce.to_owned(),
            command,
        }
    }

    fn kill() -> Request {
        request(
            "n",
            ControlCommand::Fault(Order::now(Fault::Kill("gold".to_owned()))),
        )
    }

    fn reread(
        wire: &ControlTopic,
        form: Format,
        written: &EncodedMessage,
    ) -> Result<Request, WireError> {
        let attachment = written.attachment.as_ref().map(String::as_bytes);
        wire.read_request(form, &written.payload, attachment)
    }

    /// Reads JSON with a valid seal.
    fn read_text(text: &[u8]) -> Result<Request, WireError> {
        let wire = wire();
        let mark = wire.secret.mark_text(wire.key(), text);
        wire.read_request(Format::Json, text, Some(mark.as_bytes()))
    }

    #[track_caller]
    fn refused(read: Result<Request, WireError>, line: &str) {
        assert_eq!(read.unwrap_err().to_string(), line);
    }

    #[test]
    fn every_request_is_read_as_it_was_written_in_either_form() {
        let faults = one_of_each().into_iter();
        let commands = faults
            .map(|fault| ControlCommand::Fault(Order::now(fault)))
            .chain([
                ControlCommand::Clear(None),
                ControlCommand::Clear(Some("f1".to_owned())),
                ControlCommand::List,
                ControlCommand::Status,
                ControlCommand::Clock(ClockCommand::Pause),
                ControlCommand::Clock(ClockCommand::Resume),
                ControlCommand::Clock(ClockCommand::Step(7)),
                ControlCommand::Clock(ClockCommand::Speed(None)),
                ControlCommand::Clock(ClockCommand::Speed(Some(2.5))),
            ]);
        for command in commands {
            let request = request("n-1", command);
            for form in FORMS {
                let written = wire().write_request(form, &request).unwrap();
                assert_eq!(reread(&wire(), form, &written).unwrap(), request);
            }
        }
    }

    #[test]
    fn a_reply_answers_its_own_request_alone() {
        let reply = Reply::Armed(Armed {
            id: "f1".to_owned(),
            tick: Some(3),
            t_ms: Some(SimTime(150)),
        });
        for form in FORMS {
            let written = wire().write_reply(form, "n", &reply).unwrap();
            let attachment = written.attachment.as_ref().map(String::as_bytes);
            let read = |nonce| wire().read_reply(form, nonce, &written.payload, attachment);
            assert_eq!(read("n").unwrap(), reply);
            assert!(read("m").is_err());
            // A reply is not accepted as a request either.
            assert!(reread(&wire(), form, &written).is_err());
        }
    }

    #[test]
    fn the_encoding_determines_the_form() {
        for form in FORMS {
            assert_eq!(Format::from_zenoh(form.encoding()), form);
        }
        assert_eq!(
            Format::from_zenoh("application/json;charset=utf-8"),
            Format::Json
        );
        assert_eq!(Format::from_zenoh(""), Format::Bincode);
        assert_eq!(Format::from_zenoh("text/plain"), Format::Bincode);
    }

    #[test]
    fn a_missing_or_wrong_seal_is_refused_with_a_remedy() {
        let wire = wire();
        let json = wire.write_request(Format::Json, &kill()).unwrap();
        let how = "attach the HMAC-SHA256 of key expression, zero byte and text in hexadecimal, with the run's token as the key";
        let read = |attachment| wire.read_request(Format::Json, &json.payload, attachment);
        refused(read(None), &format!("no seal; {how}"));
        refused(read(Some(b"")), &format!("wrong seal; {how}"));
        let other = wire
            .secret
            .mark_text("alliance/other/control", &json.payload);
        refused(read(Some(other.as_bytes())), &format!("wrong seal; {how}"));
        let upper_case = json.attachment.as_ref().unwrap().to_uppercase();
        assert_eq!(read(Some(upper_case.as_bytes())).unwrap(), kill());
        refused(
            wire.read_request(Format::Bincode, &json.payload, None),
            "not sealed by a member of this run for this key; send JSON with the encoding application/json",
        );
        refused(
            wire.read_request(Format::Bincode, b"\x01\x02", None),
            "not sealed by a member of this run for this key",
        );
    }

    #[test]
    fn any_changed_bit_is_detected() {
        for form in FORMS {
            let written = wire().write_request(form, &kill()).unwrap();
            for bit in 0..8 * written.payload.len() {
                let mut other = written.clone();
                other.payload[bit / 8] ^= 1 << (bit % 8);
                assert!(reread(&wire(), form, &other).is_err(), "{form:?} {bit}");
            }
        }
    }

    #[test]
    fn malformed_text_is_refused_in_one_line_with_its_position() {
        refused(
            read_text(b"{"),
            "malformed JSON: EOF while parsing an object at line 1 column 1",
        );
        refused(
            read_text(br#"{"nonce":"n","command":"dance"}"#),
            "malformed JSON: unknown variant `dance`, expected one of `fault`, `clear`, `list`, `status`, `describe`, `clock` at line 1 column 30",
        );
        refused(
            read_text(br#"{"nonce":"n","command":"list","x":1}"#),
            "malformed JSON: unknown field `x`, expected `nonce` or `command` at line 1 column 33",
        );
        refused(
            read_text(
                br#"{"nonce":"n","command":{"fault":{"fault":{"kill":"gold"},"when":"blue"}}}"#,
            ),
            "malformed JSON: 'blue' is not an event; write ROBOT or any, a verb, and if needed a behavior set or an object, \
             as in \"blue activates report-progress\" at line 1 column 71",
        );
        refused(
            read_text(br#"{"nonce":"n","command":"\n\u001b[2J"}"#),
            "malformed JSON: unknown variant `\\n\\u{1b}[2J`, expected one of `fault`, `clear`, `list`, `status`, `describe`, `clock` at line \
             1 column 36",
        );
        let long = format!(r#"{{"nonce":"n","command":"{}"}}"#, "x".repeat(100_000));
        let line = read_text(long.as_bytes()).unwrap_err().to_string();
        assert_eq!(
            line.chars().count(),
            "malformed JSON: ".len() + MAX_QUOTED + 1
        );
    }

    #[test]
    fn a_nonce_is_short_and_plain() {
        for wrong in ["", "a\0b", "a\nb", &"n".repeat(65)] {
            let request = request(wrong, ControlCommand::List);
            let line = "nonce: use 1 to 64 bytes without control characters";
            for form in FORMS {
                let error = wire().write_request(form, &request).unwrap_err();
                assert_eq!(error.to_string(), line);
                // The receiver rejects such a nonce, too.
                let written = wire().write(form, wire().key(), &request).unwrap();
                refused(reread(&wire(), form, &written), line);
            }
        }
        let long = request(&"n".repeat(64), ControlCommand::List);
        assert!(wire().write_request(Format::Json, &long).is_ok());
    }

    #[test]
    fn too_large_messages_are_refused() {
        let robot = "x".repeat(LIMIT_BYTES);
        let request = request("n", ControlCommand::Fault(Order::now(Fault::Kill(robot))));
        for form in FORMS {
            assert!(wire().write_request(form, &request).is_err());
            let payload = vec![b' '; LIMIT_BYTES + SEAL_BYTES + 1];
            refused(
                wire().read_request(form, &payload, None),
                "262153 bytes are more than the limit of 262144",
            );
        }
    }

    proptest! {
        #[test]
        fn arbitrary_bytes_are_refused(payload: Vec<u8>, attachment: Option<Vec<u8>>) {
            for form in FORMS {
                prop_assert!(wire().read_request(form, &payload, attachment.as_deref()).is_err());
                prop_assert!(wire().read_reply(form, "n", &payload, attachment.as_deref()).is_err());
            }
        }

        /// Checks that arbitrary bytes with a valid seal never panic, because a member may be faulty.
        #[test]
        fn arbitrary_sealed_bytes_never_panic(mut bytes: Vec<u8>) {
            let _ = read_text(&bytes);
            let wire = wire();
            let mark = wire.secret.seal_of(wire.key(), &bytes);
            bytes.extend(mark);
            let _ = wire.read_request(Format::Bincode, &bytes, None);
        }

        /// Checks sealed requests with one changed byte, which are closer to valid ones than arbitrary bytes.
        #[test]
        fn damaged_text_never_panics(index: prop::sample::Index, place: prop::sample::Index, byte: u8) {
            let fault = index.get(&one_of_each()).clone();
            let request = request("n", ControlCommand::Fault(Order::now(fault)));
            let mut text = serde_json::to_vec(&request).unwrap();
            *place.get_mut(&mut text) = byte;
            if let Err(error) = read_text(&text) {
                prop_assert!(!error.to_string().chars().any(char::is_control));
            }
        }
    }
}
