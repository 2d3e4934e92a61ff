//! Who may use the page: holders of the token, users who log in, or everyone on this host.

use std::collections::BTreeSet;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use axum::http::{HeaderMap, header};
use tokio::sync::Semaphore;
use tokio::task::spawn_blocking;

use super::devices::{DeviceId, Devices};
use super::guard;
use super::logins::{Ending, Login, LoginId, Logins};
use super::proof::Proofs;
use super::trail::Trail;
use super::visitor::Visitor;
use crate::token::Token;
use crate::users::{PasswordHash, UserRole, Users, UsersError, UsersFile};
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
    pub(super) fn visitor(
        &self,
        headers: &HeaderMap,
        address: SocketAddr,
        proofs: &Proofs,
    ) -> Option<Visitor> {
        let from = (address, guard::host(headers).unwrap_or_default());
        let visitor = |role| Visitor::new(OPERATOR, from, None, role);
        match self {
            Self::Open => Some(visitor(Some(UserRole::Drive))),
            Self::Token { to_read: false, .. } => Some(visitor(Some(UserRole::Observe))),
            Self::Token { to_read: true, .. } => Some(visitor(None)),
            Self::Users(gate) => gate.visitor(headers, from, proofs),
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

    /// The secret that a visitor has shown or proved to know.
    pub(super) fn secret_of(&self, visitor: &Visitor) -> Option<Token> {
        match self {
            Self::Open => None,
            Self::Token { token, .. } => visitor.may(UserRole::Drive).then(|| token.clone()),
            Self::Users(gate) => gate.logins().secret(visitor.login?),
        }
    }
}

/// What a request shows: a secret or a ticket.
pub(super) fn shown(headers: &HeaderMap) -> Option<&str> {
    let bearer = headers.get(header::AUTHORIZATION);
    let bearer = bearer.and_then(|it| it.to_str().ok()?.strip_prefix("Bearer "));
    bearer.or_else(|| token_of_handshake(headers))
}

/// The token that a page shows as it opens a WebSocket.
fn token_of_handshake(headers: &HeaderMap) -> Option<&str> {
    let named = headers.get_all(header::SEC_WEBSOCKET_PROTOCOL).iter();
    let mut named = named
        .filter_map(|it| it.to_str().ok())
        .flat_map(|it| it.split(','));
    named.find_map(|it| it.trim().strip_prefix(TOKEN_SUBPROTOCOL))
}

/// A browser sets no other header of a WebSocket, so a page names its token there.
const TOKEN_SUBPROTOCOL: &str = "token.";

/// Why nobody is logged in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum LoginError {
    #[error("wrong name or password")]
    Wrong,
    #[error("too many logins at this moment; try again")]
    Busy,
    #[error("the system has no random numbers")]
    NoRandomness,
    #[error(
        "nobody can log in until the file of the users can be used again: see the log of this station"
    )]
    UnusableUsers,
}

