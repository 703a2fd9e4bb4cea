//! Makes the keys of a team: an authority, and of each member a certificate that it has signed, with its private key and its secret.

use alliance_proto::member::WORLD;
use alliance_proto::secret::{derived, random};
use anyhow::Context;
use rcgen::{
    BasicConstraints, CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose, IsCa,
    Issuer, KeyPair, KeyUsagePurpose,
};
use time::{Duration, OffsetDateTime};

/// Clocks of several machines differ by as much.
const CLOCKS: Duration = Duration::minutes(5);

/// Who takes part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    /// [Identity](alliance_proto::member): stem of its files and first name in its certificate.
    pub identity: String,
    /// Addresses and names by which others connect to it; none: it connects to others alone.
    pub at: Vec<String>,
}

/// From when until when certificates hold.
#[derive(Clone, Copy, Debug)]
pub struct Dates {
    from: OffsetDateTime,
    to: OffsetDateTime,
}

impl Dates {
    /// So many days from that moment on, and from a little before it.
    #[must_use]
    pub fn days(now: OffsetDateTime, days: u32) -> Self {
        Self {
            from: now - CLOCKS,
            to: now + Duration::days(days.into()),
        }
    }
}

/// A file of the team's keys, not written yet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyFile {
    /// Its name, such as `robot-gold.pem`.
    pub name: String,
    /// What is in it.
    pub text: String,
}

impl KeyFile {
    fn new(stem: &str, ending: &str, text: String) -> Self {
        let name = format!("{stem}.{ending}");
        Self { name, text }
    }
}

/// All files of a team: those of the authority, `ca.pem` and `ca.key`, and three of each member.
///
/// # Errors
/// When the system has no random bits, or a member's address cannot stand in a certificate.
pub fn make(members: &[Member], dates: Dates) -> anyhow::Result<Vec<KeyFile>> {
    let authority = Authority::new(dates)?;
    let mut files = authority.files();
    for member in members {
        files.extend(authority.issue(member, dates)?);
    }
    Ok(files)
}

/// Who signs the certificates of a team and derives the secrets of its members.
pub struct Authority {
    token: String,
    certificate: String,
    pub(super) issuer: Issuer<'static, KeyPair>,
}

impl Authority {
    /// A new one. It signs certificates of members, and none of other authorities.
    ///
    /// # Errors
    /// When the system has no random bits.
    pub fn new(dates: Dates) -> anyhow::Result<Self> {
        let token = secret()?;
        // Of its own name: two teams' authorities are told apart before a signature is looked at.
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

    /// Its certificate and its private key.
    #[must_use]
    pub fn files(&self) -> Vec<KeyFile> {
        let key = self.issuer.key().serialize_pem();
        vec![
            KeyFile::new("ca", "pem", self.certificate.clone()),
            KeyFile::new("ca", "key", key),
        ]
    }

    /// Certificate, private key and secret of a member.
    ///
    /// # Errors
    /// When the system has no random bits, or the member's address cannot stand in a certificate.
    pub fn issue(&self, member: &Member, dates: Dates) -> anyhow::Result<Vec<KeyFile>> {
        let identity = &member.identity;
        let key = KeyPair::generate().context("making a key")?;
        let signed = leaf(member, dates).and_then(|params| params.signed_by(&key, &self.issuer));
        let certificate = signed.with_context(|| format!("signing {identity}.pem"))?;
        let secret = match identity.as_str() {
            // All others are derived from it.
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

fn leaf(member: &Member, dates: Dates) -> Result<CertificateParams, rcgen::Error> {
    let params = CertificateParams::new(member.at.clone())?;
    let mut params = named(params, &member.identity, dates);
    params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
    params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ClientAuth];
    if !member.at.is_empty() {
        let usage = ExtendedKeyUsagePurpose::ServerAuth;
        params.extended_key_usages.push(usage);
    }
    Ok(params)
}

fn named(mut params: CertificateParams, name: &str, dates: Dates) -> CertificateParams {
    params.distinguished_name = DistinguishedName::new();
    params.distinguished_name.push(DnType::CommonName, name);
    params.not_before = dates.from;
    params.not_after = dates.to;
    params
}
