//! Who may use the page: holders of the token, users who log in, or everyone on this host.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use axum::http::{HeaderMap, header};
use tokio::sync::Semaphore;
use tokio::task::spawn_blocking;

use super::devices::{DeviceId, Devices};
use super::logins::{Ending, Login, LoginId, Logins};
use super::trail::Trail;
use super::visitor::Visitor;
use crate::token::Token;
use crate::users::{PasswordHash, UserRole, Users, UsersFile};
use jaus::node::now;

/// The user of a page that requires no login.
const OPERATOR: &str = "operator";

/// Who may use the page.
pub(crate) enum Gate {
    /// Everyone who reaches it: other users and programs of this host, too.
    Open,
    /// Driving requires the token, and looking and stopping too if `to_read` is set.
    Token { token: Token, to_read: bool },
    /// Everything requires a login.
    Users(Box<UserGate>),
}

impl Gate {
    /// The sender of a request, with the role that the request shows; `None` for one who has to
    /// log in first.
    pub(super) fn visitor(&self, headers: &HeaderMap, address: SocketAddr) -> Option<Visitor> {
        let visitor = |role| Visitor::new(OPERATOR, address, None, role);
        match self {
            Self::Open => Some(visitor(Some(UserRole::Drive))),
            Self::Token { to_read: false, .. } => Some(visitor(Some(UserRole::Observe))),
            Self::Token { to_read: true, .. } => Some(visitor(None)),
            Self::Users(gate) => gate.visitor(headers, address),
        }
    }

    /// Whether a page without the token may look.
    pub(super) const fn lets_watch(&self) -> bool {
        !matches!(self, Self::Token { to_read: true, .. })
    }

    pub(super) fn users(&self) -> Option<&UserGate> {
        match self {
            Self::Users(gate) => Some(gate),
            _ => None,
        }
    }

    pub(super) const fn token(&self) -> Option<&Token> {
        match self {
            Self::Token { token, .. } => Some(token),
            _ => None,
        }
    }
}

/// Why nobody is logged in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum LoginError {
    #[error("wrong name or password")]
    Wrong,
    #[error("too many logins at this moment; try again")]
    Busy,
    #[error("the system has no random numbers")]
    NoRandomness,
}

/// The users of the page and their sessions.
pub(crate) struct UserGate {
    file: UsersFile,
    logins: Mutex<Logins>,
    trail: Trail,
    /// Name of the cookie with a session's secret. Browsers do not tell the ports of a host apart.
    cookie: String,
    /// Whether the page is served over TLS.
    is_secure: bool,
    /// From where users have logged in before.
    devices: Devices,
    /// Logins from known devices, and all others: those never wait for these.
    lanes: [LoginQueue; 2],
}

/// Logins that are verified one after another.
struct LoginQueue {
    /// Those that are being verified, or wait for it.
    waiting: Semaphore,
    /// Verifies one password at a time, which takes 19 MiB.
    verifier: Arc<Semaphore>,
}

impl LoginQueue {
    /// The most logins that are being verified, or wait for it.
    const MOST_WAITING: usize = 16;

    fn new() -> Self {
        Self {
            waiting: Semaphore::new(Self::MOST_WAITING),
            verifier: Arc::new(Semaphore::new(1)),
        }
    }
}

impl UserGate {
    /// How long browsers keep the cookie of a device.
    const DEVICE_AGE: Duration = Duration::from_secs(180 * 24 * 3600);

    pub(crate) fn new(
        file: UsersFile,
        devices: Devices,
        port: u16,
        is_secure: bool,
        trail: Trail,
    ) -> Self {
        let cookie = if is_secure {
            format!("__Host-jaus-{port}")
        } else {
            format!("jaus-{port}")
        };
        Self {
            file,
            logins: Mutex::default(),
            trail,
            cookie,
            is_secure,
            devices,
            lanes: [LoginQueue::new(), LoginQueue::new()],
        }
    }

    pub(super) fn users(&self) -> Arc<Users> {
        self.file.users()
    }

    /// The sessions.
    pub(super) fn logins(&self) -> MutexGuard<'_, Logins> {
        self.logins.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn visitor(&self, headers: &HeaderMap, address: SocketAddr) -> Option<Visitor> {
        let secret = cookie(headers, &self.cookie)?;
        let logins = self.logins();
        let login = logins.find(secret)?;
        let name = &login.user.name;
        Some(Visitor::new(
            name,
            address,
            Some(login.id),
            Some(login.role()),
        ))
    }

    /// The device of a request, if the user has logged in from it before.
    pub(super) fn device(&self, headers: &HeaderMap, user: &str) -> Option<DeviceId> {
        let secret = cookie(headers, &self.device_cookie())?;
        self.devices.find(user, secret)
    }

