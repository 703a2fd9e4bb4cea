//! The keys of one member of a team on several machines, as `alliance keys` makes them: found and checked before anything starts.

use std::fmt;

use x509_parser::pem::parse_x509_pem;
use x509_parser::time::ASN1Time;

use crate::key_files::{KeyFiles, KeyFilesError};

/// By what somebody proves to be that member.
#[derive(Clone, PartialEq, Eq)]
pub struct Keyring {
    /// `world`, `robot-NAME` or `host-NAME`: stem of its files, name in its certificate, and user name on the bus.
    pub identity: String,
    /// Certificate of the authority that has signed those of all members, PEM like the other two.
    pub ca: String,
    /// Its certificate.
    pub certificate: String,
    /// The private key of that.
    pub key: String,
    /// Its secret, which is its password and seals what it says: 32 hexadecimal digits.
    pub secret: String,
}

/// Nothing that is secret.
impl fmt::Debug for Keyring {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "Keyring({})", self.identity)
    }
}

/// Why the keys of a member cannot be used. Files are named with their place.
#[derive(Debug, thiserror::Error)]
pub enum KeyringError {
    /// One is not to be had.
    #[error(transparent)]
    File(#[from] KeyFilesError),
    /// It is no secret.
    #[error("{0}: does not hold 32 hexadecimal digits; copy it again")]
    Secret(String),
    /// It is no certificate.
    #[error("{0}: holds no certificate; copy it again")]
    Certificate(String),
    /// Somebody has copied a file to the wrong name.
    #[error("{file}: is the certificate of '{of}'; copy that of '{identity}'")]
    Another {
        /// Which file.
        file: String,
        /// Whose it is.
        of: String,
        /// Whose it ought to be.
        identity: String,
    },
    /// Today is not within its dates.
    #[error(
        "{file}: is valid from {from} to {to}, and here it is {now}; set this machine's clock right, or make new keys"
    )]
    Date {
        /// Which file.
        file: String,
        /// The first second of it.
        from: String,
        /// The last.
        to: String,
        /// The clock of this machine.
        now: String,
    },
}

impl Keyring {
    /// The keys of that member.
    ///
    /// # Errors
    /// The first file that is missing, cannot be read, is no such file or another's, is open to others though it is secret, or whose
    /// dates are over or still to come.
    pub fn read(files: &KeyFiles, identity: &str) -> Result<Self, KeyringError> {
        let now = ASN1Time::now();
        let certificate = format!("{identity}.pem");
        Ok(Self {
            ca: read_certificate(files, "ca.pem", None, now)?,
            certificate: read_certificate(files, &certificate, Some(identity), now)?,
            key: files.private(&format!("{identity}.key"))?,
            secret: Self::secret(files, identity)?,
            identity: identity.to_owned(),
        })
    }

    /// The secret alone of that member: all that a host needs of its robots.
    ///
    /// # Errors
    /// When it is missing, cannot be read, is no such file, or is open to others.
    pub fn secret(files: &KeyFiles, identity: &str) -> Result<String, KeyringError> {
        let name = format!("{identity}.secret");
        let text = files.private(&name)?;
        let text = text.trim();
        if text.len() != 32 || !text.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            return Err(KeyringError::Secret(files.place(&name)));
        }
        Ok(text.to_owned())
    }
}

