//! Tests of the created keys with an X.509 parser and the keyring.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use crate::key_files::KeyFiles;
use crate::keyring::Keyring;
use proto::secret::derived;
use x509_parser::certificate::X509Certificate;
use x509_parser::extensions::GeneralName;
use x509_parser::pem::parse_x509_pem;

use crate::certificates::{CertificateDates, KeyFile, Member, make};
use crate::store;
use time::OffsetDateTime;

fn member(identity: &str, at: &[&str]) -> Member {
    Member {
        identity: identity.to_owned(),
        addresses: at.iter().map(|&at| at.to_owned()).collect(),
    }
}

fn team_files() -> BTreeMap<String, String> {
    let members = [
        member("world", &["10.0.0.1", "world.example.org"]),
        member("host-h2", &["2001:db8::2"]),
        member("robot-gold", &[]),
    ];
    let dates = CertificateDates::days(
        OffsetDateTime::from_unix_timestamp(1_000_000_000).unwrap(),
        2,
    );
    let files = make(&members, dates).unwrap();
    files
        .into_iter()
        .map(|file| (file.name, file.text))
        .collect()
}

fn check<T>(text: &str, read: impl FnOnce(&X509Certificate<'_>) -> T) -> T {
    let (_, pem) = parse_x509_pem(text.as_bytes()).unwrap();
    read(&pem.parse_x509().unwrap())
}

#[test]
fn each_member_has_three_files_and_the_authority_two() {
    let names: Vec<String> = team_files().into_keys().collect();
    let expected = [
        "ca.key",
        "ca.pem",
        "host-h2.key",
        "host-h2.pem",
        "host-h2.secret",
        "robot-gold.key",
        "robot-gold.pem",
        "robot-gold.secret",
        "world.key",
        "world.pem",
        "world.secret",
    ];
    assert_eq!(names, expected);
}

#[test]
fn certificates_have_identity_usage_addresses_and_validity() {
    let files = team_files();
    let issuer = check(&files["ca.pem"], |ca| {
        let constraints = ca.basic_constraints().unwrap().unwrap();
        assert!(constraints.value.ca && constraints.value.path_len_constraint == Some(0));
        let usage = ca.key_usage().unwrap().unwrap().value;
        assert!(usage.key_cert_sign() && !usage.digital_signature());
        ca.subject().to_string()
    });
    for (identity, listens, names) in [
        ("world", true, vec!["10.0.0.1", "world.example.org"]),
        ("host-h2", true, vec!["2001:db8::2"]),
        ("robot-gold", false, vec![]),
    ] {
        check(&files[&format!("{identity}.pem")], |certificate| {
            assert_eq!(certificate.subject().to_string(), format!("CN={identity}"));
            assert_eq!(certificate.issuer().to_string(), issuer);
            assert!(
                certificate
                    .basic_constraints()
                    .unwrap()
                    .is_none_or(|found| !found.value.ca)
            );
            let usage = certificate.extended_key_usage().unwrap().unwrap().value;
            assert!(usage.client_auth && usage.server_auth == listens && !usage.any);
            let found = certificate.subject_alternative_name().unwrap();
            let found = found.map_or(Vec::new(), |found| found.value.general_names.clone());
            let found: Vec<String> = found.iter().map(in_words).collect();
            assert_eq!(found, names);
            let dates = certificate.validity();
            let times = (dates.not_before.timestamp(), dates.not_after.timestamp());
            assert_eq!(times, (1_000_000_000 - 300, 1_000_000_000 + 2 * 86_400));
        });
    }
    // The authorities of two teams have different names.
    check(&team_files()["ca.pem"], |other| {
        assert_ne!(other.subject().to_string(), issuer)
    });
}

fn in_words(name: &GeneralName<'_>) -> String {
    match name {
        GeneralName::DNSName(name) => (*name).to_owned(),
        GeneralName::IPAddress(bytes) => match <[u8; 4]>::try_from(*bytes) {
            Ok(four) => std::net::Ipv4Addr::from(four).to_string(),
            Err(_) => std::net::Ipv6Addr::from(<[u8; 16]>::try_from(*bytes).unwrap()).to_string(),
        },
        other => panic!("{other}"),
    }
}

#[test]
fn all_secrets_come_from_the_worlds() {
    let files = team_files();
    let token = files["world.secret"].trim();
    assert_eq!(token.len(), 32);
    for identity in ["host-h2", "robot-gold"] {
        let secret = &files[&format!("{identity}.secret")];
        assert_eq!(secret, &format!("{}\n", derived(token, identity)));
    }
    assert_ne!(team_files()["world.secret"], files["world.secret"]);
}

#[test]
fn the_folder_is_private_and_complete_or_absent() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("keys");
    let members = [member("world", &["10.0.0.1"]), member("robot-gold", &[])];
    let dates = CertificateDates::days(OffsetDateTime::now_utc(), 1);
    let files = make(&members, dates).unwrap();
    store::write(&folder, &files).unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode(&folder), 0o700);
    for file in &files {
        assert_eq!(mode(&folder.join(&file.name)), 0o600, "{}", file.name);
        assert_eq!(
            fs::read_to_string(folder.join(&file.name)).unwrap(),
            file.text
        );
    }
    // The keyring can read both members.
    let read = KeyFiles::Folder(folder.clone());
    for identity in ["world", "robot-gold"] {
        assert!(Keyring::read(&read, identity).is_ok());
    }
    // An existing folder and an invalid path are refused, and no temporary folder remains.
    let line = store::write(&folder, &files).unwrap_err().to_string();
    assert!(line.contains("keys: already exists; "), "{line}");
    assert!(store::write(Path::new("/"), &files).is_err());
    let torn = KeyFile {
        name: "no/file".to_owned(),
        text: String::new(),
    };
    let mut incomplete = files;
    incomplete.push(torn);
    assert!(store::write(&dir.path().join("incomplete"), &incomplete).is_err());
    let there: Vec<_> = fs::read_dir(dir.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    assert_eq!(there, ["keys"]);
}
