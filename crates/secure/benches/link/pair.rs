//! Two nodes in two processes, with a plain or a secure link between them.

use std::env;
use std::io::{BufRead as _, BufReader};
use std::net::SocketAddr;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::Outgoing;
use jaus::node::{Config, Node, Port, Undelivered};
use jaus_secure::{Key, SecureLink, Settings, Trust, TrustFile};
use tempfile::TempDir;
use tokio::runtime::Runtime;
use tokio::time::{sleep, timeout};

use crate::placement::{self, Placement, Side};

/// The environment variable that makes this program the other node: link, folder and group port.
const ROLE: &str = "JAUS_BENCH_ROLE";
/// The code of all messages: an experimental one, which no service handles.
const CODE: [u8; 2] = [0x01, 0xD7];
/// Octets in flight of acknowledged messages.
const UNDERWAY: usize = 4 << 20;
/// Longer messages are not echoed.
const LONGEST_ECHO: usize = 1024;

const OURS: JausId = JausId::new(60, 1, 1);
const THEIRS: JausId = JausId::new(101, 1, 1);

/// The compared links.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Link {
    Plain,
    Secure,
}

impl Link {
    pub(crate) const ALL: [Self; 2] = [Self::Plain, Self::Secure];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Secure => "secure",
        }
    }
}

/// A component, with its node.
struct Component {
    _node: Node,
    port: Port,
}

/// A local component, and one in another process that echoes short messages.
pub(crate) struct Pair {
    runtime: Runtime,
    component: Option<Component>,
    child: Child,
    _folder: TempDir,
}

impl Pair {
    pub(crate) fn start(link: Link, placement: Placement) -> Self {
        let folder = tempfile::tempdir().expect("a folder for keys");
        for name in ["ours", "theirs"] {
            Key::create(&folder.path().join(name)).expect("a key");
        }
        let group = 20_000 + std::process::id() % 40_000;
        let role = format!("{} {} {group}", link.name(), folder.path().display());
        let processors = placement.of(Side::Theirs);
        let processors: Vec<_> = processors.iter().map(usize::to_string).collect();
        let mut child = Command::new(env::current_exe().expect("the path of this program"))
            .env(ROLE, role)
            .env(placement::VARIABLE, processors.join(","))
            .stdout(Stdio::piped())
            .spawn()
            .expect("a child process");
        let mut ready = String::new();
        let output = child.stdout.take().expect("its output is piped");
        let read = BufReader::new(output).read_line(&mut ready);
        read.expect("a line from the child");
        let runtime = runtime();
        let component = runtime.block_on(async {
            match link {
                Link::Plain => plain(OURS, group),
                Link::Secure => {
                    let listen = any_port();
                    let settings =
                        Settings::new(listen).connect(ready.trim().parse().expect("an address"));
                    secure(OURS, folder.path(), settings).0
                }
            }
        });
        Self {
            runtime,
            component: Some(component),
            child,
            _folder: folder,
        }
    }

    /// Times of consecutive round trips of messages of this length.
    pub(crate) fn round_trips(&mut self, length: usize, count: usize) -> Vec<Duration> {
        let message = message(length);
        self.run(|mut component| async move {
            let mut times = Vec::with_capacity(count);
            while times.len() < count {
                times.push(round_trip(&mut component.port, &message).await);
            }
            (component, times)
        })
    }

    /// The rate of acknowledged messages of this length.
    pub(crate) fn messages_per_second(&mut self, length: usize, time: Duration) -> f64 {
        let message = Outgoing::new(OURS, THEIRS, message(length));
        self.run(|component| async move {
            let start = Instant::now();
            let sent = acknowledged(&component.port, &message, time).await;
            let rate = sent as f64 / start.elapsed().as_secs_f64();
            (component, rate)
        })
    }

    /// Runs in a task of its own, like a real component.
    fn run<T: Send + 'static, F>(&mut self, task: impl FnOnce(Component) -> F) -> T
    where
        F: Future<Output = (Component, T)> + Send + 'static,
    {
        let component = self.component.take().expect("given back after each run");
        let task = self.runtime.spawn(task(component));
        let (component, result) = self.runtime.block_on(task).expect("a run");
        self.component = Some(component);
        result
    }
}