/// A certificate, of that member if one is named, and of today.
fn read_certificate(
    files: &KeyFiles,
    name: &str,
    of: Option<&str>,
    now: ASN1Time,
) -> Result<String, KeyringError> {
    let text = files.public(name)?;
    let none = || KeyringError::Certificate(files.place(name));
    let (_, pem) = parse_x509_pem(text.as_bytes()).map_err(|_| none())?;
    let certificate = pem.parse_x509().map_err(|_| none())?;
    let mut names = certificate.subject().iter_common_name();
    let found = names.next().and_then(|name| name.as_str().ok());
    if let Some(identity) = of.filter(|identity| found != Some(identity)) {
        return Err(KeyringError::Another {
            file: files.place(name),
            of: found.unwrap_or_default().escape_default().to_string(),
            identity: identity.to_owned(),
        });
    }
    let dates = certificate.validity();
    if !dates.is_valid_at(now) {
        return Err(KeyringError::Date {
            file: files.place(name),
            from: dates.not_before.to_string(),
            to: dates.not_after.to_string(),
            now: now.to_string(),
        });
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::PermissionsExt;

    use rcgen::{CertificateParams, DnType, KeyPair, date_time_ymd};
    use tempfile::TempDir;

    use super::*;

    /// A folder with the keys of gold, whose certificate is of that name and valid from 2020 to the end of that year.
    fn keys(name: &str, last_year: i32) -> TempDir {
        let dir = tempfile::tempdir().unwrap();
        let key = KeyPair::generate().unwrap();
        let mut params = CertificateParams::default();
        params.distinguished_name.push(DnType::CommonName, name);
        params.not_before = date_time_ymd(2020, 1, 1);
        params.not_after = date_time_ymd(last_year, 12, 31);
        let certificate = params.self_signed(&key).unwrap().pem();
        let write = |name: &str, text: &str| {
            let path = dir.path().join(name);
            fs::write(&path, text).unwrap();
            fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
        };
        let mut ca = CertificateParams::default();
        ca.not_after = date_time_ymd(4000, 1, 1);
        write("ca.pem", &ca.self_signed(&key).unwrap().pem());
        write("robot-gold.pem", &certificate);
        write("robot-gold.key", &key.serialize_pem());
        write("robot-gold.secret", "0123456789abcdef0123456789ABCDEF\n");
        dir
    }

    fn read(dir: &TempDir) -> Result<Keyring, KeyringError> {
        Keyring::read(&KeyFiles::Folder(dir.path().to_owned()), "robot-gold")
    }

    /// What is said of the keys of gold, without the folder.
    #[track_caller]
    fn refused(dir: &TempDir) -> String {
        let error = read(dir).unwrap_err();
        let line = error.to_string();
        assert_eq!(line.lines().count(), 1);
        line.replace(&format!("{}/", dir.path().display()), "")
    }

    #[test]
    fn what_is_there_is_found() {
        let dir = keys("robot-gold", 4000);
        let text = |name| fs::read_to_string(dir.path().join(name)).unwrap();
        let expected = Keyring {
            identity: "robot-gold".to_owned(),
            ca: text("ca.pem"),
            certificate: text("robot-gold.pem"),
            key: text("robot-gold.key"),
            secret: "0123456789abcdef0123456789ABCDEF".to_owned(),
        };
        assert_eq!(read(&dir).unwrap(), expected);
        assert_eq!(format!("{expected:?}"), "Keyring(robot-gold)");
        let names = [
            "ca.pem",
            "robot-gold.pem",
            "robot-gold.key",
            "robot-gold.secret",
        ];
        let files = names.map(|name| (name.to_owned(), text(name)));
        let in_memory = KeyFiles::Memory(files.into_iter().collect());
        assert_eq!(Keyring::read(&in_memory, "robot-gold").unwrap(), expected);
        let other = Keyring::read(&in_memory, "robot-blue").unwrap_err();
        assert_eq!(
            other.to_string(),
            "standard input, robot-blue.pem: is not there; copy it from where `alliance keys` made it"
        );
    }

    #[test]
    fn each_file_that_is_missing_is_named() {
        for name in [
            "ca.pem",
            "robot-gold.pem",
            "robot-gold.key",
            "robot-gold.secret",
        ] {
            let dir = keys("robot-gold", 4000);
            fs::remove_file(dir.path().join(name)).unwrap();
            let expected =
                format!("{name}: is not there; copy it from where `alliance keys` made it");
            assert_eq!(refused(&dir), expected);
            // Where a folder stands in its place, it is not a file.
            fs::create_dir(dir.path().join(name)).unwrap();
            fs::set_permissions(dir.path().join(name), fs::Permissions::from_mode(0o700)).unwrap();
            let line = refused(&dir);
            assert!(line.starts_with(&format!("{name}: ")), "{line}");
        }
        let nowhere =
            Keyring::read(&KeyFiles::Folder("/nowhere/keys".into()), "world").unwrap_err();
        assert_eq!(
            nowhere.to_string(),
            "/nowhere/keys/ca.pem: is not there; copy it from where `alliance keys` made it"
        );
    }

    #[test]
    fn what_is_secret_is_its_owners_alone() {
        for (name, mode) in [("robot-gold.key", 0o640), ("robot-gold.secret", 0o604)] {
            let dir = keys("robot-gold", 4000);
            fs::set_permissions(dir.path().join(name), fs::Permissions::from_mode(mode)).unwrap();
            assert_eq!(
                refused(&dir),
                format!("{name}: others may read or change it; `chmod 600` it")
            );
        }
        let dir = keys("robot-gold", 4000);
        fs::set_permissions(dir.path().join("ca.pem"), fs::Permissions::from_mode(0o644)).unwrap();
        assert!(read(&dir).is_ok());
    }

    #[test]
    fn what_holds_something_else_is_refused() {
        let cases = [
            ("robot-gold.secret", "0123456789abcdef0123456789abcde"),
            ("robot-gold.secret", "0123456789abcdef0123456789abcdeg"),
            ("robot-gold.secret", ""),
        ];
        for (name, text) in cases {
            let dir = keys("robot-gold", 4000);
            fs::write(dir.path().join(name), text).unwrap();
            assert_eq!(
                refused(&dir),
                format!("{name}: does not hold 32 hexadecimal digits; copy it again")
            );
        }
        for name in ["ca.pem", "robot-gold.pem"] {
            let dir = keys("robot-gold", 4000);
            fs::copy(dir.path().join("robot-gold.key"), dir.path().join(name)).unwrap();
            assert_eq!(
                refused(&dir),
                format!("{name}: holds no certificate; copy it again")
            );
        }
        assert_eq!(
            refused(&keys("robot-blue", 4000)),
            "robot-gold.pem: is the certificate of 'robot-blue'; copy that of 'robot-gold'"
        );
    }

    #[test]
    fn dates_and_the_clock_go_together() {
        let line = refused(&keys("robot-gold", 2020));
        let (dates, rest) = line.split_once(", and here it is ").unwrap();
        assert_eq!(
            dates,
            "robot-gold.pem: is valid from Jan  1 00:00:00 2020 +00:00 to Dec 31 00:00:00 2020 +00:00"
        );
        let (_, remedy) = rest.split_once("; ").unwrap();
        assert_eq!(remedy, "set this machine's clock right, or make new keys");
    }
}
