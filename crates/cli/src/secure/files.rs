//! The files of keys and certificates.

use std::path::PathBuf;

use clap::Args;
use jaus_secure::{CertificateFiles, Key};

use crate::failure::Failure;
use crate::folders::config_folder;

/// The files of a node that uses certificates instead of trusted keys.
#[derive(Args, Clone, Debug, Default)]
pub(super) struct Certificates {
    /// Use this certificate, and accept peers by theirs instead of by trusted keys
    #[arg(long, value_name = "FILE")]
    pub(super) certificate: Option<PathBuf>,

    /// The certificate of the authority that issued all of them [default: ca.crt beside the
    /// certificate]
    #[arg(
        long = "certificate-authority",
        id = "certificate_authority",
        value_name = "FILE"
    )]
    pub(super) authority: Option<PathBuf>,

    /// The authority's list of revoked certificates; without one, a certificate is accepted until it
    /// expires [default: ca.crl beside the certificate, if it is there]
    #[arg(long, value_name = "FILE")]
    pub(super) revoked: Option<PathBuf>,
}

impl Certificates {
    pub(super) fn files(&self) -> Result<Option<CertificateFiles>, Failure> {
        let Some(certificate) = self.certificate.clone() else {
            return match self.authority.as_ref().or(self.revoked.as_ref()) {
                None => Ok(None),
                Some(_) => Err(Failure::new(
                    "an authority or a revocation list is for a node with a certificate: name it \
                     with --certificate",
                )),
            };
        };
        let beside = || certificate.with_file_name("ca.crt");
        let list = certificate.with_file_name("ca.crl");
        let list = self
            .revoked
            .clone()
            .or_else(|| list.exists().then_some(list));
        if list.is_none() {
            tracing::warn!(
                "no list of revoked certificates (--revoked): a stolen one is accepted until it expires"
            );
        }
        Ok(Some(CertificateFiles {
            authority: self.authority.clone().unwrap_or_else(beside),
            revoked: list,
            certificate,
        }))
    }
}

/// The files of keys.
#[derive(Args, Debug)]
pub struct KeyFiles {
    /// The file of this node's key, or the PKCS #11 URI of a key in a token [default:
    /// ~/.config/jaus/node.key]
    #[arg(long, value_name = "FILE")]
    pub(super) key: Option<PathBuf>,

    /// The file of the keys that this node trusts [default: trusted_keys beside the key]
    #[arg(long, value_name = "FILE")]
    pub(super) trusted_keys: Option<PathBuf>,

    /// Accept a line of the trusted keys only if two of the people in this file have signed it: a name and
    /// a public key in each line [default: approvers beside the trusted keys, if it is there]
    #[arg(long, value_name = "FILE")]
    pub(super) approvers: Option<PathBuf>,
}

impl KeyFiles {
    /// The file of this node's key, or the URI of a key in a token.
    ///
    /// # Errors
    /// Without a flag and a home directory.
    pub fn key(&self) -> Result<PathBuf, Failure> {
        if let Some(path) = &self.key {
            return Ok(path.clone());
        }
        Ok(Self::folder()?.join("node.key"))
    }

    /// The folder of keys if no flag names another.
    ///
    /// # Errors
    /// Without a home directory.
    pub fn folder() -> Result<PathBuf, Failure> {
        config_folder().ok_or_else(|| {
            Failure::new("there is no home directory: name the file of the key with --key")
        })
    }

    /// The file of trusted keys.
    ///
    /// # Errors
    /// As [`key`](Self::key).
    pub fn trusted_keys(&self) -> Result<PathBuf, Failure> {
        if let Some(path) = &self.trusted_keys {
            return Ok(path.clone());
        }
        let key = self.key()?;
        if Key::is_in_token(&key) {
            return Ok(Self::folder()?.join("trusted_keys"));
        }
        Ok(key.with_file_name("trusted_keys"))
    }

    /// The file of those who approve changes of the trusted keys, if these are under dual control.
    ///
    /// # Errors
    /// As [`key`](Self::key).
    pub fn approvers(&self) -> Result<Option<PathBuf>, Failure> {
        let beside = self.trusted_keys()?.with_file_name("approvers");
        let beside = beside.exists().then_some(beside);
        Ok(self.approvers.clone().or(beside))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_authority_without_a_certificate_is_an_error() {
        let path = || Some(PathBuf::from("ca.crt"));
        for (authority, revoked) in [(path(), None), (None, path())] {
            let certificate = None;
            let certificates = Certificates {
                certificate,
                authority,
                revoked,
            };
            let error = certificates.files().unwrap_err().to_string();
            assert!(error.contains("--certificate"), "{error}");
        }
        let certificate = Some(PathBuf::from("/etc/jaus/rover.crt"));
        let certificates = Certificates {
            certificate,
            ..Certificates::default()
        };
        let files = certificates.files().unwrap().unwrap();
        assert_eq!(files.authority, PathBuf::from("/etc/jaus/ca.crt"));
    }
}
