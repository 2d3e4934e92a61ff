//! Routers, bridges and JAUS systems on this host, each system with a multicast group of its own.

use std::ffi::OsString;
use std::io::{BufRead, BufReader};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Call, Component, Handlers, Kind, Management};
use jaus::link::Group;
use jaus::messages::mobility::{
    QueryWrenchEffort, ReportWrenchEffort, SetWrenchEffort, primitive_driver,
};
use jaus::node::{Config, Node};
use jaus_test_kit::group::own_group;
use jaus_test_kit::tools::workspace;

/// The interpreter with the package `eclipse-zenoh`; `.ci/zenoh` makes it.
fn python() -> PathBuf {
    let place = std::env::var_os("JAUS_ZENOH_PYTHON");
    place.map_or_else(|| workspace("target/zenoh/bin/python"), PathBuf::from)
}

fn script(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/network");
    folder.join(name)
}

/// A process that is killed when it is dropped.
pub(crate) struct Process(Child);

impl Process {
    pub(crate) fn start(mut program: Command) -> Self {
        Self(program.spawn().unwrap())
    }

    pub(crate) fn id(&self) -> u32 {
        self.0.id()
    }

    pub(crate) fn kill(&mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// An endpoint on loopback at a free port.
pub(crate) fn endpoint() -> String {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let address = listener.local_addr().unwrap();
    format!("tcp/{address}")
}

/// The program that is to be the router instead of that of the package `eclipse-zenoh`.
fn zenohd() -> Option<OsString> {
    std::env::var_os("JAUS_ZENOHD")
}

/// The name of the routers for figures.
pub(crate) fn router_program() -> &'static str {
    match zenohd() {
        Some(_) => "zenohd",
        None => "the Python package eclipse-zenoh",
    }
}

/// Starts a router, with further flags of `zenohd`.
pub(crate) fn router(listen: &str, flags: &[&str]) -> Process {
    let mut router = match zenohd() {
        Some(zenohd) => Command::new(zenohd),
        None => {
            let mut router = Command::new(python());
            router.arg(script("router.py"));
            router
        }
    };
    router.args(["--no-multicast-scouting", "--listen", listen]);
    let child = router
        .args(flags)
        .env("RUST_LOG", "error")
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .spawn();
    let mut process = Process(child.unwrap());
    let (_, address) = listen.split_once('/').unwrap();
    while TcpStream::connect(address).is_err() {
        let ended = process.0.try_wait().unwrap();
        assert_eq!(ended, None, "the router does not listen at {listen}");
        std::thread::sleep(Duration::from_millis(20));
    }
    process
}

/// A zenoh program that knows nothing of JAUS, with its output.
pub(crate) struct Client {
    _process: Process,
    lines: std::io::Lines<BufReader<std::process::ChildStdout>>,
}

impl Client {
    pub(crate) fn start(endpoint: &str, arguments: &[&str]) -> Self {
        let mut child = Command::new(python())
            .arg(script("client.py"))
            .arg(endpoint)
            .args(arguments)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let _process = Process(child);
        Self { _process, lines }
    }

    /// The next line of its output; `None` at the end.
    pub(crate) fn line(&mut self) -> Option<String> {
        self.lines.next().map(Result::unwrap)
    }

    /// The whole output.
    pub(crate) fn output(endpoint: &str, arguments: &[&str]) -> Vec<String> {
        let mut client = Self::start(endpoint, arguments);
        std::iter::from_fn(|| client.line()).collect()
    }
}

/// The lines that a program has logged.
#[derive(Clone, Default)]
pub(crate) struct Log(Arc<Mutex<Vec<String>>>);

impl Log {
    /// How many lines have all of these texts.
    pub(crate) fn count(&self, texts: &[&str]) -> usize {
        let lines = self.0.lock().unwrap();
        let has_all = |line: &&String| texts.iter().all(|text| line.contains(text));
        lines.iter().filter(has_all).count()
    }
}

/// One JAUS system: its multicast group on loopback.
pub(crate) struct System {
    group: Group,
}

impl System {
    pub(crate) fn new() -> Self {
        Self { group: own_group() }
    }

    pub(crate) fn node(&self, subsystem: u16, node: u8) -> Node {
        let mut config = Config::loopback(subsystem, node);
        config.group = self.group;
        Node::start(config).unwrap()
    }

    /// Starts a bridge of this system.
    pub(crate) fn bridge(&self, id: &str, flags: &[&str]) -> Process {
        Process::start(self.program(id, flags))
    }

    /// Starts a bridge of this system whose log is read.
    pub(crate) fn bridge_with_log(&self, id: &str, flags: &[&str]) -> (Process, Log) {
        let mut program = self.program(id, flags);
        let mut child = program.stderr(Stdio::piped()).spawn().unwrap();
        let log = Log::default();
        let (lines, kept) = (BufReader::new(child.stderr.take().unwrap()), log.clone());
        std::thread::spawn(move || {
            for line in lines.lines().map_while(Result::ok) {
                kept.0.lock().unwrap().push(line);
            }
        });
        (Process(child), log)
    }

    pub(crate) fn program(&self, id: &str, flags: &[&str]) -> Command {
        let mut program = Command::new(env!("CARGO_BIN_EXE_jaus-zenoh"));
        program
            .args(["--loopback", "--port", "0", "--id", id])
            .args(["--group", &self.group.to_string()])
            .args(flags);
        program
    }
}

/// A motor that runs at an effort in percent.
struct Motor(f64);

impl primitive_driver::Service<Call<'_>> for Motor {
    fn set_wrench_effort(&mut self, message: SetWrenchEffort, _: &mut Call<'_>) {
        self.0 = message.propulsive_linear_effort_x_percent().unwrap_or(0.0);
    }

    fn query_wrench_effort(
        &mut self,
        _: QueryWrenchEffort,
        _: &mut Call<'_>,
    ) -> Option<ReportWrenchEffort> {
        let mut report = ReportWrenchEffort::default();
        report.set_propulsive_linear_effort_x_percent(self.0).ok()?;
        Some(report)
    }

    fn stop(&mut self, _: &mut Call<'_>) {
        self.0 = 0.0;
    }
}

/// A vehicle with a motor.
pub(crate) fn rover(node: &Node) -> Component {
    Component::builder(Kind::Vehicle, "Rover")
        .offer(Handlers::of(primitive_driver::Server::new(Motor(0.0))))
        .management(Management::new())
        .attach(node, 33)
        .unwrap()
}

pub(crate) fn operator(node: &Node) -> Component {
    Component::builder(Kind::OperatorControlUnit, "Operator")
        .attach(node, 1)
        .unwrap()
}

/// Its effort in percent, as it reports it itself.
pub(crate) async fn effort(asks: &Component, rover: JausId) -> f64 {
    let query = QueryWrenchEffort::all();
    let report = asks.query(rover, &query).await.unwrap();
    report.propulsive_linear_effort_x_percent().unwrap_or(0.0)
}