impl Drop for Pair {
    fn drop(&mut self) {
        // It may have exited already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

async fn round_trip(port: &mut Port, message: &Bytes) -> Duration {
    loop {
        let start = Instant::now();
        port.send(Outgoing::new(OURS, THEIRS, message.clone()))
            .expect("sent");
        // The first message may be lost before the two know each other.
        if let Ok(answer) = timeout(Duration::from_secs(1), port.recv()).await {
            assert!(answer.is_some(), "the node has stopped");
            return start.elapsed();
        }
    }
}

/// Sends for this time, several messages at once; returns how many were acknowledged.
async fn acknowledged(port: &Port, message: &Outgoing, time: Duration) -> u64 {
    let underway = (UNDERWAY / message.payload.len()).max(1);
    let mut tasks = tokio::task::JoinSet::new();
    for _ in 0..underway {
        let (sender, message) = (port.sender(), message.clone());
        tasks.spawn(async move {
            let (mut sent, start) = (0, Instant::now());
            while start.elapsed() < time {
                match sender.deliver(message.clone()).await {
                    Ok(()) => sent += 1,
                    // The queue is full; nothing was sent.
                    Err(Undelivered::NotSent(_) | Undelivered::Rejected(_)) => {
                        sleep(Duration::from_millis(1)).await;
                    }
                    Err(lost) => panic!("{lost}"),
                }
            }
            sent
        });
    }
    tasks.join_all().await.into_iter().sum()
}

fn message(length: usize) -> Bytes {
    let mut message = vec![0; length];
    message[..2].copy_from_slice(&CODE);
    message.into()
}

/// The role of this process; `None` for the one that the user started.
pub(crate) fn role_of_this_process() -> Option<String> {
    env::var(ROLE).ok()
}

/// Echoes short messages for the lifetime of the process.
pub(crate) fn echo(role: &str) {
    let [link, folder, group] = role.split(' ').collect::<Vec<_>>()[..] else {
        panic!("{role} is no role");
    };
    let (folder, group) = (Path::new(folder).to_owned(), group.parse().expect("a port"));
    let is_plain = link == Link::Plain.name();
    let runtime = runtime();
    let task = runtime.spawn(async move {
        let (mut component, address) = match is_plain {
            true => (plain(THEIRS, group), None),
            false => {
                let (component, address) = secure(THEIRS, &folder, Settings::new(any_port()));
                (component, Some(address))
            }
        };
        println!("{}", address.unwrap_or_else(any_port));
        while let Some(message) = component.port.recv().await {
            if message.payload.len() <= LONGEST_ECHO {
                let answer = Outgoing::new(THEIRS, message.source, message.payload);
                component.port.send(answer).expect("sent");
            }
        }
    });
    runtime.block_on(task).expect("an echo without surprises");
}

fn plain(id: JausId, group: u32) -> Component {
    let mut config = Config::loopback(id.subsystem(), id.node());
    config.group = format!("239.255.77.7:{group}").parse().expect("a group");
    attached(Node::start(config).expect("a node on loopback"), id)
}

/// A component with a secure link, and the address that the link listens on.
fn secure(id: JausId, folder: &Path, settings: Settings) -> (Component, SocketAddr) {
    let [ours, theirs] = ["ours", "theirs"].map(|name| {
        let key = Key::load(&folder.join(name));
        key.expect("written before")
    });
    let (key, peer) = match id {
        OURS => (
            &ours,
            format!("theirs {} 101.255.255 command", theirs.public()),
        ),
        _ => (
            &theirs,
            format!("ours {} 60.255.255 command", ours.public()),
        ),
    };
    let trust = TrustFile::of(Trust::parse(&peer).expect("a trusted key"));
    let link = SecureLink::open(key, trust, settings).expect("a free port");
    let address = link.local().expect("its address");
    let config = Config::new(id.subsystem(), id.node()).without_udp();
    let node = Node::start_with(config, vec![Box::new(link)]).expect("a node");
    (attached(node, id), address)
}

fn attached(node: Node, id: JausId) -> Component {
    let port = node.attach(id.component()).expect("a free number");
    Component { _node: node, port }
}

fn any_port() -> SocketAddr {
    SocketAddr::from(([127, 0, 0, 1], 0))
}

/// One thread for node, component and sockets, as on a small board.
fn runtime() -> Runtime {
    tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .expect("a runtime")
}
