//! Nodes on two hosts: two network namespaces with a cable between them. The nodes are processes
//! of their own (this test binary, started again inside a namespace) and meet by multicast.
//!
//! Making namespaces needs rights: root's, or a kernel that lets users have namespaces of their
//! own. Where both lack, the tests say so loudly and pass.
#![cfg(all(feature = "node", target_os = "linux"))]
#![allow(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test with processes"
)]

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::Outgoing;
use jaus::node::{Config, Node};
use jaus::wire::Priority;

/// Longer than anything takes; reached only when a test fails.
const LIMIT: Duration = Duration::from_secs(30);

/// Set for a process that plays a node; says which.
const ROLE: &str = "JAUS_TEST_ROLE";

/// Set for a test that was started again in a user namespace.
const INSIDE: &str = "JAUS_TEST_IN_USER_NAMESPACE";

/// Two network namespaces, joined by a cable; gone when dropped.
struct TwoHosts {
    names: [String; 2],
}

impl TwoHosts {
    const ADDRESSES: [&str; 2] = ["10.213.77.1", "10.213.77.2"];

    fn new() -> Result<Self, String> {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let name = |end| format!("jaus-{}-{number}-{end}", std::process::id());
        let hosts = Self {
            names: [name("a"), name("b")],
        };
        hosts.set_up().map(|()| hosts)
    }

    fn set_up(&self) -> Result<(), String> {
        let [a, b] = &self.names;
        ip(&["netns", "add", a])?;
        ip(&["netns", "add", b])?;
        ip(&[
            "link", "add", "jaus0", "netns", a, "type", "veth", "peer", "jaus0", "netns", b,
        ])?;
        for (name, address) in self.names.iter().zip(Self::ADDRESSES) {
            let prefixed = format!("{address}/24");
            ip(&["-n", name, "address", "add", &prefixed, "dev", "jaus0"])?;
            ip(&["-n", name, "link", "set", "lo", "up"])?;
            ip(&["-n", name, "link", "set", "jaus0", "up"])?;
        }
        Ok(())
    }

    /// Runs `ip` on one of the two hosts.
    fn ip(&self, host: usize, arguments: &[&str]) {
        ip(&[&["-n", &self.names[host]], arguments].concat()).unwrap();
    }

    /// Starts this test binary in the role of a node on one of the two hosts.
    fn start(&self, host: usize, role: &str) -> Process {
        let mut child = Command::new("ip")
            .args(["netns", "exec", &self.names[host]])
            .arg(std::env::current_exe().unwrap())
            .args([
                "--exact",
                "a_process_that_plays_a_node",
                "--nocapture",
                "--test-threads=1",
            ])
            .env(ROLE, role)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (sender, lines) = channel();
        let stdout = BufReader::new(child.stdout.take().unwrap());
        std::thread::spawn(move || {
            for line in stdout.lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    break;
                }
            }
        });
        Process { child, lines }
    }
}

impl Drop for TwoHosts {
    fn drop(&mut self) {
        for name in &self.names {
            // Not there if setting up failed half-way.
            let _ = ip(&["netns", "delete", name]);
        }
    }
}

/// Runs a test's body on two hosts: made here; or else in a user namespace, where this test binary
/// is started again for the same test; or not at all, said loudly.
fn on_two_hosts(test: &str, body: impl FnOnce(&TwoHosts)) {
    let reason = match TwoHosts::new() {
        Ok(hosts) => return body(&hosts),
        Err(reason) => reason,
    };
    if std::env::var_os(INSIDE).is_none()
        && in_user_namespace(&["true"])
            .status()
            .is_ok_and(|s| s.success())
    {
        let again = std::env::current_exe().unwrap();
        let again = [again.to_str().unwrap(), "--exact", test, "--nocapture"];
        assert!(
            in_user_namespace(&again)
                .status()
                .is_ok_and(|s| s.success()),
            "{test} failed in a user namespace"
        );
        return;
    }
    say_skipped(test, &format!("no network namespaces here: {reason}"));
}

