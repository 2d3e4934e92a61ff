//! Test hosts: network namespaces, and processes that run test nodes in them.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use crate::evidence::{RUN, not_tested, run as this_run, this_test};
use crate::waiting::{LIMIT, block_until};

/// Role of a test node's process.
const ROLE: &str = "JAUS_TEST_ROLE";

/// Settings of a test node's process that differ from the defaults.
pub const SETTINGS: &str = "JAUS_TEST_SETTINGS";

/// Set for a test that was restarted in a user namespace.
const INSIDE: &str = "JAUS_TEST_IN_USER_NAMESPACE";

/// The test that plays the roles of test nodes and calls [`play`]. It is in the outermost module of
/// the tests that start them, or at the top of their program.
const PLAYER: &str = "a_process_that_plays_a_node";

/// The path of the [`PLAYER`] of this thread's test.
fn player() -> String {
    match this_test().split_once("::") {
        Some((module, _)) => format!("{module}::{PLAYER}"),
        None => PLAYER.to_owned(),
    }
}

/// Runs the body of this thread's test on hosts. If they cannot be created here, restarts this test
/// binary for the same test in a user namespace. If that fails too, reports the test as [not
/// run](not_tested).
pub fn on_hosts<H>(make: impl FnOnce() -> Result<H, String>, body: impl FnOnce(&H)) {
    on_hosts_for(&this_test(), make, body);
}

/// The same, for a program that is its own test harness.
pub fn on_hosts_for<H>(
    test: &str,
    make: impl FnOnce() -> Result<H, String>,
    body: impl FnOnce(&H),
) {
    let reason = match make() {
        Ok(hosts) => {
            return body(&hosts);
        }
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
    let remedy = "run it as root, with iproute2 installed";
    not_tested(
        test,
        &format!("no network namespaces here: {reason}; {remedy}"),
    );
}

/// A command as root in its own namespaces, which many systems permit to any user.
fn in_user_namespace(command: &[&str]) -> Command {
    let mut unshare = Command::new("unshare");
    unshare
        .args(["--user", "--map-root-user", "--net", "--mount", "sh", "-c"])
        .args(["mount -t tmpfs none /run && exec \"$@\"", "sh"])
        .args(command)
        .env(INSIDE, "1")
        .env(RUN, this_run());
    unshare
}

/// Runs `ip` with these arguments.
///
/// # Errors
/// The output, if it failed.
pub fn ip(arguments: &[&str]) -> Result<(), String> {
    run("ip", arguments)
}

/// Runs a program to completion.
///
/// # Errors
/// The output, if it failed.
pub fn run(program: &str, arguments: &[&str]) -> Result<(), String> {
    let output = Command::new(program).args(arguments).output();
    let output = output.map_err(|e| format!("{program}: {e}"))?;
    let said = String::from_utf8_lossy(&output.stderr);
    if output.status.success() {
        Ok(())
    } else {
        Err(said.trim().replace('\n', "; "))
    }
}

/// Two network namespaces joined by a cable; removed when dropped.
pub struct TwoHosts {
    /// The names of the namespaces.
    pub names: [String; 2],
}

impl TwoHosts {
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
        for name in &self.names {
            add_host(name)?;
        }
        self.connect("jaus0", "10.213.77")
    }

    /// Connects the hosts with a cable, with addresses .1 and .2 of the network.
    pub fn connect(&self, cable: &str, network: &str) -> Result<(), String> {
        lay_cable(&self.names, cable, network)
    }

    /// The link-local IPv6 address of an interface, as written on the other end of the cable.
    pub fn link_local(&self, host: usize, cable: &str) -> String {
        let shown = [
            "-n",
            &self.names[host],
            "-6",
            "-o",
            "address",
            "show",
            "dev",
            cable,
        ];
        let output = Command::new("ip").args(shown).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        let address = text
            .split_whitespace()
            .find_map(|word| word.strip_suffix("/64"));
        format!("{}%{cable}", address.unwrap())
    }

    /// Waits for duplicate address detection of both hosts' IPv6 addresses: a second or two.
    pub fn wait_for_addresses(&self) {
        for name in &self.names {
            let tentative = ["-n", name, "-6", "-o", "address", "show", "tentative"];
            block_until(|| {
                let output = Command::new("ip").args(tentative).output();
                output.unwrap().stdout.is_empty()
            });
        }
    }

    /// Runs `ip` on one of the two hosts.
    pub fn ip(&self, host: usize, arguments: &[&str]) {
        ip(&[&["-n", &self.names[host]], arguments].concat()).unwrap();
    }

    /// One of our programs on one of the two hosts.
    #[must_use]
    pub fn command(&self, host: usize, program: &str) -> Command {
        on_host(&self.names[host], program)
    }

    /// Starts this test binary in a node's role on one of the two hosts.
    pub fn start(&self, host: usize, role: &str) -> Process {
        self.start_with(host, role, "")
    }

    /// The same with settings, such as `ip=6 group=off`.
    pub fn start_with(&self, host: usize, role: &str, settings: &str) -> Process {
        Process::start(&self.names[host], role, settings)
    }
}

