//! Keys in a token of SoftHSM.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use jaus_test_kit::evidence::{not_tested, this_test};
use jaus_test_kit::tools;
use tempfile::TempDir;

use super::*;
use crate::credentials::Credentials;
use crate::trust::TrustFile;

/// Where distributions have the library.
const LIBRARIES: [&str; 3] = [
    "/usr/lib/x86_64-linux-gnu/softhsm/libsofthsm2.so",
    "/usr/lib/softhsm/libsofthsm2.so",
    "/usr/lib64/pkcs11/libsofthsm2.so",
];
/// The URI of a test in a process of its own, whose environment names the token.
const URI: &str = "JAUS_TEST_URI";

/// A token with the label `rover`.
struct Token {
    folder: TempDir,
    library: &'static str,
}

impl Token {
    /// A new token; `None` where there is no SoftHSM.
    fn new() -> Option<Self> {
        if !tools::has_program("softhsm2-util") {
            return None;
        }
        let library = LIBRARIES.into_iter().find(|it| Path::new(it).is_file());
        let Some(library) = library else {
            not_tested(&this_test(), "there is no libsofthsm2.so");
            return None;
        };
        let folder = tempfile::tempdir().unwrap();
        let tokens = folder.path().join("tokens");
        fs::create_dir(&tokens).unwrap();
        let settings = format!("directories.tokendir = {}\n", tokens.display());
        fs::write(folder.path().join("softhsm2.conf"), settings).unwrap();
        jaus_files::create(&folder.path().join("pin"), Readers::Owner, b"123456\n").unwrap();
        let token = Self { folder, library };
        let mut made = token.command("softhsm2-util");
        made.args(["--init-token", "--free", "--label", "rover"]);
        let made = made.args(["--so-pin", "12345678", "--pin", "123456"]);
        let made = made.output().unwrap();
        assert!(made.status.success(), "{made:?}");
        Some(token)
    }

    fn command(&self, program: impl AsRef<std::ffi::OsStr>) -> Command {
        let mut command = Command::new(program);
        command.env("SOFTHSM2_CONF", self.folder.path().join("softhsm2.conf"));
        command
    }

    fn uri(&self, names: &str) -> String {
        let pin = self.folder.path().join("pin");
        let (library, pin) = (self.library, pin.display());
        format!("pkcs11:{names}?module-path={library}&pin-source={pin}")
    }

    /// Runs the ignored test of this name with a key in this token.
    fn run(&self, test: &str, names: &str) {
        let mut child = self.command(std::env::current_exe().unwrap());
        child.args([&format!("key::token::tests::{test}"), "--exact"]);
        child.args(["--ignored", "--nocapture"]);
        let output = child.env(URI, self.uri(names)).output().unwrap();
        let printed = String::from_utf8_lossy(&output.stdout);
        assert!(
            output.status.success() && printed.contains("1 passed"),
            "{output:?}"
        );
    }
}

fn uri() -> PathBuf {
    PathBuf::from(std::env::var_os(URI).unwrap())
}

#[test]
fn a_key_is_made_in_a_token_and_signs_there() {
    if let Some(token) = Token::new() {
        token.run("a_key_is_made_and_signs", "token=rover;object=node;id=%01");
    }
}

#[test]
#[ignore = "run by another test with a token"]
fn a_key_is_made_and_signs() {
    let missing = Key::load(&uri()).unwrap_err().to_string();
    assert!(missing.contains("no such Ed25519 key"), "{missing}");
    let made = Key::create(&uri()).unwrap();
    let again = Key::create(&uri()).unwrap_err().to_string();
    assert!(again.contains("it exists"), "{again}");

    let key = Key::load(&uri()).unwrap();
    assert_eq!(key.public(), made.public());
    let signature = key.sign(b"message").unwrap();
    assert!(key.public().has_signed(b"message", &signature));
    assert!(!key.public().has_signed(b"another", &signature));
    // What is derived from it is the same after a restart.
    let secrets = [&key, &made].map(|it| it.secret_for(b"purpose").as_ref().to_vec());
    assert_eq!(secrets[0], secrets[1]);
}

#[test]
fn a_token_that_was_away_signs_again() {
    if let Some(token) = Token::new() {
        token.run("a_session_is_opened_again", "token=rover;object=node");
    }
}

#[test]
#[ignore = "run by another test with a token"]
fn a_session_is_opened_again() {
    let text = uri();
    let parsed = TokenUri::parse(text.to_str().unwrap()).unwrap();
    let made = Key::create(&text).unwrap();
    // The library forgets all sessions, as when a device was unplugged.
    let library = Pkcs11::new(&parsed.module).unwrap();
    library.finalize().unwrap();
    let signature = made.sign(b"message").unwrap();
    assert!(made.public().has_signed(b"message", &signature));
}

