//! Handshakes with a router on loopback, each with one thing wrong: what is said of it.

use std::fs;
use std::io::Write;
use std::net::{TcpListener, TcpStream};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use bus::{ConnectError, open_once};
use rcgen::{CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose, KeyPair};
use tempfile::TempDir;
use time::OffsetDateTime;
use zenoh::{Session, Wait};

use super::make::{Authority, Dates, KeyFile, Member};

/// A place where nobody listens.
fn free_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.local_addr().unwrap().port()
}

fn now() -> OffsetDateTime {
    OffsetDateTime::now_utc()
}

fn days_from(now: OffsetDateTime) -> Dates {
    Dates::days(now, 10)
}

fn today() -> Dates {
    days_from(now())
}

fn last_year() -> Dates {
    days_from(now() - time::Duration::days(365))
}

fn next_year() -> Dates {
    days_from(now() + time::Duration::days(365))
}

fn member(identity: &str, at: &[&str]) -> Member {
    Member {
        identity: identity.to_owned(),
        at: at.iter().map(|&at| at.to_owned()).collect(),
    }
}

/// A folder of files as somebody has them.
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

/// What they prove by who they are: files of a folder, as the product hands them to zenoh.
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

/// A router with these certificates that knows gold by the password "right"; its locator.
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

/// Somebody who tries to connect there with that `tls` section.
fn connect(endpoint: &str, tls: &str, password: &str) -> Result<(), ConnectError> {
    connect_within(10_000, endpoint, tls, password)
}

/// The same by one who waits that long for answers.
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

/// A team with a world on loopback that is as it should be.
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

    /// What gold has of this authority, valid then.
    fn gold(&self, dates: Dates) -> TempDir {
        gold(&self.authority, &self.authority, dates)
    }

    /// What is said when gold tries to connect to this world with those keys.
    fn said(&self, keys: &TempDir) -> Result<(), ConnectError> {
        connect(&self.at, &tls(keys.path(), "gold", "connect"), "right")
    }
}

/// Keys of a world that is reached there.
fn world_keys(authority: &Authority, at: &str, dates: Dates) -> TempDir {
    let at: &[&str] = if at.is_empty() { &[] } else { &[at] };
    let files = authority.issue(&member("world", at), dates).unwrap();
    folder([authority.files(), files])
}

/// Keys of gold, signed by the first, with the certificate of the second as that of the authority.
fn gold(by: &Authority, ca: &Authority, dates: Dates) -> TempDir {
    let files = by.issue(&member("gold", &[]), dates).unwrap();
    folder([ca.files(), files])
}

#[track_caller]
fn assert_refused(said: Result<(), ConnectError>, expected: &str) {
    match said {
        Err(ConnectError::Refused { reason, .. }) => assert_eq!(reason, expected),
        other => panic!("{other:?}"),
    }
}

