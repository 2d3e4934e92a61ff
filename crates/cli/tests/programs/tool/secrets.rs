//! No secret in the output of programs: neither private keys nor the operator's token, at the most
//! verbose log level.

use std::fmt::Write as _;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use futures_util::{SinkExt as _, StreamExt as _};
use jaus_test_kit::waiting::{LIMIT, block_until};
use tempfile::TempDir;
use tokio::time::timeout;
use tokio_tungstenite::connect_async;
use tokio_tungstenite::tungstenite::Message;

use super::judge::peer::free_port;

const TOKEN: &str = "0123456789abcdef-of-the-operator";

/// The files of one host, and all that its programs print.
struct Host {
    folder: TempDir,
    programs: Vec<Child>,
}

impl Host {
    fn new() -> Self {
        Self {
            folder: tempfile::tempdir().unwrap(),
            programs: Vec::new(),
        }
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A program with the key of this host, whose output goes to the log.
    fn program(&self, program: &str, arguments: &[&str]) -> Command {
        let log = File::options()
            .create(true)
            .append(true)
            .open(self.file("log"))
            .unwrap();
        let tool = Path::new(env!("CARGO_BIN_EXE_jaus"));
        let mut command = Command::new(tool.with_file_name(program));
        command.args(arguments);
        command.arg("--key").arg(self.file("node.key"));
        command.arg("--trusted-keys").arg(self.file("trusted_keys"));
        command.env("JAUS_LOG", "trace");
        command.stdout(log.try_clone().unwrap()).stderr(log);
        command
    }

    fn run(&self, program: &str, arguments: &[&str]) {
        let status = self.program(program, arguments).status().unwrap();
        assert!(status.success(), "{}", self.log());
    }

    fn start(&mut self, program: &str, arguments: &[&str]) {
        let child = self.program(program, arguments).spawn().unwrap();
        self.programs.push(child);
    }

    fn public_key(&self) -> String {
        let mut show = self.program("jaus", &["keys", "show"]);
        let shown = show.stdout(Stdio::piped()).output();
        String::from_utf8(shown.unwrap().stdout)
            .unwrap()
            .trim()
            .to_owned()
    }

    fn log(&self) -> String {
        String::from_utf8_lossy(&std::fs::read(self.file("log")).unwrap()).into_owned()
    }

    /// The private key as text in every form that a careless log may have.
    fn secrets(&self) -> Vec<String> {
        let pem = std::fs::read_to_string(self.file("node.key")).unwrap();
        let lines: Vec<_> = pem.lines().filter(|it| !it.starts_with('-')).collect();
        let document = BASE64.decode(lines.concat()).unwrap();
        // PKCS #8: the seed follows the tags and lengths of two octet strings.
        let tags = document.windows(4).position(|it| it == [4, 34, 4, 32]);
        let seed = &document[tags.unwrap() + 4..][..32];
        let [mut lower, mut upper] = [String::new(), String::new()];
        for octet in seed {
            write!(lower, "{octet:02x}").unwrap();
            write!(upper, "{octet:02X}").unwrap();
        }
        let list = format!("{seed:?}");
        let list = list.trim_matches(['[', ']']).to_owned();
        let mut secrets = vec![lower, upper, list, BASE64.encode(seed)];
        secrets.extend(lines.into_iter().map(str::to_owned));
        secrets
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        for program in &mut self.programs {
            // It may have ended already.
            let _ = program.kill();
            let _ = program.wait();
        }
    }
}

/// Opens the operator's page, and shows the token.
async fn log_in(port: u16) {
    let url = format!("ws://127.0.0.1:{port}/ws");
    let connected = timeout(LIMIT, connect_async(url)).await.unwrap();
    let (mut page, _) = connected.unwrap();
    let shown = format!(r#"{{"type":"token","token":"{TOKEN}","id":7}}"#);
    page.send(Message::text(shown)).await.unwrap();
    let answered = async {
        while let Some(Ok(message)) = page.next().await {
            if message.to_text().is_ok_and(|it| it.contains(r#""id":7"#)) {
                return message.into_text().unwrap().to_string();
            }
        }
        panic!("no answer to the token");
    };
    let answer = timeout(LIMIT, answered).await.unwrap();
    assert!(answer.contains("done"), "{answer}");
}

#[tokio::test]
async fn neither_a_private_key_nor_the_token_is_in_any_output_at_trace_level() {
    let (mut vehicle, mut operator) = (Host::new(), Host::new());
    for host in [&vehicle, &operator] {
        host.run("jaus", &["keys", "new"]);
    }
    let listen = format!("--secure-listen=127.0.0.1:{}", free_port());
    let (_, address) = listen.split_once('=').unwrap();
    let trust = format!("operator {} 60.255.255", operator.public_key());
    vehicle.start(
        "jaus",
        &[
            "vehicle", "-vvv", "--id", "116.1.1", &listen, "--trust", &trust,
        ],
    );

    let token = operator.file("token");
    jaus_files::create(token.as_ref(), jaus_files::Readers::Owner, TOKEN.as_bytes()).unwrap();
    let port = free_port();
    let page = format!("127.0.0.1:{port}");
    let trust = format!("rover {} 116.255.255", vehicle.public_key());
    let file = token.to_str().unwrap();
    let flags = [
        "-vvv",
        "--id",
        "60.1.1",
        "--secure-peer",
        address,
        "--trust",
        &trust,
    ];
    let station = [&flags[..], &["--listen", &page, "--token-file", file]].concat();
    operator.start("jaus-ocu", &station);
    for host in [&vehicle, &operator] {
        block_until(|| host.log().contains("secure session established"));
    }
    block_until(|| operator.log().contains("the operator's page is at"));
    log_in(port).await;

    let secrets = [
        vehicle.secrets(),
        operator.secrets(),
        vec![TOKEN.to_owned()],
    ]
    .concat();
    for host in [&vehicle, &operator] {
        let log = host.log();
        assert!(
            log.contains("TRACE"),
            "the log is not at its most verbose level: {log}"
        );
        for secret in &secrets {
            assert!(!log.contains(secret), "`{secret}` is in the output: {log}");
        }
    }
}
