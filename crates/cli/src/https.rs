//! Flags of the operator's page over HTTPS.

use std::path::PathBuf;
use std::time::SystemTime;

use clap::Args;
use jaus_ocu::Tls;

use super::failure::Failure;
use super::folders::{make_folder_of, service_folder};

#[derive(Args, Debug)]
#[expect(
    missing_docs,
    reason = "it would become the help text of the struct that flattens it"
)]
pub struct HttpsFlags {
    /// Serve the page over HTTPS, with a certificate that is made at the first start and kept in
    /// ~/.config/jaus (page.crt, page.key); its fingerprint is printed
    #[arg(long, conflicts_with = "tls_certificate")]
    https: bool,

    /// Serve the page over HTTPS with this certificate in PEM, followed by those of its issuers
    #[arg(long, value_name = "FILE", requires = "tls_key")]
    tls_certificate: Option<PathBuf>,

    /// The key of the certificate in PEM; a file that other users can read is refused
    #[arg(long, value_name = "FILE", requires = "tls_certificate")]
    tls_key: Option<PathBuf>,
}

impl HttpsFlags {
    /// The certificate and its key; `None` if the flags ask for none. A new certificate is for
    /// these names and addresses.
    ///
    /// # Errors
    /// A file that cannot be used.
    #[expect(
        clippy::disallowed_methods,
        reason = "certificates are valid in real time"
    )]
    pub fn open(&self, names: &[String]) -> Result<Option<Tls>, Failure> {
        let now = SystemTime::now();
        let tls = match (&self.tls_certificate, &self.tls_key) {
            (Some(certificate), Some(key)) => Tls::load(certificate, key, now),
            _ if self.https => {
                let folder = service_folder().ok_or_else(|| {
                    Failure::new(
                        "--https: there is no home directory for a new certificate: name one with \
                         --tls-certificate and --tls-key",
                    )
                })?;
                make_folder_of(&folder.join("page.key"))?;
                Tls::load_or_make(&folder, names, now)
            }
            _ => return Ok(None),
        };
        tls.map(Some).map_err(Failure::of)
    }
}
