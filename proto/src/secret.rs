//! Who may speak in a run: every message is sealed with the run's secret, the `token` of its [`crate::rendezvous`].
//!
//! A seal is a keyed hash (SipHash-2-4) over the key expression and the message. It tells bytes that a member of the run made
//! for this very key from all others: noise, forgeries, a true message of one robot on another's key. It hides nothing, and a
//! true message put again still bears a true seal: what is old is told by tick, incarnation, nonce or number.

use std::fs::File;
use std::hash::Hasher;
use std::io::{self, Read};

use hmac::{Hmac, KeyInit, Mac};
use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::Sha256;
use siphasher::sip::SipHasher24;
use xxhash_rust::xxh3::xxh3_128;

use crate::codec::{CodecError, decode, encode};

/// Bytes of a seal, after the message.
pub const SEAL_BYTES: usize = 8;

/// The secret of a run.
#[derive(Clone)]
pub struct Secret {
    keyed: SipHasher24,
    hmac: Hmac<Sha256>,
}

/// Why a sealed message was not opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// Nobody who knows the secret made these bytes for this key.
    #[error("not sealed by a member of this run for this key")]
    Unsealed,
    /// A member made them, yet they are no such message.
    #[error(transparent)]
    Codec(#[from] CodecError),
}

impl Secret {
    /// The secret that a run's token stands for.
    #[must_use]
    pub fn of(token: &str) -> Self {
        // The token is random: all that is needed here is to make a key of its text, whatever its length.
        let key = xxh3_128(token.as_bytes()).to_le_bytes();
        Self {
            keyed: SipHasher24::new_with_key(&key),
            // HMAC takes a key of any length.
            hmac: Hmac::new_from_slice(token.as_bytes()).expect("any token is a key"),
        }
    }

    /// Encodes a message for that key and seals it.
    ///
    /// # Errors
    /// See [`encode`].
    pub fn seal<T: Serialize>(&self, key: &str, message: &T) -> Result<Vec<u8>, CodecError> {
        let mut bytes = encode(message)?;
        let mark = self.mark(key, &bytes);
        bytes.extend(mark);
        Ok(bytes)
    }

    /// Decodes a message that was sealed for that key.
    ///
    /// # Errors
    /// Any [`OpenError`].
    pub fn open<T: DeserializeOwned>(&self, key: &str, sealed: &[u8]) -> Result<T, OpenError> {
        match sealed.split_last_chunk::<SEAL_BYTES>() {
            Some((message, mark)) if self.mark(key, message) == *mark => Ok(decode(message)?),
            _ => Err(OpenError::Unsealed),
        }
    }

    /// Seals a key that carries no payload, a liveliness token's, by a last chunk of its own.
    #[must_use]
    pub fn stamp(&self, key: &str) -> String {
        format!("{key}/{:016x}", u64::from_le_bytes(self.mark(key, &[])))
    }

    /// The key that was stamped; `None` if no member of the run did it.
    #[must_use]
    pub fn stamped<'k>(&self, key: &'k str) -> Option<&'k str> {
        let (plain, _) = key.rsplit_once('/')?;
        (self.stamp(plain) == key).then_some(plain)
    }

    /// The seal of a JSON request or reply for that key, for its attachment: HMAC-SHA256 in hexadecimal, with the run's token
    /// as the key, over the key expression, a zero byte and the text.
    #[must_use]
    pub fn mark_text(&self, key: &str, text: &[u8]) -> String {
        self.mac(&[key.as_bytes(), &[0], text])
    }

    /// HMAC-SHA256 in hexadecimal, with the token as the key.
    fn mac(&self, parts: &[&[u8]]) -> String {
        let mut mac = self.hmac.clone();
        for part in parts {
            mac.update(part);
        }
        let digest = mac.finalize().into_bytes();
        digest.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// The seal of these bytes for that key.
    #[must_use]
    pub fn mark(&self, key: &str, message: &[u8]) -> [u8; SEAL_BYTES] {
        let mut hasher = self.keyed;
        hasher.write(key.as_bytes());
        // No key expression has a zero byte, so key and message cannot be cut differently.
        hasher.write_u8(0);
        hasher.write(message);
        hasher.finish().to_le_bytes()
    }
}

/// The secret of one member, made of the run's: 32 hexadecimal digits, the first 16 bytes of HMAC-SHA256 with the token's text as the
/// key over the member's name. Whoever knows it knows neither the token nor another member's.
#[must_use]
pub fn derived(token: &str, identity: &str) -> String {
    let mut text = Secret::of(token).mac(&[identity.as_bytes()]);
    text.truncate(32);
    text
}

/// 128 random bits from the operating system: for what must not be guessed, and never for the simulation.
///
/// # Errors
/// When the system has none.
pub fn random() -> io::Result<u128> {
    let mut bytes = [0; 16];
    File::open("/dev/urandom")?.read_exact(&mut bytes)?;
    Ok(u128::from_le_bytes(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY: &str = "alliance/r/robot/blue/tick";

    #[test]
    fn a_member_opens_what_a_member_sealed() {
        let sealed = Secret::of("abc").seal(KEY, &7_u32).unwrap();
        assert_eq!(Secret::of("abc").open::<u32>(KEY, &sealed).unwrap(), 7);
    }

    #[test]
    fn another_runs_secret_another_key_or_another_bit_does_not_open_it() {
        let secret = Secret::of("abc");
        let sealed = secret.seal(KEY, &"text".to_owned()).unwrap();
        let unsealed = |opened: Result<String, OpenError>| {
            assert!(matches!(opened, Err(OpenError::Unsealed)), "{opened:?}");
        };
        unsealed(Secret::of("abd").open(KEY, &sealed));
        unsealed(secret.open("alliance/r/robot/gold/tick", &sealed));
        for bit in 0..8 * sealed.len() {
            let mut other = sealed.clone();
            other[bit / 8] ^= 1 << (bit % 8);
            unsealed(secret.open(KEY, &other));
        }
        for length in 0..sealed.len() {
            unsealed(secret.open(KEY, &sealed[..length]));
        }
    }

    #[test]
    fn a_sealed_message_of_another_type_is_malformed_not_misread() {
        let secret = Secret::of("abc");
        let sealed = secret.seal(KEY, &[1_u8; 9]).unwrap();
        assert!(matches!(
            secret.open::<bool>(KEY, &sealed),
            Err(OpenError::Codec(_))
        ));
    }

    #[test]
    fn a_stamp_holds_for_its_key_alone() {
        let secret = Secret::of("abc");
        let stamped = secret.stamp("alliance/r/alive/blue/1");
        assert_eq!(secret.stamped(&stamped), Some("alliance/r/alive/blue/1"));
        let forged = stamped.replace("/1/", "/2/");
        assert_eq!(secret.stamped(&forged), None);
        assert_eq!(secret.stamped("alliance/r/alive/blue/1"), None);
        assert_eq!(Secret::of("abd").stamped(&stamped), None);
        assert_eq!(secret.stamped(""), None);
    }

    /// By Python: `hmac.new(b"0123456789abcdef0123456789abcdef", b"robot-gold", "sha256").hexdigest()[:32]`.
    #[test]
    fn a_members_secret_is_that_of_any_other_hmac() {
        let token = "0123456789abcdef0123456789abcdef";
        assert_eq!(
            derived(token, "robot-gold"),
            "ab74d249079f51289c81015672d436c8"
        );
        assert_ne!(derived(token, "robot-blue"), derived(token, "robot-gold"));
    }

    #[test]
    fn random_bits_differ() {
        assert_ne!(random().unwrap(), random().unwrap());
    }
}