/// The users of the page and their sessions.
pub(crate) struct UserGate {
    file: UsersFile,
    logins: Mutex<Logins>,
    trail: Trail,
    /// Name of the cookie with a device's secret, which only spares it delays: browsers show cookies to every port
    /// of a host.
    device_cookie: String,
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
        let prefix = if is_secure { "__Host-" } else { "" };
        let device_cookie = format!("{prefix}jaus-{port}-device");
        Self {
            file,
            logins: Mutex::default(),
            trail,
            device_cookie,
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

    fn visitor(
        &self,
        headers: &HeaderMap,
        from: (SocketAddr, &str),
        proofs: &Proofs,
    ) -> Option<Visitor> {
        let shown = shown(headers)?;
        let logins = self.logins();
        let login = logins.find(|secret| proofs.is_shown(secret, from.1, shown))?;
        let name = &login.user.name;
        Some(Visitor::new(name, from, Some(login.id), Some(login.role())))
    }

    /// The device of a request, if the user has logged in from it before.
    pub(super) fn device(&self, headers: &HeaderMap, user: &str) -> Option<DeviceId> {
        let secret = cookie(headers, &self.device_cookie)?;
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
        let shown = cookie(headers, &self.device_cookie);
        let known = shown.filter(|secret| self.devices.is_known(&users, secret));
        let secret = match known.and_then(Token::new) {
            Some(secret) => secret,
            None => Token::generate().map_err(|_| LoginError::NoRandomness)?,
        };
        self.devices.remember(&users, user, &secret);
        let age = Self::DEVICE_AGE.as_secs();
        let (name, value) = (&self.device_cookie, secret.reveal());
        let secure = if self.is_secure { "; Secure" } else { "" };
        let attributes = format!("Path=/; HttpOnly; SameSite=Strict{secure}; Max-Age={age}");
        Ok(format!("{name}={value}; {attributes}"))
    }

    /// Checks that users can log in: a file that has become unusable may lack one who was removed.
    pub(super) fn check_users(&self) -> Result<(), LoginError> {
        match self.file.fault() {
            Some(_) => Err(LoginError::UnusableUsers),
            None => Ok(()),
        }
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
        let user = verified.ok_or(LoginError::Wrong)?;
        // The file may have changed meanwhile.
        self.check_users()?;
        if self.users().find(name) != Some(&user) {
            return Err(LoginError::Wrong);
        }
        let user = Arc::new(user);
        let secret = Token::generate().map_err(|_| LoginError::NoRandomness)?;
        let displaced = self.logins().begin(now(), &secret, user, address);
        if let Some(login) = displaced {
            self.trail.ended(&login, &Ending::Displaced);
        }
        Ok(secret)
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
            Err(error) => self.report_unusable(&error),
        }
        if self.file.fault().is_some() {
            // Whose session ends now could not log in again to stop a vehicle.
            return;
        }
        let ended = self.logins().expire(now, &self.users());
        for (login, why) in ended {
            self.trail.ended(&login, &why);
        }
    }

    /// Says that nobody can log in, and who remains: one who was to be removed may be among them.
    fn report_unusable(&self, error: &UsersError) {
        let logins = self.logins();
        let connected: BTreeSet<_> = logins.all().iter().map(|it| &*it.user.name).collect();
        let connected = match connected.len() {
            0 => "nobody".to_owned(),
            _ => connected.into_iter().collect::<Vec<_>>().join(", "),
        };
        tracing::error!(
            connected,
            "nobody can log in, because {error}; the sessions of the connected users remain, also of one who \
             was to be removed: make the file usable, or stop the station"
        );
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

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::users::tests::user;
    use crate::users::{add, remove};
    use jaus::address::JausId;

    /// A gate with anna, who has logged in, and the id of her session.
    fn gate(path: &std::path::Path, now: Instant) -> (UserGate, LoginId) {
        let anna = user("anna", UserRole::Drive);
        add(path, &anna).unwrap();
        let file = UsersFile::load(path).unwrap();
        let trail = Trail::new(None, JausId::new(60, 1, 1));
        let gate = UserGate::new(file, Devices::load(None), 8443, true, trail);
        let secret = Token::generate().unwrap();
        let address = ([10, 0, 0, 1], 999).into();
        gate.logins().begin(now, &secret, Arc::new(anna), address);
        let id = gate.logins().all()[0].id;
        (gate, id)
    }

    #[test]
    fn while_nobody_can_log_in_no_session_ends() {
        let (folder, start) = (tempfile::tempdir().unwrap(), Instant::now());
        let path = folder.path().join("users");
        let (gate, anna) = gate(&path, start);
        let good = fs::read(&path).unwrap();
        fs::write(&path, "half a line\n").unwrap();
        let late = start + 2 * Logins::LONGEST;
        gate.handle_time(late);
        assert_eq!(gate.check_users(), Err(LoginError::UnusableUsers));
        assert!(gate.logins().contains(anna));
        fs::write(&path, good).unwrap();
        gate.handle_time(late);
        assert_eq!(gate.check_users(), Ok(()));
        assert!(!gate.logins().contains(anna), "it is too old");
    }

    #[tokio::test]
    async fn a_user_who_is_removed_while_the_password_is_verified_is_not_logged_in() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("users");
        let (gate, _) = gate(&path, now());
        let address = ([10, 0, 0, 1], 999).into();
        let password = || crate::users::tests::PASSWORD.to_owned();
        gate.log_in("anna", password(), address, false)
            .await
            .unwrap();
        // Polled first, it has found the user when she is removed.
        let login = gate.log_in("anna", password(), address, false);
        let removal = async {
            remove(&path, "anna").unwrap();
            gate.file.refresh().unwrap();
        };
        let (refused, ()) = tokio::join!(login, removal);
        assert_eq!(refused.unwrap_err(), LoginError::Wrong);
    }
}
