//! Routers and nodes in Python, on loopback.

use std::io::{BufRead, BufReader, Lines};
use std::path::PathBuf;
use std::process::{self, Child, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicU8, Ordering};

use jaus_ros2::session::{Ros, Settings};
use jaus_test_kit::tools::workspace;

/// The interpreter with the packages `eclipse-zenoh`, `cyclonedds` and `xxhash`; `.ci/ros2` makes it.
fn python() -> PathBuf {
    let place = std::env::var_os("JAUS_ROS2_PYTHON");
    place.map_or_else(|| workspace("target/ros2/bin/python"), PathBuf::from)
}

/// A script in Python with its output. It is killed when it is dropped.
pub(crate) struct Script {
    child: Child,
    lines: Lines<BufReader<ChildStdout>>,
}

impl Script {
    pub(crate) fn start(path: &str, arguments: &[&str]) -> Self {
        let mut child = Command::new(python())
            .arg(workspace(path))
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        Self { child, lines }
    }

    pub(crate) fn ready(mut self) -> Self {
        assert_eq!(self.line().as_deref(), Some("ready"));
        self
    }

    /// A router that listens at an endpoint.
    pub(crate) fn router(endpoint: &str) -> Self {
        let flags = ["--no-multicast-scouting", "--listen", endpoint];
        Self::start("crates/zenoh/tests/network/router.py", &flags).ready()
    }

    /// The node in Python, when it is ready; `ros.py` describes the arguments.
    pub(crate) fn node(endpoint: &str, arguments: &[&str]) -> Self {
        let arguments = [&[endpoint], arguments].concat();
        Self::start("crates/ros2/tests/network/ros.py", &arguments).ready()
    }

    /// The liveliness tokens that Python finds, in order.
    pub(crate) fn tokens(endpoint: &str) -> Vec<String> {
        let script = Self::start("crates/ros2/tests/network/ros.py", &[endpoint, "tokens"]);
        let mut lines = script.lines_left();
        lines.retain(|line| !line.is_empty());
        lines
    }

    /// The next line of the output; `None` at the end.
    pub(crate) fn line(&mut self) -> Option<String> {
        self.lines.next().map(Result::unwrap)
    }

    /// The rest of the output.
    pub(crate) fn lines_left(mut self) -> Vec<String> {
        std::iter::from_fn(|| self.line()).collect()
    }
}

impl Drop for Script {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// An endpoint at a loopback address that no other test and no outgoing connection uses.
pub(crate) fn endpoint() -> String {
    static NUMBER: AtomicU8 = AtomicU8::new(1);
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    let [.., high, low] = process::id().to_be_bytes();
    format!("tcp/127.{high}.{low}.{number}:7447")
}

/// A session that connects to an endpoint.
pub(crate) fn session(endpoint: &str) -> Ros {
    let mut settings = Settings::default();
    settings.network.connect = vec![endpoint.to_owned()];
    Ros::open(&settings).unwrap()
}
