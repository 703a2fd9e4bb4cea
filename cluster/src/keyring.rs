//! The keys of one member of a network run, as `alliance cluster keys` creates them.

use std::fmt;

use scenario::Problem;
use x509_parser::pem::parse_x509_pem;
use x509_parser::time::ASN1Time;

use crate::key_files::KeyFiles;

/// The time before the end of a certificate from which on it is reported: two weeks, s.
const WARNING_S: i64 = 14 * 86_400;

/// The keys that prove the identity of a member.
#[derive(Clone, PartialEq, Eq)]
pub struct Keyring {
    /// `world`, `robot-NAME` or `host-NAME`: the stem of the file names, the name in the certificate and the user name
    /// on the bus.
    pub identity: String,
    /// The certificate of the authority for all members. PEM, like the other two.
    pub ca: String,
    pub certificate: String,
    pub key: String,
    /// The secret, 32 hexadecimal digits: the password of the member, which also seals its messages.
    pub secret: String,
}

/// Omits the secret contents.
impl fmt::Debug for Keyring {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "Keyring({})", self.identity)
    }
}

impl Keyring {
    /// Reads and checks the keys of a member.
    pub fn read(files: &KeyFiles, identity: &str) -> Result<Self, Problem> {
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

    /// Returns a warning if a certificate ends within two weeks.
    #[must_use]
    pub fn ends_soon(&self) -> Option<String> {
        ends_soon([&self.ca, &self.certificate], ASN1Time::now())
    }

    /// Reads only the secret of a member: all that a host needs of its robots.
    pub fn secret(files: &KeyFiles, identity: &str) -> Result<String, Problem> {
        let name = format!("{identity}.secret");
        let text = files.private(&name)?;
        let text = text.trim();
        if text.len() != 32 || !text.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            let what = "does not contain 32 hexadecimal digits";
            return Err(Problem::with_source(
                files.location(&name),
                what,
                "copy it again",
            ));
        }
        Ok(text.to_owned())
    }
}

/// Returns a warning if a certificate ends within [`WARNING_S`] from now.
fn ends_soon(certificates: [&str; 2], now: ASN1Time) -> Option<String> {
    let end = |text: &str| {
        let (_, pem) = parse_x509_pem(text.as_bytes()).ok()?;
        Some(pem.parse_x509().ok()?.validity().not_after)
    };
    let first = certificates.into_iter().filter_map(end).min()?;
    (first.timestamp() - now.timestamp() < WARNING_S).then(|| {
        format!("a certificate ends on {first}; create new keys with `alliance cluster keys`")
    })
}

