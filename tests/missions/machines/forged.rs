//! Certificates that `alliance cluster keys` does not make: signed by the team's authority, with any dates.

use std::fs;
use std::path::{Path, PathBuf};

use rcgen::{
    BasicConstraints, CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose, IsCa,
    Issuer, KeyPair, KeyUsagePurpose,
};
use time::{Duration, OffsetDateTime};
use x509_parser::pem::parse_x509_pem;

/// The start and the end of a certificate's validity.
pub type Dates = (OffsetDateTime, OffsetDateTime);

pub fn over() -> Dates {
    let now = OffsetDateTime::now_utc();
    (now - Duration::days(30), now - Duration::days(1))
}

pub fn holds() -> Dates {
    let now = OffsetDateTime::now_utc();
    (now - Duration::days(1), now + Duration::days(1))
}

pub fn ahead() -> Dates {
    let now = OffsetDateTime::now_utc();
    (now + Duration::days(1), now + Duration::days(30))
}

/// Writes a member's certificate with these dates and its key into a new folder, and returns the folder.
pub fn signed_by_the_team(
    keys: &Path,
    folder: &Path,
    identity: &str,
    (from, to): Dates,
) -> PathBuf {
    let read = |name| fs::read_to_string(keys.join(name)).unwrap();
    let pem = read("ca.pem");
    let (_, pem) = parse_x509_pem(pem.as_bytes()).unwrap();
    let certificate = pem.parse_x509().unwrap();
    let name = certificate.subject().iter_common_name().next().unwrap();
    let mut authority = named(name.as_str().unwrap());
    authority.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
    authority.key_usages = vec![KeyUsagePurpose::KeyCertSign];
    let issuer = Issuer::new(authority, KeyPair::from_pem(&read("ca.key")).unwrap());

    let mut params = named(identity);
    (params.not_before, params.not_after) = (from, to);
    params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ClientAuth];
    let key = KeyPair::generate().unwrap();
    let certificate = params.signed_by(&key, &issuer).unwrap();
    fs::create_dir(folder).unwrap();
    fs::write(folder.join(format!("{identity}.pem")), certificate.pem()).unwrap();
    fs::write(folder.join(format!("{identity}.key")), key.serialize_pem()).unwrap();
    folder.to_owned()
}

fn named(name: &str) -> CertificateParams {
    let mut params = CertificateParams::default();
    params.distinguished_name = DistinguishedName::new();
    params.distinguished_name.push(DnType::CommonName, name);
    params
}
