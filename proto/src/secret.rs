//! Authentication of messages: every message is sealed. The run's secret is the `token` of its `cluster::rendezvous::Rendezvous`.
//! Each robot and host has its own secret, [`derived`] from the token, for its messages to and from the world.
//!
//! A seal is a keyed hash (SipHash-2-4) over the key expression and the message. It proves that a holder of the secret
//! created the bytes for this key expression, which excludes noise, forgeries and messages of other keys. It does not
//! encrypt. A repeated message still has a valid seal; the tick, incarnation, nonce or number identifies it as old.
//!
//! The world receives the broadcasts of all robots and passes them on, so a robot needs no keys of its teammates and
//! cannot impersonate them.

use std::fs::File;
use std::hash::Hasher;
use std::io::{self, Read};

use hmac::{Hmac, KeyInit, Mac};
use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::Sha256;
use siphasher::sip::SipHasher24;
use xxhash_rust::xxh3::xxh3_128;

use crate::codec::{CodecError, LIMIT_BYTES, decode_within, encode_within};
use crate::identity;

/// The size of a seal, bytes. The seal follows the message.
pub const SEAL_BYTES: usize = 8;

/// The secret of a run or of a member.
#[derive(Clone)]
pub struct Secret {
    keyed: SipHasher24,
    hmac: Hmac<Sha256>,
}

/// Derives the secret of a `member` from the run's token: 32 hexadecimal digits. They are the first 16 bytes of
/// HMAC-SHA256 over the identity, with the token's text as the key.
#[must_use]
pub fn derived(token: &str, identity: &str) -> String {
    let digest = keyed(token).chain_update(identity).finalize().into_bytes();
    hexadecimal(&digest[..16])
}

fn keyed(token: &str) -> Hmac<Sha256> {
    Hmac::new_from_slice(token.as_bytes()).expect("any token is a key")
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[inline]
fn hasher(key: [u8; 16]) -> SipHasher24 {
    SipHasher24::new_with_key(&key)
}

#[inline]
fn seal_of(mut hasher: SipHasher24, key: &str, message: &[u8]) -> [u8; SEAL_BYTES] {
    hasher.write(key.as_bytes());
    // Key expressions contain no zero byte, so the boundary between key and message is unambiguous.
    hasher.write_u8(0);
    hasher.write(message);
    hasher.finish().to_le_bytes()
}

/// The reason why a sealed message was not opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The seal is not that of a member of the run for this key expression.
    #[error("not sealed by a member of this run for this key")]
    Unsealed,
    #[error(transparent)]
    Codec(#[from] CodecError),
}

impl Secret {
    #[must_use]
    pub fn from_token(token: &str) -> Self {
        // The token is random, so a plain hash is enough to turn a text of any length into a key.
        let key = xxh3_128(token.as_bytes()).to_le_bytes();
        Self {
            keyed: hasher(key),
            hmac: keyed(token),
        }
    }

    /// Creates the secret of a robot from the run's token.
    #[must_use]
    pub fn of_robot(token: &str, name: &str) -> Self {
        Self::from_token(&derived(token, &identity::robot(name)))
    }

    /// Encodes a message and seals it for a key expression.
    pub fn seal<T: Serialize>(&self, key: &str, message: &T) -> Result<Vec<u8>, CodecError> {
        self.seal_within::<T, LIMIT_BYTES>(key, message)
    }

    /// Encodes and seals a message with a size limit of its own, bytes.
    pub fn seal_within<T: Serialize, const LIMIT: usize>(
        &self,
        key: &str,
        message: &T,
    ) -> Result<Vec<u8>, CodecError> {
        let mut bytes = encode_within::<T, LIMIT>(message)?;
        let mark = self.seal_of(key, &bytes);
        bytes.extend(mark);
        Ok(bytes)
    }

    /// Decodes a message that was sealed for a key expression.
    pub fn open<T: DeserializeOwned>(&self, key: &str, sealed: &[u8]) -> Result<T, OpenError> {
        self.open_within::<T, LIMIT_BYTES>(key, sealed)
    }

    /// Decodes a message that was sealed for a key expression, with a size limit of its own, bytes.
    pub fn open_within<T: DeserializeOwned, const LIMIT: usize>(
        &self,
        key: &str,
        sealed: &[u8],
    ) -> Result<T, OpenError> {
        Ok(decode_within::<T, LIMIT>(self.unseal(key, sealed)?)?)
    }

    /// Returns the encoding of a message that was sealed for a key expression.
    pub fn unseal<'s>(&self, key: &str, sealed: &'s [u8]) -> Result<&'s [u8], OpenError> {
        match sealed.split_last_chunk::<SEAL_BYTES>() {
            Some((message, mark)) if self.seal_of(key, message) == *mark => Ok(message),
            _ => Err(OpenError::Unsealed),
        }
    }

    /// Appends a seal to a key without payload, such as a liveliness token, as its last chunk.
    #[must_use]
    pub fn stamp(&self, key: &str) -> String {
        format!("{key}/{:016x}", u64::from_le_bytes(self.seal_of(key, &[])))
    }

    /// Returns the key without its stamp, or `None` if the stamp is invalid.
    #[must_use]
    pub fn stamped<'k>(&self, key: &'k str) -> Option<&'k str> {
        let (plain, _) = key.rsplit_once('/')?;
        (self.stamp(plain) == key).then_some(plain)
    }

    /// Returns the seal of a JSON request or reply, for its attachment. The seal is the HMAC-SHA256 in hexadecimal over
    /// the key expression, a zero byte and the text, with the run's token as the key.
    #[must_use]
    pub fn mark_text(&self, key: &str, text: &[u8]) -> String {
        let mut mac = self.hmac.clone();
        mac.update(key.as_bytes());
        mac.update(&[0]);
        mac.update(text);
        hexadecimal(&mac.finalize().into_bytes())
    }

    #[inline]
    #[must_use]
    pub fn seal_of(&self, key: &str, message: &[u8]) -> [u8; SEAL_BYTES] {
        seal_of(self.keyed, key, message)
    }
}