/// Reads a certificate and checks that it is valid now. If `member` is given, the certificate must belong to that member.
fn read_certificate(
    files: &KeyFiles,
    name: &str,
    member: Option<&str>,
    now: ASN1Time,
) -> Result<String, Problem> {
    let text = files.public(name)?;
    let problem =
        |what: String, remedy: &str| Problem::with_source(files.location(name), what, remedy);
    let malformed = || problem("contains no certificate".to_owned(), "copy it again");
    let (_, pem) = parse_x509_pem(text.as_bytes()).map_err(|_| malformed())?;
    let certificate = pem.parse_x509().map_err(|_| malformed())?;
    let mut names = certificate.subject().iter_common_name();
    let found = names.next().and_then(|name| name.as_str().ok());
    if let Some(identity) = member.filter(|identity| found != Some(identity)) {
        let found = found.unwrap_or_default().escape_default();
        let what = format!("is the certificate of '{found}'");
        return Err(problem(
            what,
            &format!("copy the certificate of '{identity}'"),
        ));
    }
    let dates = certificate.validity();
    if !dates.is_valid_at(now) {
        let (from, to) = (dates.not_before, dates.not_after);
        let what = format!("is valid from {from} to {to}, but this machine's clock shows {now}");
        return Err(problem(what, "correct the clock or create new keys"));
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

    /// Creates a folder with the keys of gold. The certificate has the given name and is valid from 2020 to the end of
    /// `last_year`.
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

    #[test]
    fn a_certificate_that_ends_within_two_weeks_is_reported() {
        let keyring = read(&keys("robot-gold", 3000)).unwrap();
        assert_eq!(keyring.ends_soon(), None);
        // It ends on 31 December 3000 at 00:00.
        let end = date_time_ymd(3000, 12, 31).unix_timestamp();
        let warning = |days: i64| {
            let now = ASN1Time::from_timestamp(end - 86_400 * days).unwrap();
            ends_soon([&keyring.ca, &keyring.certificate], now)
        };
        assert_eq!(warning(14), None);
        let text = warning(13).unwrap();
        assert!(text.starts_with("a certificate ends on Dec 31 "), "{text}");
    }

    fn read(dir: &TempDir) -> Result<Keyring, Problem> {
        Keyring::read(&KeyFiles::Folder(dir.path().to_owned()), "robot-gold")
    }

    /// Returns the error message for the keys of gold, without the folder.
    #[track_caller]
    fn refused(dir: &TempDir) -> String {
        let error = read(dir).unwrap_err();
        let line = error.to_string();
        assert_eq!(line.lines().count(), 1);
        line.replace(&format!("{}/", dir.path().display()), "")
    }

    #[test]
    fn keys_are_read_from_a_folder_or_from_memory() {
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
            "standard input, robot-blue.pem: file not found; copy it from the folder that `alliance cluster keys` created"
        );
    }

    #[test]
    fn the_error_names_the_missing_file() {
        for name in [
            "ca.pem",
            "robot-gold.pem",
            "robot-gold.key",
            "robot-gold.secret",
        ] {
            let dir = keys("robot-gold", 4000);
            fs::remove_file(dir.path().join(name)).unwrap();
            let expected = format!(
                "{name}: file not found; copy it from the folder that `alliance cluster keys` created"
            );
            assert_eq!(refused(&dir), expected);
            // A folder of the same name does not count as the file.
            fs::create_dir(dir.path().join(name)).unwrap();
            fs::set_permissions(dir.path().join(name), fs::Permissions::from_mode(0o700)).unwrap();
            let line = refused(&dir);
            assert!(line.starts_with(&format!("{name}: ")), "{line}");
        }
        let nowhere =
            Keyring::read(&KeyFiles::Folder("/nowhere/keys".into()), "world").unwrap_err();
        assert_eq!(
            nowhere.to_string(),
            "/nowhere/keys/ca.pem: file not found; copy it from the folder that `alliance cluster keys` created"
        );
    }

    #[test]
    fn secret_files_must_be_private() {
        for (name, mode) in [("robot-gold.key", 0o640), ("robot-gold.secret", 0o604)] {
            let dir = keys("robot-gold", 4000);
            fs::set_permissions(dir.path().join(name), fs::Permissions::from_mode(mode)).unwrap();
            assert_eq!(
                refused(&dir),
                format!("{name}: other users can read or change it; run `chmod 600` on it")
            );
        }
        let dir = keys("robot-gold", 4000);
        fs::set_permissions(dir.path().join("ca.pem"), fs::Permissions::from_mode(0o644)).unwrap();
        assert!(read(&dir).is_ok());
    }

    #[test]
    fn malformed_files_are_rejected() {
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
                format!("{name}: does not contain 32 hexadecimal digits; copy it again")
            );
        }
        for name in ["ca.pem", "robot-gold.pem"] {
            let dir = keys("robot-gold", 4000);
            fs::copy(dir.path().join("robot-gold.key"), dir.path().join(name)).unwrap();
            assert_eq!(
                refused(&dir),
                format!("{name}: contains no certificate; copy it again")
            );
        }
        assert_eq!(
            refused(&keys("robot-blue", 4000)),
            "robot-gold.pem: is the certificate of 'robot-blue'; copy the certificate of 'robot-gold'"
        );
    }

    #[test]
    fn an_expired_certificate_is_rejected_with_its_dates() {
        let line = refused(&keys("robot-gold", 2020));
        let (dates, rest) = line
            .split_once(", but this machine's clock shows ")
            .unwrap();
        assert_eq!(
            dates,
            "robot-gold.pem: is valid from Jan  1 00:00:00 2020 +00:00 to Dec 31 00:00:00 2020 +00:00"
        );
        let (_, remedy) = rest.split_once("; ").unwrap();
        assert_eq!(remedy, "correct the clock or create new keys");
    }
}