impl Drop for TwoHosts {
    fn drop(&mut self) {
        for name in &self.names {
            // Missing if the setup failed halfway.
            let _ = ip(&["netns", "delete", name]);
        }
    }
}

/// Creates a host: a network namespace of this name.
pub fn add_host(name: &str) -> Result<(), String> {
    ip(&["netns", "add", name])?;
    ip(&["-n", name, "link", "set", "lo", "up"])
}

/// Connects two hosts with a cable, with addresses .1 and .2 of the network.
pub fn lay_cable(hosts: &[String; 2], cable: &str, network: &str) -> Result<(), String> {
    let [a, b] = hosts;
    ip(&[
        "link", "add", cable, "netns", a, "type", "veth", "peer", cable, "netns", b,
    ])?;
    for (number, name) in (1..).zip(hosts) {
        let address = format!("{network}.{number}/24");
        ip(&["-n", name, "address", "add", &address, "dev", cable])?;
        ip(&["-n", name, "link", "set", cable, "up"])?;
    }
    Ok(())
}

/// Runs a test's body on two hosts, or reports that this is impossible.
pub fn on_two_hosts(body: impl FnOnce(&TwoHosts)) {
    on_hosts(TwoHosts::new, body);
}

/// One of our programs on a host, with its usual log.
#[must_use]
pub fn on_host(host: &str, program: &str) -> Command {
    let mut command = Command::new("ip");
    command
        .args(["netns", "exec", host, program])
        .env_remove("JAUS_LOG");
    command
}

/// A node in its own process; killed when dropped.
pub struct Process {
    child: Child,
    lines: Receiver<String>,
}

impl Process {
    /// Starts this test binary in a role on a host, with settings.
    pub fn start(host: &str, role: &str, settings: &str) -> Self {
        let this = std::env::current_exe().unwrap();
        let mut child = Command::new("ip")
            .args(["netns", "exec", host])
            .arg(this)
            .args(["--exact", &player(), "--nocapture", "--test-threads=1"])
            .env(ROLE, role)
            .env(SETTINGS, settings)
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
        Self { child, lines }
    }

    /// Sends the process a signal, by its name.
    pub fn signal(&self, name: &str) {
        let (signal, id) = (format!("-{name}"), self.child.id().to_string());
        let sent = Command::new("kill").args([&signal, &id]).status();
        assert!(sent.unwrap().success(), "{name} to {id}");
    }

    /// Waits until the process prints a line with this prefix; returns the rest.
    pub fn says(&self, beginning: &str) -> String {
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

/// Duration of a manual test, in seconds.
pub const SOAK: &str = "JAUS_SOAK_SECONDS";

/// Plays this process's role, if it has one. A time limit ends it in case the waiting test is
/// killed.
pub fn play(part: impl AsyncFnOnce(&str)) {
    let Ok(role) = std::env::var(ROLE) else {
        return;
    };
    let soak = std::env::var(SOAK).map_or(0, |seconds| seconds.parse().unwrap());
    let limit = 2 * LIMIT + 2 * Duration::from_secs(soak);
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .unwrap();
    let played = async { tokio::time::timeout(limit, part(&role)).await };
    let _ = runtime.block_on(played);
}