/// Reads 128 random bits from the operating system, for values that must not be guessed. Never use them in the
/// simulation.
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
        let sealed = Secret::from_token("abc").seal(KEY, &7_u32).unwrap();
        assert_eq!(
            Secret::from_token("abc").open::<u32>(KEY, &sealed).unwrap(),
            7
        );
    }

    #[test]
    fn another_secret_another_key_or_a_changed_bit_is_rejected() {
        let secret = Secret::from_token("abc");
        let sealed = secret.seal(KEY, &"text".to_owned()).unwrap();
        let unsealed = |opened: Result<String, OpenError>| {
            assert!(matches!(opened, Err(OpenError::Unsealed)), "{opened:?}");
        };
        unsealed(Secret::from_token("abd").open(KEY, &sealed));
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
    fn a_sealed_message_of_another_type_is_malformed() {
        let secret = Secret::from_token("abc");
        let sealed = secret.seal(KEY, &[1_u8; 9]).unwrap();
        assert!(matches!(
            secret.open::<bool>(KEY, &sealed),
            Err(OpenError::Codec(_))
        ));
    }

    #[test]
    fn a_stamp_is_valid_only_for_its_key() {
        let secret = Secret::from_token("abc");
        let stamped = secret.stamp("alliance/r/alive/blue/1");
        assert_eq!(secret.stamped(&stamped), Some("alliance/r/alive/blue/1"));
        let forged = stamped.replace("/1/", "/2/");
        assert_eq!(secret.stamped(&forged), None);
        assert_eq!(secret.stamped("alliance/r/alive/blue/1"), None);
        assert_eq!(Secret::from_token("abd").stamped(&stamped), None);
        assert_eq!(secret.stamped(""), None);
    }

    /// The expected value is from Python: `hmac.new(b"abc", b"robot-gold", "sha256").hexdigest()[:32]`.
    #[test]
    fn a_members_secret_is_derived_from_the_token() {
        assert_eq!(
            derived("abc", "robot-gold"),
            "2707060aa0b6371f9ddd948b28b9d406"
        );
        assert_ne!(derived("abc", "robot-gold"), derived("abc", "robot-blue"));
    }

    #[test]
    fn random_bits_differ() {
        assert_ne!(random().unwrap(), random().unwrap());
    }
}
