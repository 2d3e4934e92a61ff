//! Who is logged in: the sessions of users, each with a secret, an idle limit and an age limit.

use std::collections::BTreeMap;
use std::fmt;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::token::Token;
use crate::users::{User, UserRole, Users};

/// Number of a session, unique for this run. It is no secret.
pub(super) type LoginId = u64;

/// The session of a user.
#[derive(Debug)]
pub(super) struct Login {
    pub(super) id: LoginId,
    /// What the user's pages prove to know.
    pub(super) secret: Token,
    /// The user at login, with the role that the session has.
    pub(super) user: Arc<User>,
    pub(super) address: SocketAddr,
    pub(super) since: Instant,
    /// When the user last did something.
    pub(super) active: Instant,
}

/// Why a session ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Ending {
    LoggedOut,
    Idle,
    TooOld,
    /// The user is not in the users file any more.
    Removed,
    /// The users file gives the user less than the session has.
    RoleReduced,
    PasswordChanged,
    /// The user has logged in elsewhere more often than is allowed.
    Displaced,
    EndedBy(Arc<str>),
}

impl fmt::Display for Ending {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LoggedOut => f.write_str("logged out"),
            Self::Idle => write!(f, "idle for {} min", Logins::IDLE.as_secs() / 60),
            Self::TooOld => write!(f, "logged in for {} h", Logins::LONGEST.as_secs() / 3600),
            Self::Removed => f.write_str("the user was removed"),
            Self::RoleReduced => f.write_str("the user's role was reduced"),
            Self::PasswordChanged => f.write_str("the user's password was changed"),
            Self::Displaced => f.write_str("too many later logins"),
            Self::EndedBy(user) => write!(f, "ended by {user}"),
        }
    }
}

/// The sessions of all users.
#[derive(Debug, Default)]
pub(super) struct Logins {
    by_id: BTreeMap<LoginId, Login>,
    last_id: LoginId,
}

impl Logins {
    /// A session without a request of its user ends after this time.
    const IDLE: Duration = Duration::from_secs(30 * 60);
    /// Every session ends after this time.
    pub(super) const LONGEST: Duration = Duration::from_secs(12 * 3600);
    /// The most sessions of a user. One more ends the one that was idle for longest.
    const MOST_OF_USER: usize = 4;

    /// Begins a session, under this secret. Returns one that had to end for it.
    pub(super) fn begin(
        &mut self,
        now: Instant,
        secret: &Token,
        user: Arc<User>,
        address: SocketAddr,
    ) -> Option<Login> {
        let mine = || self.by_id.values().filter(|it| it.user.name == user.name);
        let mut displaced = None;
        if mine().count() >= Self::MOST_OF_USER {
            let idlest = mine().min_by_key(|it| it.active).map(|it| it.id);
            displaced = idlest.and_then(|id| self.end(id));
        }
        self.last_id += 1;
        let login = Login {
            id: self.last_id,
            secret: secret.clone(),
            user,
            address,
            since: now,
            active: now,
        };
        self.by_id.insert(login.id, login);
        displaced
    }

    /// The session with a secret.
    pub(super) fn find(&self, is_it: impl Fn(&Token) -> bool) -> Option<&Login> {
        self.by_id.values().find(|it| is_it(&it.secret))
    }

    /// The secret of a session.
    pub(super) fn secret(&self, id: LoginId) -> Option<Token> {
        Some(self.by_id.get(&id)?.secret.clone())
    }

    /// Whether a session has not ended.
    pub(super) fn contains(&self, id: LoginId) -> bool {
        self.by_id.contains_key(&id)
    }

    /// The user of a session has done something.
    pub(super) fn touch(&mut self, now: Instant, id: LoginId) {
        if let Some(login) = self.by_id.get_mut(&id) {
            login.active = login.active.max(now);
        }
    }

    /// Ends a session.
    pub(super) fn end(&mut self, id: LoginId) -> Option<Login> {
        self.by_id.remove(&id)
    }

    /// Ends the sessions whose time is over, or to which the users file does not entitle any more.
    pub(super) fn expire(&mut self, now: Instant, users: &Users) -> Vec<(Login, Ending)> {
        let ended = self.by_id.values();
        let ended = ended.filter_map(|it| Some((it.id, it.ending(now, users)?)));
        let ended: Vec<_> = ended.collect();
        let ended = ended.into_iter();
        ended
            .filter_map(|(id, why)| Some((self.end(id)?, why)))
            .collect()
    }

    /// All sessions, the newest last.
    pub(super) fn all(&self) -> Vec<&Login> {
        self.by_id.values().collect()
    }
}