    /// The user has logged in from the device of a request. Returns the header `Set-Cookie` by which
    /// it is known again.
    pub(super) fn remember_device(
        &self,
        headers: &HeaderMap,
        user: &str,
    ) -> Result<String, LoginError> {
        let users = self.users();
        let shown = cookie(headers, &self.device_cookie());
        let known = shown.filter(|secret| self.devices.is_known(&users, secret));
        let secret = match known.and_then(Token::new) {
            Some(secret) => secret,
            None => Token::generate().map_err(|_| LoginError::NoRandomness)?,
        };
        self.devices.remember(&users, user, &secret);
        let age = Self::DEVICE_AGE.as_secs();
        let cookie = self.cookie_with(&self.device_cookie(), secret.reveal());
        Ok(format!("{cookie}; Max-Age={age}"))
    }

    /// Name of the cookie with a device's secret.
    fn device_cookie(&self) -> String {
        format!("{}-device", self.cookie)
    }

    /// Verifies a password, and begins a session. Returns its secret.
    pub(super) async fn log_in(
        &self,
        name: &str,
        password: String,
        address: SocketAddr,
        is_known_device: bool,
    ) -> Result<Token, LoginError> {
        let [known, others] = &self.lanes;
        let lane = if is_known_device { known } else { others };
        let _place = lane.waiting.try_acquire().map_err(|_| LoginError::Busy)?;
        // The permit fails only if the semaphore is closed, which never happens.
        let permit = lane.verifier.clone().acquire_owned().await;
        let user = self.users().find(name).cloned();
        let verify = move || {
            let _permit = permit;
            match user {
                Some(user) => user.password.verifies(&password).then_some(user),
                None => {
                    PasswordHash::verify_nothing(&password);
                    None
                }
            }
        };
        let verified = spawn_blocking(verify).await.ok().flatten();
        let user = Arc::new(verified.ok_or(LoginError::Wrong)?);
        let secret = Token::generate().map_err(|_| LoginError::NoRandomness)?;
        let displaced = self.logins().begin(now(), &secret, user, address);
        if let Some(login) = displaced {
            self.trail.ended(&login, &Ending::Displaced);
        }
        Ok(secret)
    }

    /// The header `Set-Cookie` for a secret.
    pub(super) fn set_cookie(&self, secret: &Token) -> String {
        let age = Logins::LONGEST.as_secs();
        let cookie = self.cookie_with(&self.cookie, secret.reveal());
        format!("{cookie}; Max-Age={age}")
    }

    /// The header `Set-Cookie` that removes the cookie.
    pub(super) fn clear_cookie(&self) -> String {
        format!("{}; Max-Age=0", self.cookie_with(&self.cookie, ""))
    }

    fn cookie_with(&self, name: &str, value: &str) -> String {
        let secure = if self.is_secure { "; Secure" } else { "" };
        format!("{name}={value}; Path=/; HttpOnly; SameSite=Strict{secure}")
    }

    /// Ends a session.
    pub(super) fn end(&self, id: LoginId, why: &Ending) -> Option<Login> {
        let login = self.logins().end(id);
        if let Some(login) = &login {
            self.trail.ended(login, why);
        }
        login
    }

    /// Whether the session of a visitor has not ended. A session counts as used now if `is_active`
    /// is set.
    pub(super) fn holds(&self, visitor: &Visitor, is_active: bool) -> bool {
        let Some(id) = visitor.login else {
            return false;
        };
        let mut logins = self.logins();
        if is_active {
            logins.touch(now(), id);
        }
        logins.contains(id)
    }

    /// Reads the users file again if it has changed, and ends the sessions that are over.
    pub(super) fn handle_time(&self, now: Instant) {
        match self.file.refresh() {
            Ok(true) => tracing::info!("the users file has been read again"),
            Ok(false) => {}
            Err(error) => tracing::error!(%error, "the previous users remain"),
        }
        let ended = self.logins().expire(now, &self.users());
        for (login, why) in ended {
            self.trail.ended(&login, &why);
        }
    }
}

/// The value of a cookie of a request.
fn cookie<'h>(headers: &'h HeaderMap, wanted: &str) -> Option<&'h str> {
    let cookies = headers.get_all(header::COOKIE).iter();
    let mut pairs = cookies
        .filter_map(|it| it.to_str().ok())
        .flat_map(|it| it.split(';'))
        .filter_map(|it| it.trim().split_once('='));
    pairs.find_map(|(name, value)| (name == wanted).then_some(value))
}
