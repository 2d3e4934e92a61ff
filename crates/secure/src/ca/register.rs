//! The register of issued certificates: a line for each, its fields separated by blanks.

use std::fmt;
use std::io;
use std::path::Path;
use std::time::{Duration, SystemTime};

use jaus::address::JausId;
use rustls::pki_types::UnixTime;

use super::AuthorityError;
use crate::approval::since_1970;
use crate::certificate::{self, Certificate, CertificateError};
use crate::key::PublicKey;

/// What stands in place of the time of revocation in the line of a certificate that is not revoked.
const NOT_REVOKED: &str = "-";

/// A certificate that an authority has issued.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Issued {
    /// Its serial number, in hexadecimal digits.
    pub serial: String,
    /// The name of the node.
    pub name: String,
    /// The key of the node.
    pub key: PublicKey,
    /// The ids that the node may speak for; with wildcards.
    pub ids: Vec<JausId>,
    /// Until when it is valid.
    pub not_after: SystemTime,
    /// When it was revoked.
    pub revoked: Option<SystemTime>,
}

impl Issued {
    pub(super) fn of(certificate: &Certificate) -> Self {
        Self {
            serial: certificate.serial().to_owned(),
            name: certificate.name().to_owned(),
            key: certificate.key(),
            ids: certificate.ids().to_vec(),
            not_after: SystemTime::UNIX_EPOCH
                + Duration::from_secs(certificate.not_after().as_secs()),
            revoked: None,
        }
    }

    /// Until when it is valid, for people, in UTC.
    #[must_use]
    pub fn end(&self) -> String {
        certificate::shown(UnixTime::since_unix_epoch(Duration::from_secs(since_1970(
            self.not_after,
        ))))
    }

    /// The octets of the serial number; `None` if the line of the register was damaged.
    pub(super) fn serial_octets(&self) -> Option<Vec<u8>> {
        octets(&self.serial)
    }

    fn parse(line: &str) -> Result<Self, String> {
        let parts: Vec<_> = line.split_whitespace().collect();
        let [serial, name, key, ids, not_after, revoked] = parts[..] else {
            return Err("six fields are expected: serial, name, key, ids, end, revoked".to_owned());
        };
        let ids = ids.split(',').map(str::parse).collect::<Result<_, _>>();
        let issued = Self {
            serial: serial.to_owned(),
            name: name.to_owned(),
            key: key.parse().map_err(|error| format!("{error}"))?,
            ids: ids.map_err(|_| "its ids are malformed")?,
            not_after: seconds(not_after)?,
            revoked: (revoked != NOT_REVOKED)
                .then(|| seconds(revoked))
                .transpose()?,
        };
        let octets = issued.serial_octets().map_or(0, |it| it.len());
        if !(1..=20).contains(&octets) {
            return Err("the serial number is not hexadecimal".to_owned());
        }
        Ok(issued)
    }
}

/// Its line in the register.
impl fmt::Display for Issued {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ids: Vec<_> = self.ids.iter().map(JausId::to_string).collect();
        let ids = ids.join(",");
        write!(f, "{} {} {} {ids}", self.serial, self.name, self.key)?;
        write!(f, " {}", since_1970(self.not_after))?;
        match self.revoked {
            Some(at) => writeln!(f, " {}", since_1970(at)),
            None => writeln!(f, " {NOT_REVOKED}"),
        }
    }
}

/// Reads a register, which may be missing before the first certificate.
pub(super) fn read(path: &Path) -> Result<Vec<Issued>, AuthorityError> {
    let octets = match certificate::read(path) {
        Err(CertificateError::File { source, .. }) if source.kind() == io::ErrorKind::NotFound => {
            Vec::new()
        }
        other => other?,
    };
    let text = String::from_utf8_lossy(&octets);
    let lines = text.lines().enumerate();
    lines
        .map(|(index, line)| {
            Issued::parse(line).map_err(|what| AuthorityError::Register {
                path: path.to_owned(),
                line: index + 1,
                what,
            })
        })
        .collect()
}

/// The octets of hexadecimal digits.
pub(super) fn octets(text: &str) -> Option<Vec<u8>> {
    let pairs = text.as_bytes().chunks(2);
    pairs
        .map(|it| u8::from_str_radix(std::str::from_utf8(it).ok()?, 16).ok())
        .collect()
}

fn seconds(text: &str) -> Result<SystemTime, String> {
    let seconds = text.parse().ok().map(Duration::from_secs);
    seconds
        .and_then(|it| SystemTime::UNIX_EPOCH.checked_add(it))
        .ok_or_else(|| format!("`{}` is not a number of seconds", jaus_text::visible(text)))
}