/// Says it past the test harness, which would keep the words of a test that passes.
fn say_skipped(test: &str, reason: &str) {
    let words = format!(
        "\n*** SKIPPED {test}: {reason}\n\
         *** To run it: as root, with iproute2 installed.\n\n"
    );
    std::io::stderr().write_all(words.as_bytes()).unwrap();
}

/// A command as root of namespaces of its own, which a plain user may often be.
fn in_user_namespace(command: &[&str]) -> Command {
    let mut unshare = Command::new("unshare");
    unshare
        .args(["--user", "--map-root-user", "--net", "--mount", "sh", "-c"])
        .args(["mount -t tmpfs none /run && exec \"$@\"", "sh"])
        .args(command)
        .env(INSIDE, "1");
    unshare
}

fn ip(arguments: &[&str]) -> Result<(), String> {
    run("ip", arguments)
}

fn run(program: &str, arguments: &[&str]) -> Result<(), String> {
    let output = Command::new(program).args(arguments).output();
    let output = output.map_err(|e| format!("{program}: {e}"))?;
    let said = String::from_utf8_lossy(&output.stderr);
    if output.status.success() {
        Ok(())
    } else {
        Err(said.trim().replace('\n', "; "))
    }
}

/// A node in a process of its own; killed when dropped.
struct Process {
    child: Child,
    lines: Receiver<String>,
}

