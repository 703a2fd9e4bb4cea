//! Tests of the error messages for failed handshakes with a router on loopback.

use std::fs;
use std::io::Write;
use std::net::{TcpListener, TcpStream};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use crate::{ConnectError, open_once};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use rcgen::{CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose, KeyPair};
use scenario::testkit::entry;
use tempfile::TempDir;
use time::OffsetDateTime;
use zenoh::{Session, Wait};

use crate::certificates::{Authority, CertificateDates, KeyFile, Member};

/// Returns a port without a listener.
fn free_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.local_addr().unwrap().port()
}

fn now() -> OffsetDateTime {
    OffsetDateTime::now_utc()
}

fn days_from(now: OffsetDateTime) -> CertificateDates {
    CertificateDates::days(now, 10)
}

fn today() -> CertificateDates {
    days_from(now())
}

fn last_year() -> CertificateDates {
    days_from(now() - time::Duration::days(365))
}

fn next_year() -> CertificateDates {
    days_from(now() + time::Duration::days(365))
}

fn member(identity: &str, at: &[&str]) -> Member {
    Member {
        identity: identity.to_owned(),
        addresses: at.iter().map(|&at| at.to_owned()).collect(),
    }
}

/// Creates a folder with the key files of one member.
fn folder(files: impl IntoIterator<Item = Vec<KeyFile>>) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    for file in files.into_iter().flatten() {
        let path = dir.path().join(&file.name);
        fs::write(&path, file.text).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
    }
    dir
}

const COMMON: &str =
    "scouting: { delay: 0, multicast: { enabled: false }, gossip: { enabled: false } }";

/// Returns zenoh's `tls` section for the key files of a folder.
fn tls(dir: &Path, identity: &str, side: &str) -> String {
    let read = |name: &str| BASE64_STANDARD.encode(fs::read(dir.join(name)).unwrap());
    let (certificate, key) = (
        read(&format!("{identity}.pem")),
        read(&format!("{identity}.key")),
    );
    let ca = read("ca.pem");
    format!(
        "root_ca_certificate_base64: {ca:?}, enable_mtls: true, {side}_certificate_base64: {certificate:?}, {side}_private_key_base64: {key:?}"
    )
}

/// Opens a router with these certificates that accepts gold with the password "right". Returns its locator too.
fn router(dir: &TempDir, transport: &str) -> (Session, String) {
    let members = dir.path().join("members");
    fs::write(&members, "gold:right\n").unwrap();
    let tls = tls(dir.path(), "world", "listen");
    let endpoint = format!("{transport}/127.0.0.1:{}", free_port());
    let config = format!(
        r#"{{ mode: "router", {COMMON}, listen: {{ endpoints: ["{endpoint}"] }}, connect: {{ endpoints: [] }},
        transport: {{ auth: {{ usrpwd: {{ dictionary_file: {members:?} }} }}, link: {{ tls: {{ {tls} }} }} }} }}"#
    );
    let session = open_once(&config, &endpoint).unwrap();
    (session, endpoint)
}

/// Tries to connect as gold with this `tls` section.
fn connect(endpoint: &str, tls: &str, password: &str) -> Result<(), ConnectError> {
    connect_within(10_000, endpoint, tls, password)
}

/// Tries to connect as gold and waits at most `patience_ms` for answers.
fn connect_within(
    patience_ms: u64,
    endpoint: &str,
    tls: &str,
    password: &str,
) -> Result<(), ConnectError> {
    let config = format!(
        r#"{{ mode: "client", {COMMON}, listen: {{ endpoints: [] }}, connect: {{ endpoints: ["{endpoint}"], timeout_ms: 10000 }},
        transport: {{ unicast: {{ open_timeout: {patience_ms} }}, auth: {{ usrpwd: {{ user: "gold", password: "{password}" }} }}, link: {{ tls: {{ {tls} }} }} }} }}"#
    );
    let session = open_once(&config, endpoint)?;
    session.close().wait().unwrap();
    Ok(())
}

/// A team with a correctly configured world on loopback.
struct Team {
    authority: Authority,
    world: TempDir,
    at: String,
    _router: Session,
}

impl Team {
    fn new() -> Self {
        let authority = Authority::new(today()).unwrap();
        let world = world_keys(&authority, "127.0.0.1", today());
        let (router, at) = router(&world, "tls");
        Self {
            authority,
            world,
            at,
            _router: router,
        }
    }

    fn gold(&self, dates: CertificateDates) -> TempDir {
        gold(&self.authority, &self.authority, dates)
    }

    /// Tries to connect to this world as gold with these keys.
    fn connect(&self, keys: &TempDir) -> Result<(), ConnectError> {
        connect(&self.at, &tls(keys.path(), "gold", "connect"), "right")
    }
}

fn world_keys(authority: &Authority, at: &str, dates: CertificateDates) -> TempDir {
    let at: &[&str] = if at.is_empty() { &[] } else { &[at] };
    let files = authority.issue(&member("world", at), dates).unwrap();
    folder([authority.files(), files])
}

/// Creates gold's keys, signed by `by`, with the authority certificate of `ca`.
fn gold(by: &Authority, ca: &Authority, dates: CertificateDates) -> TempDir {
    let files = by.issue(&member("gold", &[]), dates).unwrap();
    folder([ca.files(), files])
}