impl Login {
    pub(super) fn role(&self) -> UserRole {
        self.user.role
    }

    /// Why the session is to end, if it is.
    fn ending(&self, now: Instant, users: &Users) -> Option<Ending> {
        let Some(user) = users.find(&self.user.name) else {
            return Some(Ending::Removed);
        };
        if user.role < self.user.role {
            Some(Ending::RoleReduced)
        } else if user.password != self.user.password {
            Some(Ending::PasswordChanged)
        } else if now >= self.since + Logins::LONGEST {
            Some(Ending::TooOld)
        } else if now >= self.active + Logins::IDLE {
            Some(Ending::Idle)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::users::PasswordHash;
    use crate::users::tests::{user, users};

    const MINUTE: Duration = Duration::from_secs(60);

    fn address() -> SocketAddr {
        ([10, 0, 0, 1], 999).into()
    }

    /// Logins with one of anna, who may drive, under this secret.
    fn logins(now: Instant, secret: &Token) -> Logins {
        let mut logins = Logins::default();
        let anna = Arc::new(user("anna", UserRole::Drive));
        assert!(logins.begin(now, secret, anna, address()).is_none());
        logins
    }

    #[track_caller]
    fn ends(logins: &mut Logins, now: Instant, users: &Users, expected: Ending) {
        let ended = logins.expire(now, users);
        let endings: Vec<_> = ended.into_iter().map(|(_, ending)| ending).collect();
        assert_eq!(endings, [expected]);
        assert!(logins.all().is_empty());
    }

    #[test]
    fn a_session_is_found_by_its_secret_alone() {
        let (now, secret) = (Instant::now(), Token::generate().unwrap());
        let logins = logins(now, &secret);
        let find = |secret: &str| logins.find(|it| it.is(secret));
        assert_eq!(find(secret.reveal()).unwrap().user.name, "anna");
        for wrong in ["", "anna", &secret.reveal()[1..]] {
            assert!(find(wrong).is_none(), "{wrong}");
        }
    }

    #[test]
    fn an_idle_session_ends_after_half_an_hour_and_a_busy_one_after_twelve() {
        let (start, secret) = (Instant::now(), Token::generate().unwrap());
        let users = users(&[("anna", UserRole::Drive)]);
        let mut idle = logins(start, &secret);
        assert!(idle.expire(start + 29 * MINUTE, &users).is_empty());
        ends(&mut idle, start + 30 * MINUTE, &users, Ending::Idle);

        let mut busy = logins(start, &secret);
        let id = busy.all()[0].id;
        for minute in 0..12 * 60 {
            let now = start + MINUTE * minute;
            assert!(busy.expire(now, &users).is_empty(), "minute {minute}");
            busy.touch(now, id);
        }
        ends(&mut busy, start + 12 * 60 * MINUTE, &users, Ending::TooOld);
    }

    #[test]
    fn a_session_ends_when_its_user_is_removed_or_changed() {
        let (now, secret) = (Instant::now(), Token::generate().unwrap());
        let removed = users(&[("ben", UserRole::Drive)]);
        ends(&mut logins(now, &secret), now, &removed, Ending::Removed);
        let reduced = users(&[("anna", UserRole::Observe)]);
        ends(
            &mut logins(now, &secret),
            now,
            &reduced,
            Ending::RoleReduced,
        );
        let mut other = user("anna", UserRole::Drive);
        other.password = PasswordHash::of("another password").unwrap();
        let changed = Users::of(vec![other]);
        ends(
            &mut logins(now, &secret),
            now,
            &changed,
            Ending::PasswordChanged,
        );
        let raised = users(&[("anna", UserRole::Administer)]);
        let mut logins = logins(now, &secret);
        assert!(logins.expire(now, &raised).is_empty());
        let role = logins.all()[0].role();
        assert_eq!(role, UserRole::Drive, "until the next login");
    }

    #[test]
    fn a_user_has_a_bounded_number_of_sessions_and_the_idlest_ends() {
        let start = Instant::now();
        let first = Token::generate().unwrap();
        let mut logins = logins(start, &first);
        let anna = Arc::new(user("anna", UserRole::Drive));
        for minute in 1..=20 {
            let secret = Token::generate().unwrap();
            let now = start + MINUTE * minute;
            let displaced = logins.begin(now, &secret, anna.clone(), address());
            assert_eq!(displaced.is_some(), minute >= 4, "minute {minute}");
        }
        assert_eq!(logins.all().len(), 4);
        assert!(logins.find(|it| *it == first).is_none());
    }
}