impl Process {
    /// Waits until the process prints a line that begins so, and gives the rest of it.
    fn says(&self, beginning: &str) -> String {
        let deadline = Instant::now() + LIMIT;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            match self.lines.recv_timeout(left) {
                Ok(line) => {
                    if let Some(rest) = line.strip_prefix(beginning) {
                        return rest.trim().to_owned();
                    }
                }
                Err(e) => panic!("the other process did not say `{beginning}`: {e}"),
            }
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn nodes_on_two_hosts_meet_by_multicast_and_go_on_by_unicast() {
    on_two_hosts(
        "nodes_on_two_hosts_meet_by_multicast_and_go_on_by_unicast",
        |hosts| {
            let echo = hosts.start(0, "echo");
            assert_eq!(echo.says("listening on"), "10.213.77.1:3794");
            let caller = hosts.start(1, "caller");
            assert_eq!(echo.says("heard"), "102.1.1 at 10.213.77.2:3794");
            assert_eq!(caller.says("answered by"), "101.1.33 at 10.213.77.1:3794");
        },
    );
}

#[test]
fn an_interface_that_comes_up_later_is_used_and_again_after_it_was_down() {
    on_two_hosts(
        "an_interface_that_comes_up_later_is_used_and_again_after_it_was_down",
        |hosts| {
            hosts.ip(0, &["address", "flush", "dev", "jaus0"]);
            let echo = hosts.start(0, "echo");
            assert_eq!(echo.says("listening on"), "127.0.0.1:3794");

            hosts.ip(0, &["address", "add", "10.213.77.1/24", "dev", "jaus0"]);
            let caller = hosts.start(1, "caller");
            assert_eq!(caller.says("answered by"), "101.1.33 at 10.213.77.1:3794");

            hosts.ip(0, &["link", "set", "jaus0", "down"]);
            hosts.ip(0, &["address", "flush", "dev", "jaus0"]);
            hosts.ip(0, &["link", "set", "jaus0", "up"]);
            hosts.ip(0, &["address", "add", "10.213.77.9/24", "dev", "jaus0"]);
            let caller = hosts.start(1, "caller");
            assert_eq!(caller.says("answered by"), "101.1.33 at 10.213.77.9:3794");
        },
    );
}

#[test]
fn an_urgent_message_overtakes_what_a_slow_network_holds_back() {
    on_two_hosts(
        "an_urgent_message_overtakes_what_a_slow_network_holds_back",
        |hosts| {
            let slow = ["qdisc", "add", "dev", "jaus0", "root", "tbf"];
            let slow = [
                &slow[..],
                &["rate", "20mbit", "burst", "4kb", "latency", "10s"],
            ]
            .concat();
            let network = &hosts.names[1];
            if let Err(reason) = run(
                "ip",
                &[&["netns", "exec", network, "tc"], &slow[..]].concat(),
            ) {
                return say_skipped("an_urgent_message_overtakes_…", &reason);
            }
            let sink = hosts.start(0, "sink");
            sink.says("listening on");
            let _flood = hosts.start(1, "flood");
            let before: usize = sink.says("urgent message after").parse().unwrap();
            assert!(
                before < FLOOD / 2,
                "the urgent message came after {before} of {FLOOD}"
            );
            assert_eq!(sink.says("all").parse(), Ok(FLOOD));
        },
    );
}

/// Not a test of its own: does nothing unless another test starts it in a role.
#[test]
fn a_process_that_plays_a_node() {
    let Ok(role) = std::env::var(ROLE) else {
        return;
    };
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .unwrap();
    // Not for ever, should the test that waits for this process be killed.
    let play = async {
        match role.as_str() {
            "echo" => echo().await,
            "caller" => call().await,
            "sink" => sink().await,
            "flood" => flood().await,
            other => panic!("unknown role {other}"),
        }
    };
    let _ = runtime.block_on(async { tokio::time::timeout(2 * LIMIT, play).await });
}

/// Answers whatever it hears, until it is killed.
async fn echo() {
    let node = Node::start(Config::new(101, 1)).unwrap();
    let mut port = node.attach(33).unwrap();
    println!("\nlistening on {}", node.links()[0].local);
    while let Some(message) = port.recv().await {
        println!("heard {} at {}", message.source, message.path.unwrap().peer);
        port.send(Outgoing::new(port.id(), message.source, message.payload))
            .unwrap();
    }
}

/// Asks everyone until somebody answers.
async fn call() {
    let node = Node::start(Config::new(102, 1)).unwrap();
    let mut port = node.attach(1).unwrap();
    let query_identification = Bytes::from_static(&[0x00, 0x2B, 0x02]);
    let answer = loop {
        let query = Outgoing::new(port.id(), JausId::EVERYONE, query_identification.clone());
        port.send(query).unwrap();
        if let Ok(answer) = tokio::time::timeout(Duration::from_millis(200), port.recv()).await {
            break answer.unwrap();
        }
    };
    println!(
        "\nanswered by {} at {}",
        answer.source,
        answer.path.unwrap().peer
    );
    node.shutdown().await;
}

/// Messages that the flood is made of.
const FLOOD: usize = 2000;

/// Counts what comes, and says when the urgent message came.
async fn sink() {
    let node = Node::start(Config::new(101, 1)).unwrap();
    let mut port = node.attach(33).unwrap();
    println!("\nlistening on {}", node.links()[0].local);
    let mut usual = 0;
    let mut urgent = false;
    while usual < FLOOD || !urgent {
        let message = port.recv().await.unwrap();
        if message.priority == Priority::SafetyCritical {
            urgent = true;
            println!("urgent message after {usual}");
        } else {
            usual += 1;
        }
    }
    println!("all {usual}");
    std::future::pending::<()>().await;
}

/// Sends far more than the network takes, and then something urgent.
async fn flood() {
    let node = Node::start(Config::new(102, 1)).unwrap();
    let port = node.attach(1).unwrap();
    let picture = Bytes::from(vec![0; 1400]);
    let usual = Outgoing::new(port.id(), JausId::EVERYONE, picture);
    let set_emergency = Bytes::from_static(&[0x06, 0x00, 0x01]);
    let urgent = Outgoing {
        priority: Priority::SafetyCritical,
        ..Outgoing::new(port.id(), JausId::EVERYONE, set_emergency)
    };
    for _ in 0..FLOOD {
        port.send(usual.clone()).unwrap();
    }
    port.send(urgent).unwrap();
    std::future::pending::<()>().await;
}
