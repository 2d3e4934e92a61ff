//! A team's certificate authority: a folder with its key, its certificate, its revocation list, and
//! the register of the certificates that it has issued.
//!
//! | file | contents |
//! |---|---|
//! | `ca.key` | the private key, encrypted with a passphrase or readable by its owner alone; it belongs on no vehicle |
//! | `ca.crt` | the certificate that nodes need (`authority`) |
//! | `ca.crl` | the revocation list that nodes need (`revoked`) |
//! | `issued` | a line for each issued certificate |

mod register;

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use jaus::address::JausId;
use jaus_files::{FileLock, Readers};
use rcgen::{
    BasicConstraints, CertificateParams, CertificateRevocationListParams, DistinguishedName,
    DnType, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyIdMethod, KeyUsagePurpose, PublicKeyData,
    RevokedCertParams, SanType, SerialNumber, SignatureAlgorithm, SigningKey,
};
use rustls::SignatureScheme;
use rustls::pki_types::CertificateDer;
use time::OffsetDateTime;
use x509_cert::der::Decode as _;

use crate::approval::{Proposal, since_1970};
use crate::certificate::{
    APPROVAL, Certificate, CertificateError, Defect, MOST_IDS, SCHEME, hex, in_file, is_name,
    malformed, read_certificate,
};
use crate::key::{Key, KeyError, Passphrase, PublicKey, pem, random};
pub use register::Issued;

/// How long an authority's certificate is valid.
const LIFE: Duration = Duration::from_secs(10 * 365 * 24 * 60 * 60);
/// The longest life of a node's certificate.
const LONGEST_LIFE: Duration = LIFE;
/// By how much a certificate is valid before it was issued, for hosts whose clocks are slow.
const SLACK: Duration = Duration::from_secs(60 * 60);
/// Octets of a serial number.
const SERIAL: usize = 16;

/// Why an authority cannot do something.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AuthorityError {
    /// A file cannot be used.
    #[error(transparent)]
    File(#[from] CertificateError),
    /// A line of the register is malformed.
    #[error("line {line} of {}: {what}", .path.display())]
    Register {
        /// The register.
        path: PathBuf,
        /// The line's number, from 1.
        line: usize,
        /// What is wrong.
        what: String,
    },
    /// The name is not usable.
    #[error(
        "`{}` cannot be a name: use 1 to 64 ASCII letters, digits and punctuation without `#`",
        jaus_text::visible(.0)
    )]
    Name(String),
    /// The certificate would have no ids, or too many.
    #[error("a certificate has 1 to 32 ids, not {0}")]
    Ids(usize),
    /// A proposal is for no certificate, or for one whose time is over.
    #[error("the proposal is for no certificate, or the time of that is over")]
    Proposal,
    /// The certificate would live too long.
    #[error("a certificate is valid for 1 s to 3650 days")]
    Life,
    /// The certificate cannot be encoded.
    #[error("the certificate cannot be made: {0}")]
    Encoding(#[from] rcgen::Error),
}

impl From<KeyError> for AuthorityError {
    fn from(error: KeyError) -> Self {
        Self::File(error.into())
    }
}

/// A certificate to issue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Request {
    /// The name of the node.
    pub name: String,
    /// The node's public key. That the node has the private one is not proved here: it proves it in
    /// each handshake.
    pub key: PublicKey,
    /// The ids that the node may speak for; with wildcards.
    pub ids: Vec<JausId>,
    /// How long the certificate is valid.
    pub life: Duration,
}

impl Request {
    /// What people approve, if the certificate is to be issued: all that it will contain, with a new serial
    /// number, so that it is one certificate.
    ///
    /// # Errors
    /// If a field is out of range, or without random numbers.
    pub fn line(&self, now: SystemTime) -> Result<String, AuthorityError> {
        check(self)?;
        let ids: Vec<_> = self.ids.iter().map(JausId::to_string).collect();
        let (serial, name, key, ids) = (hex(&serial()?), &self.name, self.key, ids.join(","));
        let not_after = since_1970(now + self.life);
        Ok(format!("issue {serial} {name} {key} {ids} {not_after}"))
    }

