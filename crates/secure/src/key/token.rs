//! Keys in a token: a hardware security module, a smart card or another device with a PKCS #11
//! library. The private key never leaves it.
//!
//! A thread of its own signs, because a token may be slow or away. The caller waits for [`LONGEST_WAIT`]
//! at most, once: then each further signature fails at once until the token has answered. Peers that begin
//! sessions get a quarter of the caller's time, so that they do not stall it together either.

use std::fmt::{self, Display};
use std::fs;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TryRecvError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, SystemTime};

use cryptoki::context::{CInitializeArgs, CInitializeFlags, Pkcs11};
use cryptoki::error::{Error, RvError};
use cryptoki::mechanism::Mechanism;
use cryptoki::mechanism::eddsa::{EddsaParams, EddsaSignatureScheme};
use cryptoki::object::{Attribute, AttributeType, KeyType, ObjectClass, ObjectHandle};
use cryptoki::session::{Session, UserType};
use cryptoki::slot::Slot;
use jaus::node::now;
use jaus_files::Readers;
use jaus_limits::Bucket;
use rustls::pki_types::SubjectPublicKeyInfoDer;
use rustls::sign::{Signer, SigningKey};
use rustls::{SignatureAlgorithm, SignatureScheme};
use zeroize::Zeroizing;

use super::uri::TokenUri;
use super::{Key, KeyError, PublicKey};
use crate::crypto::digest::{SHA256, digest};

/// The curve of Ed25519 as a parameter (RFC 8410), and as older libraries expect it: its name.
const CURVES: [&[u8]; 2] = [&[0x06, 0x03, 0x2B, 0x65, 0x70], b"\x13\x0Cedwards25519"];
/// The longest file of a PIN, in octets.
const LONGEST_PIN: u64 = 256;

/// How long a caller waits for a signature.
const LONGEST_WAIT: Duration = Duration::from_millis(500);
/// Of the caller's time, signatures take one part in so many.
const SHARE: u32 = 4;
/// The time that signatures may take at once, before they have to keep to their share.
const BURST: Duration = Duration::from_secs(1);
/// How long after a failure the token is not asked again.
const PAUSE: Duration = Duration::from_secs(1);

/// Attempts to log in that a token has refused.
static REFUSED: Mutex<Vec<Vec<u8>>> = Mutex::new(Vec::new());

/// A private key in a token, as TLS uses it.
#[derive(Clone)]
struct TokenKey {
    public: PublicKey,
    signer: Arc<Mutex<SigningThread>>,
}

/// The thread that signs, as its callers see it.
struct SigningThread {
    jobs: SyncSender<Job>,
    /// The answer that did not come in time.
    late: Option<Receiver<Signed>>,
    spent: Bucket,
}

struct Job {
    message: Vec<u8>,
    answer: SyncSender<Signed>,
}

type Signed = Result<Vec<u8>, Unusable>;

/// An open session.
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
    let (uri, mut open) = (uri.clone(), Some(open));
    let signer = SigningThread::start(move |message| sign(&uri, &mut open, message))?;
    let signer = Arc::new(Mutex::new(signer));
    Ok(Key {
        signing: Arc::new(TokenKey { public, signer }),
        public,
        is_slow: true,
    })
}

/// Signs; opens another session once, because the token may have been away.
fn sign(uri: &TokenUri, current: &mut Option<Open>, message: &[u8]) -> Signed {
    if let Some(Ok(signature)) = current.as_ref().map(|it| it.sign(message)) {
        return Ok(signature);
    }
    // It is closed before: a library that has forgotten it may give its number to the next one.
    drop(current.take());
    Ok(current.insert(open(uri)?).sign(message)?)
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
    log_in(&session, uri, file)?;
    Ok(session)
}

/// Logs in, but with no PIN that the token has refused: after a few wrong ones it locks.
fn log_in(session: &Session, uri: &TokenUri, file: &Path) -> Result<(), Unusable> {
    let name = file.display();
    let pin = jaus_files::read(file, Readers::Owner, LONGEST_PIN)
        .map_err(|error| format!("the file of the PIN {name}: {error}"))?;
    let pin = Zeroizing::new(pin);
    let pin = std::str::from_utf8(&pin).map_err(|_| format!("the PIN in {name} is not UTF-8"))?;
    let pin = pin.lines().next().unwrap_or_default();
    let attempt = attempt(uri, file, pin);
    let mut refused = REFUSED.lock().unwrap_or_else(PoisonError::into_inner);
    if refused.contains(&attempt) {
        return Err(format!(
            "the token has refused the PIN in {name}: it is not tried again until that file changes, because \
             a token locks after a few wrong ones"
        )
        .into());
    }
    match session.login(UserType::User, Some(&pin.into())) {
        Ok(()) | Err(Error::Pkcs11(RvError::UserAlreadyLoggedIn, _)) => Ok(()),
        Err(error) => {
            if is_about_pin(&error) {
                refused.push(attempt);
            }
            Err(format!("with the PIN in {name}: {error}").into())
        }
    }
}

