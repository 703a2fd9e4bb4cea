//! Who may speak in a run: every message is sealed. The run's secret is the `token` of its [`crate::rendezvous`]; each robot and host has
//! one of its own, [`derived`] from it, for what it and the world tell each other.
//!
//! A seal is a keyed hash (SipHash-2-4) over the key expression and the message. It tells bytes that a holder of the secret made
//! for this very key from all others: noise, forgeries, a true message of one robot on another's key. It hides nothing, and a
//! true message put again still bears a true seal: what is old is told by tick, incarnation, nonce or number.
//!
//! Broadcasts are for many. On one machine, where all processes of a user can read the token anyway, the token seals them. In a run
//! over a network there are [`Pairs`]: nobody can speak for another.

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
use crate::member;

/// Bytes of a seal, after the message.
pub const SEAL_BYTES: usize = 8;

/// The secret of a run.
#[derive(Clone)]
pub struct Secret {
    keyed: SipHasher24,
    hmac: Hmac<Sha256>,
}

/// The secret of a [`member`] of the run of that token: 32 hexadecimal digits, the first 16 bytes of HMAC-SHA256 with the
/// token's text as the key, over the identity.
#[must_use]
pub fn derived(token: &str, identity: &str) -> String {
    let digest = keyed(token).chain_update(identity).finalize().into_bytes();
    hexadecimal(&digest[..16])
}

fn keyed(token: &str) -> Hmac<Sha256> {
    // HMAC takes a key of any length.
    Hmac::new_from_slice(token.as_bytes()).expect("any token is a key")
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Seals of broadcasts in a run over a network: behind the message a mark for each member, robots in order of rank and then the world,
/// by the key that the sender and this member have in common, and nobody else but the world.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pairs {
    /// Place of whose these are.
    own: usize,
    /// By place; that of its own is not used.
    keys: Vec<u128>,
}

impl Pairs {
    /// Those of a member, by its place among all of them.
    #[must_use]
    pub fn new(own: usize, keys: Vec<u128>) -> Self {
        Self { own, keys }
    }

    /// The keys that the member of that name has in common with each of the members of the run of that token.
    #[must_use]
    pub fn keys(token: &str, own: &str, members: &[&str]) -> Vec<u128> {
        let common = |other: &str| {
            let (first, second) = if own < other {
                (own, other)
            } else {
                (other, own)
            };
            // No identity has a space.
            let pair = keyed(token)
                .chain_update(first)
                .chain_update(" ")
                .chain_update(second);
            let digest = pair.finalize().into_bytes();
            u128::from_le_bytes(*digest.first_chunk().expect("SHA-256 has 32 bytes"))
        };
        members.iter().map(|other| common(other)).collect()
    }

    /// Encodes a message for that key and seals it for everybody.
    ///
    /// # Errors
    /// See [`encode`].
    pub fn seal<T: Serialize>(&self, key: &str, message: &T) -> Result<Vec<u8>, CodecError> {
        let mut bytes = encode(message)?;
        let length = bytes.len();
        bytes.reserve(self.keys.len() * SEAL_BYTES);
        for pair in &self.keys {
            let mark = mark(hasher(pair.to_le_bytes()), key, &bytes[..length]);
            bytes.extend(mark);
        }
        Ok(bytes)
    }

    /// Decodes a message that the member at that place has sealed for that key.
    ///
    /// # Errors
    /// Any [`OpenError`].
    pub fn open<T: DeserializeOwned>(
        &self,
        key: &str,
        sealed: &[u8],
        sender: usize,
    ) -> Result<T, OpenError> {
        let length = sealed.len().checked_sub(self.keys.len() * SEAL_BYTES);
        let (Some(length), Some(pair)) = (length, self.keys.get(sender)) else {
            return Err(OpenError::Unsealed);
        };
        let (message, marks) = sealed.split_at(length);
        let place = self.own * SEAL_BYTES..(self.own + 1) * SEAL_BYTES;
        if marks[place] != mark(hasher(pair.to_le_bytes()), key, message) {
            return Err(OpenError::Unsealed);
        }
        Ok(decode(message)?)
    }
}

#[inline]
fn hasher(key: [u8; 16]) -> SipHasher24 {
    SipHasher24::new_with_key(&key)
}

/// The seal of these bytes for that key.
#[inline]
fn mark(mut hasher: SipHasher24, key: &str, message: &[u8]) -> [u8; SEAL_BYTES] {
    hasher.write(key.as_bytes());
    // No key expression has a zero byte, so key and message cannot be cut differently.
    hasher.write_u8(0);
    hasher.write(message);
    hasher.finish().to_le_bytes()
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
            keyed: hasher(key),
            hmac: keyed(token),
        }
    }

    /// That of a robot of the run of that token.
    #[must_use]
    pub fn of_robot(token: &str, name: &str) -> Self {
        Self::of(&derived(token, &member::robot(name)))
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
        let mut mac = self.hmac.clone();
        mac.update(key.as_bytes());
        mac.update(&[0]);
        mac.update(text);
        hexadecimal(&mac.finalize().into_bytes())
    }

    /// The seal of these bytes for that key.
    #[inline]
    #[must_use]
    pub fn mark(&self, key: &str, message: &[u8]) -> [u8; SEAL_BYTES] {
        mark(self.keyed, key, message)
    }
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

    /// By Python: `hmac.new(b"abc", b"robot-gold", "sha256").hexdigest()[:32]`.
    #[test]
    fn a_members_secret_is_derived_from_the_token() {
        assert_eq!(
            derived("abc", "robot-gold"),
            "2707060aa0b6371f9ddd948b28b9d406"
        );
        assert_ne!(derived("abc", "robot-gold"), derived("abc", "robot-blue"));
    }

    #[test]
    fn a_broadcast_is_opened_by_everybody_as_its_senders_and_nobody_elses() {
        let members = ["robot-blue", "robot-gold", "robot-green", "world"];
        let of = |own: usize| Pairs::new(own, Pairs::keys("abc", members[own], &members));
        let sealed = of(1).seal(KEY, &7_u32).unwrap();
        for own in [0, 2, 3] {
            assert_eq!(of(own).open::<u32>(KEY, &sealed, 1).unwrap(), 7);
            for other in [0, 2, 3, 4] {
                if other != own {
                    assert!(of(own).open::<u32>(KEY, &sealed, other).is_err());
                }
            }
            assert!(of(own).open::<u32>("alliance/r/other", &sealed, 1).is_err());
            for length in 0..sealed.len() {
                assert!(of(own).open::<u32>(KEY, &sealed[..length], 1).is_err());
            }
        }
        // Who is told gold's words can say them again to nobody else as gold's: the marks for others are by keys that it does not have.
        let mut forged = of(0).seal(KEY, &8_u32).unwrap();
        assert!(of(2).open::<u32>(KEY, &forged, 1).is_err());
        forged.rotate_left(SEAL_BYTES);
        assert!(of(2).open::<u32>(KEY, &forged, 1).is_err());
    }

    #[test]
    fn random_bits_differ() {
        assert_ne!(random().unwrap(), random().unwrap());
    }
}