    /// The request of an approved line, and its serial number.
    fn of_line(line: &str, now: SystemTime) -> Option<(Self, Vec<u8>)> {
        let words: Vec<_> = line.split(' ').collect();
        let ["issue", serial, name, key, ids, not_after] = words[..] else {
            return None;
        };
        let ids = ids.split(',').map(str::parse).collect::<Result<_, _>>();
        // To the second, so that the certificate ends when it was approved to.
        let left = not_after
            .parse::<u64>()
            .ok()?
            .checked_sub(since_1970(now))?;
        let request = Self {
            name: name.to_owned(),
            key: key.parse().ok()?,
            ids: ids.ok()?,
            life: Duration::from_secs(left),
        };
        Some((request, register::octets(serial)?))
    }
}

/// A certificate authority.
#[derive(Debug)]
pub struct CertificateAuthority {
    folder: PathBuf,
    key: Key,
    name: String,
}

impl CertificateAuthority {
    /// Makes an authority with this name in a folder, which must exist. A passphrase encrypts its key.
    ///
    /// # Errors
    /// If the name is not usable, the folder has an authority already, or it cannot be written.
    pub fn create(
        folder: &Path,
        name: &str,
        passphrase: Option<&Passphrase>,
        now: SystemTime,
    ) -> Result<Self, AuthorityError> {
        if !is_name(name) {
            return Err(AuthorityError::Name(name.to_owned()));
        }
        let authority = Self {
            folder: folder.to_owned(),
            key: Key::create_sealed(&Self::key_path(folder), passphrase)?,
            name: name.to_owned(),
        };
        let mut params = authority.params();
        params.serial_number = Some(SerialNumber::from_slice(&serial()?));
        params.not_before = time(now - SLACK);
        params.not_after = time(now + LIFE);
        let certificate = params.self_signed(&authority.key)?;
        write(
            &folder.join("ca.crt"),
            &pem("CERTIFICATE", certificate.der()),
        )?;
        authority.write_list(&[], now)?;
        Ok(authority)
    }

    /// The file of the key of the authority in a folder.
    #[must_use]
    pub fn key_path(folder: &Path) -> PathBuf {
        folder.join("ca.key")
    }

    /// Opens the authority in a folder, whose key is plain or encrypted with this passphrase.
    ///
    /// # Errors
    /// If a file of it cannot be used.
    pub fn open(folder: &Path, passphrase: Option<&Passphrase>) -> Result<Self, AuthorityError> {
        let path = folder.join("ca.crt");
        let name = common_name(&read_certificate(&path)?);
        Ok(Self {
            folder: folder.to_owned(),
            key: Key::unseal(&Self::key_path(folder), passphrase)?,
            name: name.ok_or_else(|| malformed(&path, "certificate of an authority"))?,
        })
    }

    /// Issues a certificate and registers it. Returns it as PEM.
    ///
    /// # Errors
    /// If a field of the request is out of range, or the register cannot be written.
    pub fn issue(&self, request: &Request, now: SystemTime) -> Result<String, AuthorityError> {
        self.sign(request, now, (&serial()?, None))
    }

    /// Issues and registers the certificate of an approved proposal, with the signatures of those who have
    /// approved it. Returns it as PEM.
    ///
    /// # Errors
    /// As [`issue`](Self::issue); if the proposal is for no certificate.
    pub fn issue_approved(
        &self,
        proposal: &Proposal,
        now: SystemTime,
    ) -> Result<String, AuthorityError> {
        let request = Request::of_line(proposal.line(), now);
        let (request, serial) = request.ok_or(AuthorityError::Proposal)?;
        self.sign(&request, now, (&serial, Some(proposal)))
    }