/// What makes an attempt to log in another one: the token, the PIN, and the time of its file.
fn attempt(uri: &TokenUri, file: &Path, pin: &str) -> Vec<u8> {
    let changed = fs::metadata(file).and_then(|it| it.modified()).ok();
    let since = changed.and_then(|it| it.duration_since(SystemTime::UNIX_EPOCH).ok());
    let text = Zeroizing::new(format!("{uri:?} {since:?} {pin}"));
    digest(&SHA256, text.as_bytes()).as_ref().to_vec()
}

const fn is_about_pin(error: &Error) -> bool {
    use RvError::{PinExpired, PinIncorrect, PinInvalid, PinLenRange, PinLocked};
    matches!(
        error,
        Error::Pkcs11(
            PinExpired | PinIncorrect | PinInvalid | PinLenRange | PinLocked,
            _
        )
    )
}

/// The slot of the token.
fn slot(library: &Pkcs11, uri: &TokenUri) -> Result<Slot, Unusable> {
    let fits = |wanted: &str, found: &str| wanted.is_empty() || wanted == found;
    let mut found = None;
    for slot in library.get_slots_with_initialized_token()? {
        let token = library.get_token_info(slot)?;
        let is_meant = fits(&uri.token, token.label())
            && fits(&uri.serial, token.serial_number())
            && fits(&uri.model, token.model())
            && fits(&uri.manufacturer, token.manufacturer_id());
        if is_meant {
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

impl SigningThread {
    fn start(mut sign: impl FnMut(&[u8]) -> Signed + Send + 'static) -> Result<Self, Unusable> {
        let (jobs, received) = sync_channel::<Job>(1);
        thread::Builder::new()
            .name("jaus-token".to_owned())
            .spawn(move || {
                for Job { message, answer } in received {
                    // Its caller may have stopped waiting.
                    let _ = answer.send(sign(&message));
                }
            })?;
        Ok(Self {
            jobs,
            late: None,
            spent: Bucket::default(),
        })
    }

    fn sign(&mut self, message: &[u8]) -> Signed {
        if let Some(late) = &self.late
            && matches!(late.try_recv(), Err(TryRecvError::Empty))
        {
            return Err("it has not answered yet".into());
        }
        self.late = None;
        let began = now();
        if self.spent.debt(began) >= BURST {
            return Err("it is slow or has failed, and is asked again soon".into());
        }
        let signed = self.ask(message);
        if let Err(Unusable(what)) = &signed {
            tracing::error!(error = what, "the token of this node's key does not sign");
            self.spent.spend(now(), BURST + PAUSE);
        }
        let taken = now().saturating_duration_since(began);
        self.spent.spend(now(), SHARE * taken);
        signed
    }

    fn ask(&mut self, message: &[u8]) -> Signed {
        let (answer, answered) = sync_channel(1);
        let message = message.to_vec();
        self.jobs.send(Job { message, answer })?;
        match answered.recv_timeout(LONGEST_WAIT) {
            Ok(signed) => signed,
            Err(RecvTimeoutError::Timeout) => {
                self.late = Some(answered);
                Err(format!("no answer within {LONGEST_WAIT:?}").into())
            }
            Err(error @ RecvTimeoutError::Disconnected) => Err(error.into()),
        }
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

impl SigningKey for TokenKey {
    fn choose_scheme(&self, offered: &[SignatureScheme]) -> Option<Box<dyn Signer>> {
        let is_offered = offered.contains(&SignatureScheme::ED25519);
        is_offered.then(|| Box::new(self.clone()) as Box<dyn Signer>)
    }

    fn public_key(&self) -> Option<SubjectPublicKeyInfoDer<'_>> {
        Some(self.public.spki())
    }

    fn algorithm(&self) -> SignatureAlgorithm {
        SignatureAlgorithm::ED25519
    }
}

impl Signer for TokenKey {
    fn sign(&self, message: &[u8]) -> Result<Vec<u8>, rustls::Error> {
        let mut signer = self.signer.lock().unwrap_or_else(PoisonError::into_inner);
        let signed = signer.sign(message);
        signed.map_err(|Unusable(what)| rustls::Error::General(format!("the token: {what}")))
    }

    fn scheme(&self) -> SignatureScheme {
        SignatureScheme::ED25519
    }
}

#[cfg(test)]
mod tests;
