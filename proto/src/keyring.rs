//! The keys of one member of a team on several machines, as `alliance keys` makes them: found and checked before anything starts.

use std::fs;
use std::io::{self, ErrorKind};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use x509_parser::pem::parse_x509_pem;
use x509_parser::time::ASN1Time;

/// Who proves by which files that it is that member.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Keyring {
    /// `world`, `robot-NAME` or `host-NAME`: stem of its files, name in its certificate, and user name on the bus.
    pub identity: String,
    /// Certificate of the authority that has signed those of all members, as an absolute path like the other two.
    pub ca: PathBuf,
    /// Its certificate.
    pub certificate: PathBuf,
    /// The private key of that.
    pub key: PathBuf,
    /// Its secret, which is its password and seals what it says: 32 hexadecimal digits.
    pub secret: String,
}

/// Why the keys of a member cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum KeyringError {
    /// There is no such folder, or no such file in it.
    #[error("{0}: is not there; copy it from where `alliance keys` made it")]
    Missing(PathBuf),
    /// The file system refused.
    #[error("{path}: {error}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// What it said.
        error: io::Error,
    },
    /// Others than its owner may read a file that is secret.
    #[error("{0}: others may read or change it; `chmod 600` it")]
    Open(PathBuf),
    /// It is no secret.
    #[error("{0}: does not hold 32 hexadecimal digits; copy it again")]
    Secret(PathBuf),
    /// It is no certificate.
    #[error("{0}: holds no certificate; copy it again")]
    Certificate(PathBuf),
    /// Somebody has copied a file to the wrong name.
    #[error("{path}: is the certificate of '{of}'; copy that of '{identity}'")]
    Another {
        /// Which file.
        path: PathBuf,
        /// Whose it is.
        of: String,
        /// Whose it ought to be.
        identity: String,
    },
    /// Today is not within its dates.
    #[error(
        "{path}: is valid from {from} to {to}, and here it is {now}; set this machine's clock right, or make new keys"
    )]
    Date {
        /// Which file.
        path: PathBuf,
        /// The first second of it.
        from: String,
        /// The last.
        to: String,
        /// The clock of this machine.
        now: String,
    },
}

impl Keyring {
    /// The keys of that member in a folder.
    ///
    /// # Errors
    /// The first file that is missing, cannot be read, is no such file or another's, is open to others though it is secret, or whose
    /// dates are over or still to come.
    pub fn read(dir: &Path, identity: &str) -> Result<Self, KeyringError> {
        let dir = std::path::absolute(dir).map_err(|error| at(dir, error))?;
        fs::metadata(&dir).map_err(|error| at(&dir, error))?;
        let file = |name: &str, ending: &str| dir.join(format!("{name}.{ending}"));
        let (ca, certificate) = (file("ca", "pem"), file(identity, "pem"));
        let (key, secret) = (file(identity, "key"), file(identity, "secret"));
        let now = ASN1Time::now();
        check_certificate(&ca, None, now)?;
        check_certificate(&certificate, Some(identity), now)?;
        read_private(&key)?;
        let text = read_secret(secret)?;
        Ok(Self {
            identity: identity.to_owned(),
            ca,
            certificate,
            key,
            secret: text,
        })
    }

    /// The secret alone of that member in a folder: all that a host needs of its robots.
    ///
    /// # Errors
    /// When it is missing, cannot be read, is no such file, or is open to others.
    pub fn secret(dir: &Path, identity: &str) -> Result<String, KeyringError> {
        read_secret(dir.join(format!("{identity}.secret")))
    }
}

fn read_secret(path: PathBuf) -> Result<String, KeyringError> {
    let text = read_private(&path)?;
    let text = text.trim();
    if text.len() != 32 || !text.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return Err(KeyringError::Secret(path));
    }
    Ok(text.to_owned())
}

/// Whether it is a certificate, of that member if one is named, and of today.
fn check_certificate(path: &Path, of: Option<&str>, now: ASN1Time) -> Result<(), KeyringError> {
    let bytes = fs::read(path).map_err(|error| at(path, error))?;
    let none = || KeyringError::Certificate(path.to_owned());
    let (_, pem) = parse_x509_pem(&bytes).map_err(|_| none())?;
    let certificate = pem.parse_x509().map_err(|_| none())?;
    let mut names = certificate.subject().iter_common_name();
    let name = names.next().and_then(|name| name.as_str().ok());
    if let Some(identity) = of.filter(|identity| name != Some(identity)) {
        return Err(KeyringError::Another {
            path: path.to_owned(),
            of: name.unwrap_or_default().escape_default().to_string(),
            identity: identity.to_owned(),
        });
    }
    let dates = certificate.validity();
    if !dates.is_valid_at(now) {
        return Err(KeyringError::Date {
            path: path.to_owned(),
            from: dates.not_before.to_string(),
            to: dates.not_after.to_string(),
            now: now.to_string(),
        });
    }
    Ok(())
}

/// What is in a file that is nobody's but its owner's.
fn read_private(path: &Path) -> Result<String, KeyringError> {
    let metadata = fs::metadata(path).map_err(|error| at(path, error))?;
    if metadata.permissions().mode() & 0o077 != 0 {
        return Err(KeyringError::Open(path.to_owned()));
    }
    fs::read_to_string(path).map_err(|error| at(path, error))
}

fn at(path: &Path, error: io::Error) -> KeyringError {
    let path = path.to_owned();
    match error.kind() {
        ErrorKind::NotFound => KeyringError::Missing(path),
        _ => KeyringError::Io { path, error },
    }
}

#[cfg(test)]
mod tests {
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

    /// What is said of the keys of gold, without the folder.
    #[track_caller]
    fn refused(dir: &TempDir) -> String {
        let error = Keyring::read(dir.path(), "robot-gold").unwrap_err();
        let line = error.to_string();
        assert_eq!(line.lines().count(), 1);
        line.replace(&format!("{}/", dir.path().display()), "")
    }

    #[test]
    fn what_is_there_is_found() {
        let dir = keys("robot-gold", 4000);
        let read = Keyring::read(dir.path(), "robot-gold").unwrap();
        let path = |name| dir.path().join(name);
        let expected = Keyring {
            identity: "robot-gold".to_owned(),
            ca: path("ca.pem"),
            certificate: path("robot-gold.pem"),
            key: path("robot-gold.key"),
            secret: "0123456789abcdef0123456789ABCDEF".to_owned(),
        };
        assert_eq!(read, expected);
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
        let nowhere = Keyring::read(Path::new("/nowhere/keys"), "world").unwrap_err();
        assert_eq!(
            nowhere.to_string(),
            "/nowhere/keys: is not there; copy it from where `alliance keys` made it"
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
        assert!(Keyring::read(dir.path(), "robot-gold").is_ok());
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