    fn sign(
        &self,
        request: &Request,
        now: SystemTime,
        (serial, approval): (&[u8], Option<&Proposal>),
    ) -> Result<String, AuthorityError> {
        check(request)?;
        let mut params = CertificateParams::default();
        params.distinguished_name = named(&request.name);
        params.subject_alt_names = names(&request.ids)?;
        if let Some(approval) = approval {
            let seal = format!("{APPROVAL}{}", approval.seal());
            params
                .subject_alt_names
                .push(SanType::URI(seal.try_into()?));
        }
        params.serial_number = Some(SerialNumber::from_slice(serial));
        params.not_before = time(now - SLACK);
        params.not_after = time(now + request.life);
        params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
        params.extended_key_usages = vec![
            ExtendedKeyUsagePurpose::ClientAuth,
            ExtendedKeyUsagePurpose::ServerAuth,
        ];
        params.use_authority_key_identifier_extension = true;
        let issued = params.signed_by(&request.key, &self.issuer())?;
        // It is read back, so that nothing is issued that nodes would not accept.
        let certificate =
            Certificate::from_der(issued.der()).map_err(|defect| self.defect(defect))?;
        let _alone = self.lock()?;
        self.append(&Issued::of(&certificate))?;
        Ok(pem("CERTIFICATE", issued.der()).to_string())
    }

    /// Revokes the certificates with this name, or the one with this serial number, and writes the
    /// revocation list. Returns the certificates that were not revoked before.
    ///
    /// # Errors
    /// If the register cannot be read, or a file cannot be written.
    pub fn revoke(&self, which: &str, now: SystemTime) -> Result<Vec<Issued>, AuthorityError> {
        let _alone = self.lock()?;
        let mut issued = Self::issued(&self.folder)?;
        let mut revoked = Vec::new();
        for it in &mut issued {
            let is_meant = it.name == which || it.serial == which;
            if is_meant && it.revoked.is_none() {
                it.revoked = Some(now);
                revoked.push(it.clone());
            }
        }
        // The list first: what it names is revoked, even if the register could not be written.
        self.write_list(&issued, now)?;
        let text: String = issued.iter().map(Issued::to_string).collect();
        let path = self.register();
        write(&path, &text)?;
        Ok(revoked)
    }

    /// The certificates that the authority in a folder has issued, oldest first. They need no key.
    ///
    /// # Errors
    /// If the folder has no authority, or the register cannot be read.
    pub fn issued(folder: &Path) -> Result<Vec<Issued>, AuthorityError> {
        read_certificate(&folder.join("ca.crt"))?;
        register::read(&register_path(folder))
    }

    fn register(&self) -> PathBuf {
        register_path(&self.folder)
    }

    /// Keeps other programs from changing the register until it is dropped.
    fn lock(&self) -> Result<FileLock, AuthorityError> {
        let path = self.register();
        FileLock::of(&path).map_err(|source| in_file(&path, source).into())
    }

    fn append(&self, issued: &Issued) -> Result<(), AuthorityError> {
        let path = self.register();
        jaus_files::append(&path, Readers::Everyone)
            .and_then(|mut file| {
                file.write_all(issued.to_string().as_bytes())?;
                file.sync_all()
            })
            .map_err(|source| in_file(&path, source).into())
    }

    /// Writes the list of the revoked certificates. Expired ones stay in it: whether one has expired is a
    /// question to a clock, and that of this host or of a vehicle may be wrong.
    fn write_list(&self, issued: &[Issued], now: SystemTime) -> Result<(), AuthorityError> {
        let millis = now.duration_since(SystemTime::UNIX_EPOCH);
        let number = millis.map_or(0, |it| u64::try_from(it.as_millis()).unwrap_or(u64::MAX));
        let list = CertificateRevocationListParams {
            this_update: time(now),
            // Nodes use a list until they get a newer one: a vehicle without a network stays usable.
            next_update: time(now + LIFE),
            crl_number: SerialNumber::from(number),
            issuing_distribution_point: None,
            revoked_certs: issued.iter().filter_map(listed).collect(),
            key_identifier_method: KeyIdMethod::Sha256,
        };
        let list = list.signed_by(&self.issuer())?;
        write(&self.folder.join("ca.crl"), &pem("X509 CRL", list.der()))?;
        Ok(())
    }

