//! The browsers from which users have logged in, by a cookie of each (the device cookies of OWASP):
//! wrong guesses of others do not delay them, also after a restart.

use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use blake2::{Blake2s256, Digest as _};
use jaus_files::Readers;

use crate::token::Token;
use crate::users::{User, Users};

/// A user's device: a hash of the user's name and the secret of the cookie, which is random. With the
/// file of these nobody makes a cookie.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct DeviceId([u8; 32]);

impl DeviceId {
    pub(super) fn of(user: &str, secret: &str) -> Self {
        // No name contains the separator.
        let hash = Blake2s256::new()
            .chain_update(user)
            .chain_update([0])
            .chain_update(secret);
        Self(hash.finalize().into())
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct Device {
    id: DeviceId,
    user: String,
}

/// The devices of all users, the latest last.
#[derive(Debug)]
pub(crate) struct Devices {
    /// Where they are kept, if they are.
    file: Option<PathBuf>,
    known: Mutex<Vec<Device>>,
}

impl Devices {
    /// The most devices of a user. One more displaces the one that was used the longest time ago.
    const MOST_OF_USER: usize = 8;
    /// The longest file in octets: the devices of all users.
    const LONGEST_FILE: u64 =
        (Users::MOST * Self::MOST_OF_USER * (64 + 1 + User::LONGEST_NAME + 1)) as u64;

    /// Those of a file, which a successful login makes. An unusable one is replaced by then.
    pub(crate) fn load(file: Option<PathBuf>) -> Self {
        let known = file.as_ref().map(|file| match read(file) {
            Ok(known) => known,
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            Err(error) => {
                let file = file.display();
                tracing::warn!("no device of a user is known: {file}: {error}");
                Vec::new()
            }
        });
        Self {
            file,
            known: Mutex::new(known.unwrap_or_default()),
        }
    }

    fn known(&self) -> MutexGuard<'_, Vec<Device>> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The device with this secret, if the user has logged in from it.
    pub(super) fn find(&self, user: &str, secret: &str) -> Option<DeviceId> {
        let id = DeviceId::of(user, secret);
        self.known().iter().any(|it| it.id == id).then_some(id)
    }

    /// Whether any of these users has logged in from the device with this secret.
    pub(super) fn is_known(&self, users: &Users, secret: &str) -> bool {
        let mut users = users.iter();
        users.any(|user| self.find(&user.name, secret).is_some())
    }

    /// The user has logged in from the device with this secret. Devices of users who are no more are
    /// forgotten.
    pub(super) fn remember(&self, users: &Users, user: &str, secret: &Token) {
        let mut known = self.known();
        let before = known.clone();
        let id = DeviceId::of(user, secret.reveal());
        known.retain(|it| it.id != id && users.find(&it.user).is_some());
        let is_of_user = |it: &&Device| it.user == user;
        if known.iter().filter(is_of_user).count() >= Self::MOST_OF_USER
            && let Some(oldest) = known.iter().position(|it| it.user == user)
        {
            known.remove(oldest);
        }
        known.push(Device {
            id,
            user: user.to_owned(),
        });
        if *known == before {
            return;
        }
        if let Some(file) = &self.file
            && let Err(error) =
                jaus_files::replace(file, Readers::Owner, text_of(&known).as_bytes())
        {
            let file = file.display();
            tracing::warn!("the devices of users are forgotten at the next start: {file}: {error}");
        }
    }
}

fn read(file: &Path) -> io::Result<Vec<Device>> {
    // Hashes of random secrets may be read; only a line more would be harmful.
    let text = jaus_files::read_text(file, Readers::Everyone, Devices::LONGEST_FILE)?;
    Ok(text.lines().filter_map(device).collect())
}

/// Reads a line; `None` if it is malformed.
fn device(line: &str) -> Option<Device> {
    let (hash, user) = line.split_once(' ')?;
    let mut id = [0; 32];
    if hash.len() != 64 || !hash.is_ascii() {
        return None;
    }
    for (place, octet) in id.iter_mut().enumerate() {
        *octet = u8::from_str_radix(hash.get(2 * place..2 * place + 2)?, 16).ok()?;
    }
    Some(Device {
        id: DeviceId(id),
        user: user.to_owned(),
    })
}

fn text_of(known: &[Device]) -> String {
    let mut text = String::new();
    for Device { id, user } in known {
        for octet in id.0 {
            // Writing to a text does not fail.
            let _ = write!(text, "{octet:02x}");
        }
        text.extend([" ", user, "\n"]);
    }
    text
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::users::UserRole;
    use crate::users::tests::users;

    fn anna_and_ben() -> Users {
        users(&[("anna", UserRole::Drive), ("ben", UserRole::Observe)])
    }

    fn secret() -> Token {
        Token::generate().unwrap()
    }

    #[test]
    fn a_device_is_known_for_its_users_alone_also_after_a_restart_and_its_secret_is_not_kept() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("devices");
        let (users, secret) = (anna_and_ben(), secret());
        let devices = Devices::load(Some(file.clone()));
        devices.remember(&users, "anna", &secret);
        for devices in [devices, Devices::load(Some(file.clone()))] {
            assert!(devices.find("anna", secret.reveal()).is_some());
            assert!(devices.find("ben", secret.reveal()).is_none());
            assert!(devices.find("anna", &secret.reveal()[1..]).is_none());
            assert!(devices.is_known(&users, secret.reveal()));
        }
        let text = fs::read_to_string(&file).unwrap();
        assert!(!text.contains(secret.reveal()), "{text}");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            let mode = fs::metadata(&file).unwrap().permissions().mode();
            assert_eq!(mode & 0o777, 0o600);
        }
    }

    #[test]
    fn the_devices_of_a_user_are_bounded_and_those_of_removed_users_are_forgotten() {
        let devices = Devices::load(None);
        let both = anna_and_ben();
        let of_ben = secret();
        devices.remember(&both, "ben", &of_ben);
        let secrets: Vec<_> = (0..9).map(|_| secret()).collect();
        for secret in &secrets {
            devices.remember(&both, "anna", secret);
        }
        let is_known = |user: &str, secret: &Token| devices.find(user, secret.reveal()).is_some();
        let of_anna = secrets.iter().filter(|it| is_known("anna", it));
        assert_eq!(of_anna.count(), 8);
        assert!(!is_known("anna", &secrets[0]), "the oldest");
        assert!(is_known("ben", &of_ben), "others are not displaced");
        let anna = users(&[("anna", UserRole::Drive)]);
        devices.remember(&anna, "anna", &secrets[8]);
        assert!(!is_known("ben", &of_ben));
    }

    #[test]
    fn a_damaged_file_is_replaced_by_the_next_login() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("devices");
        fs::write(&file, b"\xFF\xFE garbage").unwrap();
        let devices = Devices::load(Some(file.clone()));
        let secret = secret();
        devices.remember(&anna_and_ben(), "anna", &secret);
        let again = Devices::load(Some(file));
        assert!(again.find("anna", secret.reveal()).is_some());
    }
}
