//! The keys of a team: a certificate authority, and a signed certificate, a private key and a secret for each member.

use anyhow::Context;
use proto::identity::WORLD;
use proto::secret::{derived, random};
use rcgen::{
    BasicConstraints, CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose, IsCa,
    Issuer, KeyPair, KeyUsagePurpose,
};
use time::{Duration, OffsetDateTime};

/// The tolerance for clock differences between machines.
const CLOCK_TOLERANCE: Duration = Duration::minutes(5);

/// A member of a team: the world, a host or a robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    /// The identity: stem of the file names and common name in the certificate.
    pub identity: String,
    /// The addresses and names by which others connect; empty for a member that only connects to others.
    pub addresses: Vec<String>,
}

#[derive(Clone, Copy, Debug)]
pub struct CertificateDates {
    from: OffsetDateTime,
    to: OffsetDateTime,
}

impl CertificateDates {
    /// Creates a period of `days` days from `now`. It starts a little earlier, for machines with slow clocks.
    #[must_use]
    pub fn days(now: OffsetDateTime, days: u32) -> Self {
        Self {
            from: now - CLOCK_TOLERANCE,
            to: now + Duration::days(days.into()),
        }
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyFile {
    /// The file name, such as `robot-gold.pem`.
    pub name: String,
    pub text: String,
}

impl KeyFile {
    fn new(stem: &str, ending: &str, text: String) -> Self {
        let name = format!("{stem}.{ending}");
        Self { name, text }
    }
}

/// Creates all key files of a team: `ca.pem` and `ca.key` of the authority, and three files per member.
///
/// # Errors
/// If the system has no random bits, or a member's address is invalid in a certificate.
pub fn make(members: &[Member], dates: CertificateDates) -> anyhow::Result<Vec<KeyFile>> {
    let authority = Authority::new(dates)?;
    let mut files = authority.files();
    for member in members {
        files.extend(authority.issue(member, dates)?);
    }
    Ok(files)
}

/// The certificate authority of a team, which also derives the secrets of its members.
pub struct Authority {
    token: String,
    certificate: String,
    pub(super) issuer: Issuer<'static, KeyPair>,
}

impl Authority {
    /// Creates an authority that may sign certificates of members, but not of other authorities.
    pub fn new(dates: CertificateDates) -> anyhow::Result<Self> {
        let token = secret()?;
        // A unique name, so that a certificate of another team is detected before its signature is checked.
        let name = format!("alliance {}", &secret()?[..8]);
        let mut params = named(CertificateParams::default(), &name, dates);
        params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign];
        let key = KeyPair::generate().context("making a key")?;
        let certificate = params.self_signed(&key).context("signing ca.pem")?.pem();
        let issuer = Issuer::new(params, key);
        Ok(Self {
            token,
            certificate,
            issuer,
        })
    }

    /// Returns the certificate and the private key of the authority.
    #[must_use]
    pub fn files(&self) -> Vec<KeyFile> {
        let key = self.issuer.key().serialize_pem();
        vec![
            KeyFile::new("ca", "pem", self.certificate.clone()),
            KeyFile::new("ca", "key", key),
        ]
    }

    /// Creates the certificate, private key and secret files of a member.
    ///
    /// # Errors
    /// If the system has no random bits, or the member's address is invalid in a certificate.
    pub fn issue(&self, member: &Member, dates: CertificateDates) -> anyhow::Result<Vec<KeyFile>> {
        let identity = &member.identity;
        let key = KeyPair::generate().context("making a key")?;
        let signed = leaf(member, dates).and_then(|params| params.signed_by(&key, &self.issuer));
        let certificate = signed.with_context(|| format!("signing {identity}.pem"))?;
        let secret = match identity.as_str() {
            // All other secrets are derived from this one.
            WORLD => self.token.clone(),
            _ => derived(&self.token, identity),
        };
        Ok(vec![
            KeyFile::new(identity, "pem", certificate.pem()),
            KeyFile::new(identity, "key", key.serialize_pem()),
            KeyFile::new(identity, "secret", format!("{secret}\n")),
        ])
    }
}

fn secret() -> anyhow::Result<String> {
    let bits = random().context("the system has no random bits")?;
    Ok(format!("{bits:032x}"))
}

fn leaf(member: &Member, dates: CertificateDates) -> Result<CertificateParams, rcgen::Error> {
    let params = CertificateParams::new(member.addresses.clone())?;
    let mut params = named(params, &member.identity, dates);
    params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
    params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ClientAuth];
    if !member.addresses.is_empty() {
        let usage = ExtendedKeyUsagePurpose::ServerAuth;
        params.extended_key_usages.push(usage);
    }
    Ok(params)
}

fn named(mut params: CertificateParams, name: &str, dates: CertificateDates) -> CertificateParams {
    params.distinguished_name = DistinguishedName::new();
    params.distinguished_name.push(DnType::CommonName, name);
    params.not_before = dates.from;
    params.not_after = dates.to;
    params
}
