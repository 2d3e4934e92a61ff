//! Keys in a token: a hardware security module, a smart card or another device with a PKCS #11
//! library. The private key never leaves it.

use std::fmt::{self, Display};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use cryptoki::context::{CInitializeArgs, CInitializeFlags, Pkcs11};
use cryptoki::error::{Error, RvError};
use cryptoki::mechanism::Mechanism;
use cryptoki::mechanism::eddsa::{EddsaParams, EddsaSignatureScheme};
use cryptoki::object::{Attribute, AttributeType, KeyType, ObjectClass, ObjectHandle};
use cryptoki::session::{Session, UserType};
use cryptoki::slot::Slot;
use jaus_files::Readers;
use rustls::pki_types::SubjectPublicKeyInfoDer;
use rustls::sign::{Signer, SigningKey};
use rustls::{SignatureAlgorithm, SignatureScheme};

use super::uri::TokenUri;
use super::{Key, KeyError, PublicKey};

/// The curve of Ed25519 as a parameter (RFC 8410), and as older libraries expect it: its name.
const CURVES: [&[u8]; 2] = [&[0x06, 0x03, 0x2B, 0x65, 0x70], b"\x13\x0Cedwards25519"];
/// The longest file of a PIN, in octets.
const LONGEST_PIN: u64 = 256;

/// A private key in a token.
struct TokenKey {
    uri: TokenUri,
    public: PublicKey,
    open: Mutex<Open>,
}

/// An open session, which one thread uses at a time.
struct Open {
    session: Session,
    key: ObjectHandle,
}

/// Why a token has no usable key.
#[derive(Debug)]
struct Unusable(String);

impl<T: Display> From<T> for Unusable {
    fn from(error: T) -> Self {
        Self(error.to_string())
    }
}

/// Finds the key with this URI.
pub(super) fn load(path: &Path) -> Result<Key, KeyError> {
    with_uri(path, |uri| key(uri, open(uri)?))
}

/// Makes a key with this URI, in the token.
pub(super) fn create(path: &Path) -> Result<Key, KeyError> {
    with_uri(path, |uri| {
        let session = login(uri)?;
        if find(&session, uri, ObjectClass::PRIVATE_KEY)?.is_some() {
            return Err("it exists: peers trust its key".into());
        }
        generate(&session, uri)?;
        drop(session);
        key(uri, open(uri)?)
    })
}

fn with_uri(
    path: &Path,
    done: impl FnOnce(&TokenUri) -> Result<Key, Unusable>,
) -> Result<Key, KeyError> {
    let text = path.to_string_lossy();
    let uri = TokenUri::parse(&text).map_err(Unusable);
    uri.and_then(|it| done(&it))
        .map_err(|Unusable(what)| KeyError::Token {
            uri: text.into_owned(),
            what,
        })
}

fn key(uri: &TokenUri, open: Open) -> Result<Key, Unusable> {
    let public = public(&open.session, uri)?;
    let (uri, open) = (uri.clone(), Mutex::new(open));
    let key = Arc::new(TokenKey { uri, public, open });
    Ok(Key {
        signing: Arc::new(TokenSigningKey(key)),
        public,
    })
}

fn open(uri: &TokenUri) -> Result<Open, Unusable> {
    let session = login(uri)?;
    let key = find(&session, uri, ObjectClass::PRIVATE_KEY)?
        .ok_or("the token has no such Ed25519 key; `jaus keys new` with this URI makes one")?;
    Ok(Open { session, key })
}

/// A session with the token, for its user.
fn login(uri: &TokenUri) -> Result<Session, Unusable> {
    let library = Pkcs11::new(&uri.module)?;
    let arguments = CInitializeArgs::new(CInitializeFlags::OS_LOCKING_OK);
    match library.initialize(arguments) {
        Ok(()) | Err(Error::Pkcs11(RvError::CryptokiAlreadyInitialized, _)) => {}
        Err(error) => return Err(error.into()),
    }
    let session = library.open_rw_session(slot(&library, uri)?)?;
    let Some(file) = &uri.pin else {
        return Ok(session);
    };
    let pin = jaus_files::read_text(file, Readers::Owner, LONGEST_PIN)
        .map_err(|error| format!("the file of the PIN {}: {error}", file.display()))?;
    let pin = pin.lines().next().unwrap_or_default();
    match session.login(UserType::User, Some(&pin.into())) {
        Ok(()) | Err(Error::Pkcs11(RvError::UserAlreadyLoggedIn, _)) => Ok(session),
        Err(error) => Err(error.into()),
    }
}

/// The slot of the token.
fn slot(library: &Pkcs11, uri: &TokenUri) -> Result<Slot, Unusable> {
    let fits = |wanted: &str, found: &str| wanted.is_empty() || wanted == found;
    let mut found = None;
    for slot in library.get_slots_with_initialized_token()? {
        let token = library.get_token_info(slot)?;
        if fits(&uri.token, token.label()) && fits(&uri.serial, token.serial_number()) {
            if found.is_some() {
                return Err("several tokens fit: add `token=LABEL` or `serial=NUMBER`".into());
            }
            found = Some(slot);
        }
    }
    found.ok_or_else(|| "the library has no such token".into())
}

