//! A key and a certificate signed by it, for a station without a certificate of an authority.

use std::path::Path;
use std::time::{Duration, SystemTime};

use jaus_files::{Readers, create};
use rcgen::{CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose, KeyPair};

use super::error::{TlsError, in_file};

/// Validity of a new certificate: longer than a station is in use, because a new one has a new
/// fingerprint.
const VALIDITY: Duration = Duration::from_secs(10 * 365 * 24 * 3600);
/// A computer's clock may be slow by this when the certificate is made.
const BEFORE: Duration = Duration::from_secs(24 * 3600);

/// Makes a key and a certificate for these names and addresses, and writes them to two new files.
pub(super) fn make(
    certificate: &Path,
    key: &Path,
    names: &[String],
    now: SystemTime,
) -> Result<(), TlsError> {
    let pair = KeyPair::generate().map_err(TlsError::Make)?;
    let params = params(names, now).map_err(TlsError::Make)?;
    let signed = params.self_signed(&pair).map_err(TlsError::Make)?;
    create(key, Readers::Owner, pair.serialize_pem().as_bytes()).map_err(in_file(key))?;
    create(certificate, Readers::Everyone, signed.pem().as_bytes()).map_err(in_file(certificate))
}

fn params(names: &[String], now: SystemTime) -> Result<CertificateParams, rcgen::Error> {
    let mut all = vec!["localhost".to_owned(), "127.0.0.1".to_owned()];
    all.extend(
        names
            .iter()
            .filter(|it| !all.contains(it))
            .cloned()
            .collect::<Vec<_>>(),
    );
    let mut params = CertificateParams::new(all)?;
    params.not_before = (now - BEFORE).into();
    params.not_after = (now + VALIDITY).into();
    params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ServerAuth];
    params.distinguished_name = DistinguishedName::new();
    let name = "jaus-ocu, operator station";
    params.distinguished_name.push(DnType::CommonName, name);
    Ok(params)
}