#[track_caller]
fn assert_not_there(said: Result<(), ConnectError>, expected: &str) {
    match said {
        Err(ConnectError::NotThere { reason, .. }) => assert_eq!(reason, expected),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_member_gets_in_and_who_shows_what_is_wrong_does_not() {
    let team = Team::new();
    let good = team.gold(today());
    assert_eq!(team.said(&good), Ok(()));

    let ca = BASE64_STANDARD.encode(fs::read(good.path().join("ca.pem")).unwrap());
    let none = format!("root_ca_certificate_base64: {ca:?}");
    assert_refused(
        connect(&team.at, &none, "right"),
        "it asks for a certificate, and none is shown; connect with --keys DIR",
    );
    let other = Authority::new(today()).unwrap();
    assert_refused(
        team.said(&gold(&other, &team.authority, today())),
        "its ca.pem has not signed the certificate here; copy the files of one `alliance keys` to both sides",
    );
    for dates in [last_year(), next_year()] {
        assert_refused(
            team.said(&team.gold(dates)),
            "by its clock the certificate here has expired or is not valid yet; set both clocks right, or make new keys",
        );
    }
    assert_refused(
        team.said(&folder([
            team.authority.files(),
            one_who_listens_alone(&team.authority),
        ])),
        "the certificate here is not that of one who connects; use those of `alliance keys`",
    );
    let tls = tls(good.path(), "gold", "connect");
    assert_refused(
        connect(&team.at, &tls, "wrong"),
        "it does not know this name and secret; copy the .secret file of its `alliance keys` again",
    );
    // Whatever was tried before: a member still gets in.
    assert_eq!(team.said(&good), Ok(()));
}

/// A certificate of gold that says it is of one who is connected to, and nothing else.
fn one_who_listens_alone(authority: &Authority) -> Vec<KeyFile> {
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
fn a_world_that_is_not_the_teams_is_not_connected_to() {
    let authority = Authority::new(today()).unwrap();
    let other = Authority::new(today()).unwrap();
    let good = gold(&authority, &authority, today());
    let said = |world: &TempDir| {
        let (_router, at) = router(world, "tls");
        connect(&at, &tls(good.path(), "gold", "connect"), "right")
    };
    assert_refused(
        said(&world_keys(&other, "127.0.0.1", today())),
        "its certificate is not signed by the ca.pem here; copy the files of one `alliance keys` to both sides",
    );
    assert_refused(
        said(&world_keys(&authority, "127.0.0.1", last_year())),
        "by this machine's clock its certificate has expired; set the clock right, or make new keys",
    );
    assert_refused(
        said(&world_keys(&authority, "127.0.0.1", next_year())),
        "by this machine's clock its certificate is not valid yet; set the clock right, or make new keys",
    );
    for at in ["10.0.0.9", "elsewhere"] {
        assert_refused(
            said(&world_keys(&authority, at, today())),
            &format!(
                "its certificate is for {at}, not for 127.0.0.1; connect by a name that it has, or make keys in which it is reached at 127.0.0.1"
            ),
        );
    }
    assert_refused(
        said(&world_keys(&authority, "", today())),
        "its certificate is not that of one who listens; make keys that say where it is reached",
    );
}

#[test]
fn files_that_do_not_go_together_are_told_before_anything_is_sent() {
    let team = Team::new();
    let torn = team.gold(today());
    let key = torn.path().join("gold.key");
    fs::copy(team.world.path().join("world.key"), &key).unwrap();
    assert_refused(
        team.said(&torn),
        "the private key here is not that of the certificate; copy both files again",
    );
    fs::write(&key, "junk").unwrap();
    assert_refused(
        team.said(&torn),
        "the .key file here holds no private key; copy it again",
    );
}

#[test]
fn who_is_not_there_or_speaks_otherwise() {
    let team = Team::new();
    let good = team.gold(today());
    let own = tls(good.path(), "gold", "connect");
    let said = |at: &str| connect(at, &own, "right");
    assert_not_there(
        said(&format!("tls/127.0.0.1:{}", free_port())),
        "nobody listens there",
    );
    assert_not_there(
        said("tls/nowhere.invalid:7447"),
        "the network knows no machine of that name",
    );
    let closed = "the connection was closed before it stood; do both sides say tls, or both tcp?";
    assert_not_there(said(&answers(drop)), closed);
    let plain = team.at.replace("tls/", "tcp/");
    assert_not_there(connect(&plain, "", "right"), closed);
    let (_plain, plain) = router(&team.world, "tcp");
    for at in [plain.replace("tcp/", "tls/"), answers(std::mem::forget)] {
        assert_not_there(
            connect_within(500, &at, &own, "right"),
            "nobody answers there; do both sides say tls, or both tcp?",
        );
    }
    let junk = answers(|mut stream| {
        let _ = stream.write_all(b"HTTP/1.1 400 Bad Request\r\n\r\n");
    });
    assert_refused(
        said(&junk),
        "who answers there does not speak TLS; is that the port of a world or a host?",
    );
}

/// Somebody who does that with every connection, to the end of this test; the locator.
fn answers(with: impl Fn(TcpStream) + Send + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let at = listener.local_addr().unwrap();
    std::thread::spawn(move || listener.incoming().flatten().for_each(with));
    format!("tls/{at}")
}