    /// The parameters of its own certificate.
    fn params(&self) -> CertificateParams {
        let mut params = CertificateParams::default();
        params.distinguished_name = named(&self.name);
        params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
        params
    }

    fn issuer(&self) -> Issuer<'static, Key> {
        Issuer::new(self.params(), self.key.clone())
    }

    fn defect(&self, defect: Defect) -> AuthorityError {
        let path = self.folder.join("ca.crt");
        CertificateError::Defect { path, defect }.into()
    }
}

fn register_path(folder: &Path) -> PathBuf {
    folder.join("issued")
}

fn check(request: &Request) -> Result<(), AuthorityError> {
    if !is_name(&request.name) {
        return Err(AuthorityError::Name(request.name.clone()));
    }
    if !(1..=MOST_IDS).contains(&request.ids.len()) {
        return Err(AuthorityError::Ids(request.ids.len()));
    }
    if request.life < Duration::from_secs(1) || request.life > LONGEST_LIFE {
        return Err(AuthorityError::Life);
    }
    Ok(())
}

fn named(name: &str) -> DistinguishedName {
    let mut names = DistinguishedName::new();
    names.push(DnType::CommonName, name);
    names
}

fn names(ids: &[JausId]) -> Result<Vec<SanType>, rcgen::Error> {
    let name = |id: &JausId| Ok(SanType::URI(format!("{SCHEME}{id}").try_into()?));
    ids.iter().map(name).collect()
}

fn common_name(der: &CertificateDer<'_>) -> Option<String> {
    let parsed = x509_cert::Certificate::from_der(der).ok()?;
    let name = parsed.tbs_certificate().subject().common_name().ok()??;
    Some(name.value().into_owned())
}

/// A random serial number.
fn serial() -> Result<[u8; SERIAL], KeyError> {
    let mut octets = random::<SERIAL>()?;
    // Positive, and of a fixed length.
    octets[0] = octets[0] & 0x7F | 0x40;
    Ok(octets)
}

/// The entry of the revocation list for a certificate, if it is revoked.
fn listed(issued: &Issued) -> Option<RevokedCertParams> {
    Some(RevokedCertParams {
        serial_number: SerialNumber::from_slice(&issued.serial_octets()?),
        revocation_time: time(issued.revoked?),
        reason_code: None,
        invalidity_date: None,
    })
}

fn time(time: SystemTime) -> OffsetDateTime {
    time.into()
}

fn write(path: &Path, text: &str) -> Result<(), CertificateError> {
    jaus_files::replace(path, Readers::Everyone, text.as_bytes())
        .map_err(|source| in_file(path, source))
}

impl PublicKeyData for PublicKey {
    fn der_bytes(&self) -> &[u8] {
        self.octets()
    }

    fn algorithm(&self) -> &'static SignatureAlgorithm {
        &rcgen::PKCS_ED25519
    }
}

impl PublicKeyData for Key {
    fn der_bytes(&self) -> &[u8] {
        self.public_ref().octets()
    }

    fn algorithm(&self) -> &'static SignatureAlgorithm {
        &rcgen::PKCS_ED25519
    }
}

impl SigningKey for Key {
    fn sign(&self, message: &[u8]) -> Result<Vec<u8>, rcgen::Error> {
        let signer = self.signing().choose_scheme(&[SignatureScheme::ED25519]);
        signer
            .and_then(|it| it.sign(message).ok())
            .ok_or(rcgen::Error::RingUnspecified)
    }
}

#[cfg(test)]
mod tests;