/// The object of the key, of this class.
fn find(
    session: &Session,
    uri: &TokenUri,
    class: ObjectClass,
) -> Result<Option<ObjectHandle>, Unusable> {
    let mut wanted = vec![
        Attribute::Class(class),
        Attribute::KeyType(KeyType::EC_EDWARDS),
    ];
    wanted.extend(names(uri));
    match session.find_objects(&wanted)?[..] {
        [] => Ok(None),
        [only] => Ok(Some(only)),
        _ => Err("several keys have this name: add `id=%01`".into()),
    }
}

fn names(uri: &TokenUri) -> Vec<Attribute> {
    let mut names = Vec::new();
    if !uri.object.is_empty() {
        names.push(Attribute::Label(uri.object.clone().into_bytes()));
    }
    if !uri.id.is_empty() {
        names.push(Attribute::Id(uri.id.clone()));
    }
    names
}

fn public(session: &Session, uri: &TokenUri) -> Result<PublicKey, Unusable> {
    let object = find(session, uri, ObjectClass::PUBLIC_KEY)?
        .ok_or("the token has the private key, but not its public key")?;
    let attributes = session.get_attributes(object, &[AttributeType::EcPoint])?;
    let [Attribute::EcPoint(point)] = &attributes[..] else {
        return Err("the token does not show the public key".into());
    };
    // As an octet string, or bare.
    let octets = point.strip_prefix(&[0x04, 0x20]).unwrap_or(point);
    let octets: Result<[u8; 32], _> = octets.try_into();
    octets
        .map(PublicKey::from_octets)
        .map_err(|_| "its key is not an Ed25519 key".into())
}

fn generate(session: &Session, uri: &TokenUri) -> Result<(), Unusable> {
    let made = CURVES.map(|curve| {
        let mut public = vec![
            Attribute::Token(true),
            Attribute::Private(false),
            Attribute::Verify(true),
            Attribute::EcParams(curve.to_vec()),
        ];
        let mut private = vec![
            Attribute::Token(true),
            Attribute::Private(true),
            Attribute::Sensitive(true),
            Attribute::Extractable(false),
            Attribute::Sign(true),
        ];
        public.extend(names(uri));
        private.extend(names(uri));
        (public, private)
    });
    let mut failed = None;
    for (public, private) in &made {
        match session.generate_key_pair(&Mechanism::EccEdwardsKeyPairGen, public, private) {
            Ok(_) => return Ok(()),
            Err(error) => failed = Some(error),
        }
    }
    Err(failed.map_or_else(
        || "no key was made".into(),
        |error| format!("the token cannot make an Ed25519 key: {error}").into(),
    ))
}

impl TokenKey {
    /// Signs; opens another session once, because the token may have been away.
    fn sign(&self, message: &[u8]) -> Result<Vec<u8>, Unusable> {
        let mut open_session = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        if let Ok(signature) = open_session.sign(message) {
            return Ok(signature);
        }
        *open_session = open(&self.uri)?;
        Ok(open_session.sign(message)?)
    }
}

impl Open {
    fn sign(&self, message: &[u8]) -> Result<Vec<u8>, Error> {
        let mechanism = Mechanism::Eddsa(EddsaParams::new(EddsaSignatureScheme::Pure));
        self.session.sign(&mechanism, self.key, message)
    }
}

impl fmt::Debug for TokenKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TokenKey")
            .field("public", &self.public)
            .finish_non_exhaustive()
    }
}

/// The key, as TLS uses it.
#[derive(Clone, Debug)]
struct TokenSigningKey(Arc<TokenKey>);

impl SigningKey for TokenSigningKey {
    fn choose_scheme(&self, offered: &[SignatureScheme]) -> Option<Box<dyn Signer>> {
        let is_offered = offered.contains(&SignatureScheme::ED25519);
        is_offered.then(|| Box::new(self.clone()) as Box<dyn Signer>)
    }

    fn public_key(&self) -> Option<SubjectPublicKeyInfoDer<'_>> {
        Some(self.0.public.spki())
    }

    fn algorithm(&self) -> SignatureAlgorithm {
        SignatureAlgorithm::ED25519
    }
}

impl Signer for TokenSigningKey {
    fn sign(&self, message: &[u8]) -> Result<Vec<u8>, rustls::Error> {
        self.0.sign(message).map_err(|Unusable(what)| {
            tracing::error!(error = what, "the token of this node's key does not sign");
            rustls::Error::General("the token does not sign".to_owned())
        })
    }

    fn scheme(&self) -> SignatureScheme {
        SignatureScheme::ED25519
    }
}

#[cfg(test)]
mod tests;