/// Returns the kind and the reason of a failed connection, for a snapshot.
fn failure(attempt: &str, result: Result<(), ConnectError>) -> String {
    let answer = match result {
        Err(ConnectError::Refused { reason, .. }) => format!("refused: {reason}"),
        Err(ConnectError::NotThere { reason, .. }) => format!("not there: {reason}"),
        other => panic!("{attempt}: {other:?}"),
    };
    assert_eq!(answer.lines().count(), 1, "{attempt}: {answer}");
    entry(attempt, &answer)
}

#[test]
fn only_a_member_with_valid_keys_connects() {
    let team = Team::new();
    let good = team.gold(today());
    assert_eq!(team.connect(&good), Ok(()));

    let ca = BASE64_STANDARD.encode(fs::read(good.path().join("ca.pem")).unwrap());
    let none = format!("root_ca_certificate_base64: {ca:?}");
    let other = Authority::new(today()).unwrap();
    let untrusted = gold(&other, &team.authority, today());
    let of_a_listener = folder([team.authority.files(), listener_only(&team.authority)]);
    let tls = tls(good.path(), "gold", "connect");
    let failures = [
        ("no certificate", connect(&team.at, &none, "right")),
        ("certificate of another authority", team.connect(&untrusted)),
        ("expired certificate", team.connect(&team.gold(last_year()))),
        (
            "certificate of next year",
            team.connect(&team.gold(next_year())),
        ),
        ("certificate for a listener", team.connect(&of_a_listener)),
        ("wrong secret", connect(&team.at, &tls, "wrong")),
    ];
    let answers = failures.map(|(attempt, result)| failure(attempt, result));
    insta::assert_snapshot!(answers.concat());
    // A member can still connect after the failed attempts.
    assert_eq!(team.connect(&good), Ok(()));
}

/// Creates a certificate of gold that is valid only for a listener.
fn listener_only(authority: &Authority) -> Vec<KeyFile> {
    let mut params = CertificateParams::default();
    params.distinguished_name = DistinguishedName::new();
    params.distinguished_name.push(DnType::CommonName, "gold");
    params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ServerAuth];
    let key = KeyPair::generate().unwrap();
    let certificate = params.signed_by(&key, &authority.issuer).unwrap();
    let file = |name: &str, text| KeyFile {
        name: name.to_owned(),
        text,
    };
    vec![
        file("gold.pem", certificate.pem()),
        file("gold.key", key.serialize_pem()),
    ]
}

#[test]
fn a_world_of_another_team_is_refused() {
    let authority = Authority::new(today()).unwrap();
    let other = Authority::new(today()).unwrap();
    let good = gold(&authority, &authority, today());
    let worlds = [
        ("of another authority", &other, "127.0.0.1", today()),
        ("expired", &authority, "127.0.0.1", last_year()),
        ("of next year", &authority, "127.0.0.1", next_year()),
        ("for another address", &authority, "10.0.0.9", today()),
        ("for another name", &authority, "elsewhere", today()),
        ("without an address", &authority, "", today()),
    ];
    let answers = worlds.map(|(attempt, authority, at, dates)| {
        let world = world_keys(authority, at, dates);
        let (_router, at) = router(&world, "tls");
        let result = connect(&at, &tls(good.path(), "gold", "connect"), "right");
        failure(attempt, result)
    });
    insta::assert_snapshot!(answers.concat());
}

#[test]
fn mismatched_key_files_are_refused_before_connecting() {
    let team = Team::new();
    let torn = team.gold(today());
    let key = torn.path().join("gold.key");
    fs::copy(team.world.path().join("world.key"), &key).unwrap();
    let mismatched = failure("key of another certificate", team.connect(&torn));
    fs::write(&key, "junk").unwrap();
    let junk = failure("no key", team.connect(&torn));
    insta::assert_snapshot!(mismatched + &junk);
}

#[test]
fn absent_and_incompatible_listeners_are_named() {
    let team = Team::new();
    let good = team.gold(today());
    let tls = tls(good.path(), "gold", "connect");
    let connect_to = |at: &str| connect(at, &tls, "right");
    let silent = |at: &str| connect_within(500, at, &tls, "right");
    let nothing = format!("tls/127.0.0.1:{}", free_port());
    let world_as_tcp = team.at.replace("tls/", "tcp/");
    let (_plain, plain) = router(&team.world, "tcp");
    let junk = answers(|mut stream| {
        let _ = stream.write_all(b"HTTP/1.1 400 Bad Request\r\n\r\n");
    });
    let failures = [
        ("no listener", connect_to(&nothing)),
        ("no machine", connect_to("tls/nowhere.invalid:7447")),
        ("a listener that closes", connect_to(&answers(drop))),
        ("tcp to a tls world", connect(&world_as_tcp, "", "right")),
        ("tls to a tcp world", silent(&plain.replace("tcp/", "tls/"))),
        ("a silent listener", silent(&answers(std::mem::forget))),
        ("an HTTP server", connect_to(&junk)),
    ];
    let answers = failures.map(|(attempt, result)| failure(attempt, result));
    insta::assert_snapshot!(answers.concat());
}

/// Starts a listener that handles each connection with `with`. Returns its locator.
fn answers(with: impl Fn(TcpStream) + Send + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let at = listener.local_addr().unwrap();
    std::thread::spawn(move || listener.incoming().flatten().for_each(with));
    format!("tls/{at}")
}