#[test]
fn the_files_of_a_node_are_read_again_without_its_token() {
    if let Some(token) = Token::new() {
        token.run("files_are_read_again", "token=rover;object=node");
    }
}

#[test]
#[ignore = "run by another test with a token"]
fn files_are_read_again() {
    let made = Key::create(&uri()).unwrap();
    let credentials = Credentials::load(&uri(), TrustFile::default()).unwrap();
    // The token is gone.
    let module = TokenUri::parse(uri().to_str().unwrap()).unwrap().module;
    Pkcs11::new(module).unwrap().finalize().unwrap();
    let settings = PathBuf::from(std::env::var_os("SOFTHSM2_CONF").unwrap());
    fs::remove_dir_all(settings.with_file_name("tokens")).unwrap();
    credentials.reload().unwrap();
    assert_eq!(credentials.public(), made.public());
}

#[test]
fn what_is_wrong_with_a_token_is_named() {
    let Some(token) = Token::new() else {
        return;
    };
    token.run("another_token_is_named", "token=other;object=node");
    fs::write(token.folder.path().join("pin"), "654321\n").unwrap();
    token.run("a_wrong_pin_is_named", "token=rover;object=node");
    token.run("a_wrong_pin_is_tried_once", "token=rover;object=node");
}

#[test]
#[ignore = "run by another test with a token"]
fn a_wrong_pin_is_tried_once() {
    let error = || Key::load(&uri()).unwrap_err().to_string();
    let first = error();
    assert!(first.contains("with the PIN in"), "{first}");
    for _ in 0..5 {
        assert!(error().contains("not tried again until that file changes"));
    }
    let file = TokenUri::parse(uri().to_str().unwrap())
        .unwrap()
        .pin
        .unwrap();
    fs::write(file, "123456\n").unwrap();
    assert!(error().contains("no such Ed25519 key"), "{}", error());
}

#[test]
fn a_token_that_fails_is_not_asked_again_at_once() {
    let mut asked = 0;
    let mut thread = SigningThread::start(move |_| {
        asked += 1;
        Err(format!("failure {asked}").into())
    })
    .unwrap();
    let errors: Vec<_> = (0..100).map(|_| thread.sign(b"a").unwrap_err().0).collect();
    assert_eq!(errors[0], "failure 1");
    assert!(errors[1..].iter().all(|it| it.contains("again soon")));
}

#[test]
#[expect(
    clippy::disallowed_methods,
    reason = "waits for a thread, in real time"
)]
fn a_token_that_does_not_answer_is_waited_for_once() {
    let (answer, answers) = sync_channel::<()>(0);
    let asked = Arc::new(Mutex::new(0));
    let count = asked.clone();
    let mut thread = SigningThread::start(move |message| {
        *count.lock().unwrap() += 1;
        answers.recv()?;
        Ok(message.to_vec())
    })
    .unwrap();
    let Unusable(error) = thread.sign(b"first").unwrap_err();
    assert!(error.contains("no answer within"), "{error}");
    // As if its share of time were not used up.
    thread.spent = Bucket::default();
    let Unusable(error) = thread.sign(b"another").unwrap_err();
    assert!(error.contains("not answered yet"), "{error}");
    assert_eq!(*asked.lock().unwrap(), 1);
    // It comes back.
    answer.send(()).unwrap();
    let signed = thread::spawn(move || {
        loop {
            if let Ok(signed) = thread.sign(b"last") {
                return signed;
            }
            thread::sleep(Duration::from_millis(10));
        }
    });
    answer.send(()).unwrap();
    assert_eq!(signed.join().unwrap(), b"last");
}

#[test]
#[ignore = "run by another test with a token"]
fn another_token_is_named() {
    let error = Key::load(&uri()).unwrap_err().to_string();
    assert!(error.contains("no such token"), "{error}");
}

#[test]
#[ignore = "run by another test with a token"]
fn a_wrong_pin_is_named() {
    let error = Key::load(&uri()).unwrap_err().to_string();
    assert!(error.to_lowercase().contains("pin"), "{error}");
}

#[test]
fn a_missing_library_is_named() {
    let text = "pkcs11:object=node?module-path=/missing.so";
    let error = Key::load(Path::new(text)).unwrap_err().to_string();
    assert!(
        error.starts_with("the key pkcs11:object=node") && error.contains("/missing.so"),
        "{error}"
    );
}
