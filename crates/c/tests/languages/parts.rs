//! The parts of a small system, each in every language: a velocity sensor, a primitive driver, and an
//! operator, who shows the speed, drives for a moment and leaves the driver in standby. Those in Rust run
//! within the test, the others are the examples of their language.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use jaus::component::{Component, Kind, When};
use jaus::messages::mobility::{QueryVelocityState, primitive_driver, velocity_state_sensor};
use jaus::node::{Address, Config, Host, Node, Port};
use jaus_test_kit::evidence::{not_tested, this_test};
use jaus_test_kit::example::Example;
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::within_limit;
use tokio::sync::watch;
use tokio::task::{JoinHandle, spawn_blocking};

use super::compiler;
use super::scene::{driver_on, effort, sensor_on};

/// What a part is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Language {
    Rust,
    Cpp,
    Python,
}

impl Language {
    pub(crate) const ALL: [Self; 3] = [Self::Rust, Self::Cpp, Self::Python];

    /// The interpreter that has the package `jaus`; `.ci/python` names it.
    fn interpreter() -> Option<PathBuf> {
        std::env::var_os("JAUS_PYTHON").map(PathBuf::from)
    }

    /// Whether its programs run here.
    fn is_there(self) -> bool {
        match self {
            Self::Rust => true,
            Self::Cpp => compiler::has_compilers(),
            Self::Python => Self::interpreter().is_some(),
        }
    }

    /// Starts the example of a part in another language than Rust.
    pub(crate) fn start(self, part: &'static str, arguments: &[String]) -> Example {
        let mut command = match self {
            Self::Python => {
                let interpreter = Self::interpreter().expect("is_there was asked");
                let mut command = Command::new(interpreter);
                let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../python/examples");
                let part = if part == "operator" { "console" } else { part };
                command.arg(examples.join(part).with_extension("py"));
                command
            }
            _ => Command::new(compiler::compile(match part {
                "sensor" => "examples/sensor.cpp",
                "driver" => "examples/driver.cpp",
                "speedometer" => "examples/speedometer.cpp",
                _ => "examples/operator.cpp",
            })),
        };
        command.args(arguments);
        Example::start_command(part, command)
    }
}

/// The languages whose programs do not run here, which is reported.
pub(crate) fn missing() -> Vec<Language> {
    let missing = |it: &Language| !it.is_there();
    let missing: Vec<_> = Language::ALL.into_iter().filter(missing).collect();
    if !missing.is_empty() {
        let reason = "gcc, or a Python that JAUS_PYTHON names, is missing; run .ci/python";
        not_tested(&this_test(), &format!("{missing:?}: {reason}"));
    }
    missing
}

/// How the parts are connected.
pub(crate) enum Network {
    /// A node for each part, on loopback with a group of their own.
    Udp(String),
    /// All on the node of their host.
    LocalLink { _node: Node, socket: PathBuf },
}

impl Network {
    pub(crate) fn udp() -> Self {
        Self::Udp(own_group().to_string())
    }

    pub(crate) fn local_link(folder: &Path) -> Self {
        let socket = folder.join("node.sock");
        let config = Config::loopback(101, 1)
            .group(own_group())
            .local(Address::Path(socket.clone()));
        let _node = Node::start(config).unwrap();
        Self::LocalLink { _node, socket }
    }

    /// The arguments of a program that runs there.
    fn arguments(&self, subsystem: u16) -> Vec<String> {
        match self {
            Self::Udp(group) => vec![subsystem.to_string(), group.clone()],
            Self::LocalLink { socket, .. } => {
                vec!["--attach".to_owned(), socket.display().to_string()]
            }
        }
    }

    /// The place of a part in Rust, with its own node, if it needs one.
    async fn attach(&self, subsystem: u16, component: u8) -> (Port, Option<Node>) {
        match self {
            Self::Udp(group) => {
                let config = Config::loopback(subsystem, 1).group(group.parse().unwrap());
                let node = Node::start(config).unwrap();
                (node.attach(component).unwrap(), Some(node))
            }
            Self::LocalLink { socket, .. } => {
                let host = Host::at(Address::Path(socket.clone()));
                (host.attach(component).await.unwrap(), None)
            }
        }
    }
}

/// A part that runs until it is dropped.
pub(crate) type Running = Box<dyn Send>;

/// A velocity sensor.
pub(crate) async fn sensor(language: Language, network: &Network) -> Running {
    if language != Language::Rust {
        return Box::new(language.start("sensor", &network.arguments(101)));
    }
    let (port, node) = network.attach(101, 44).await;
    Box::new((sensor_on(port), node))
}

/// A primitive driver.
pub(crate) enum Driver {
    Here {
        _running: Running,
        drives: watch::Receiver<bool>,
    },
    Program(Option<Example>),
}

impl Driver {
    pub(crate) async fn start(language: Language, network: &Network) -> Self {
        if language != Language::Rust {
            return Self::Program(Some(language.start("driver", &network.arguments(102))));
        }
        let (port, node) = network.attach(102, 33).await;
        let (component, drives) = driver_on(port);
        let _running = Box::new((component, node));
        Self::Here { _running, drives }
    }

    pub(crate) async fn moves(&mut self) {
        let is_moved = |line: &str| line.starts_with("motor 40") || line.starts_with("motor 39.9");
        self.wait(true, "an effort of 40 %", is_moved).await;
    }

    pub(crate) async fn stops(&mut self) {
        let is_stopped = |line: &str| line == "motor 0" || line == "motor 0.0";
        self.wait(false, "no effort", is_stopped).await;
    }

    async fn wait(&mut self, drives: bool, wanted: &'static str, is_wanted: fn(&str) -> bool) {
        match self {
            Self::Here {
                drives: watched, ..
            } => {
                let reached = watched.wait_for(|it| *it == drives);
                within_limit(reached).await.unwrap();
            }
            Self::Program(program) => {
                let mut example = program.take().expect("given back below");
                let seen = spawn_blocking(move || {
                    example.expect_line(wanted, is_wanted);
                    example
                });
                *program = Some(seen.await.unwrap());
            }
        }
    }
}

/// Runs an operator. The task ends when the operator has seen the speed, has driven and has left the
/// driver in standby.
pub(crate) async fn operate(language: Language, network: &Network) -> JoinHandle<()> {
    if language != Language::Rust {
        let mut operator = language.start("operator", &network.arguments(43));
        return spawn_blocking(move || {
            operator.expect("m/s");
            operator.expect("done");
            assert!(operator.end().success());
        });
    }
    let (port, node) = network.attach(43, 1).await;
    let operator = Component::builder(Kind::OperatorControlUnit, "Operator");
    let operator = operator.live_on(port).unwrap();
    tokio::spawn(async move {
        let _node = node;
        within_limit(hear_and_drive(&operator)).await;
    })
}

async fn hear_and_drive(operator: &Component) {
    let sensor = operator.find(velocity_state_sensor::URN).await.unwrap();
    let query = QueryVelocityState::all();
    let speeds = operator.subscribe(sensor, &query, When::hz(10.0));
    let mut speeds = speeds.await.unwrap();
    let driver = operator.find(primitive_driver::URN).await.unwrap();
    let control = operator.control(driver, 127).await.unwrap();
    control.resume().await.unwrap();
    let hears = async {
        for _ in 0..10 {
            speeds.report().await.unwrap();
        }
    };
    let drives = async {
        for _ in 0..30 {
            control.send(&effort(40.0)).expect("control is kept");
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    };
    tokio::join!(hears, drives);
    control.standby().await.unwrap();
}
