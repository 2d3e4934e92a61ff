//! Nodes: settings, start, events, end.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use jaus::link::Interfaces;
use jaus::node::{Address, Config, Host, Node as Runs};
use jaus_binding::{END, NodeThread, Place, lock};
use pyo3::prelude::*;

use super::event::{Answer, Event};
use super::failure::Failure;
use super::program::{Program, Shared};

/// A node, or the connection to the node of this host. The Python class `jaus.Node` uses it.
#[pyclass(frozen, module = "jaus._jaus")]
pub(crate) struct Node(Mutex<Stage>);

enum Stage {
    Settings(Box<Settings>),
    Runs(Arc<Program>),
    Ended,
}

#[derive(Clone)]
enum Settings {
    Own(Box<Config>),
    Host(Address),
}

fn parse<T: std::str::FromStr<Err: std::fmt::Display>>(text: &str) -> Result<T, Failure> {
    text.parse()
        .map_err(|error: T::Err| Failure::argument(error.to_string()))
}

/// The two numbers of a node's id, such as `107.1`.
fn numbers(id: &str) -> Result<(u16, u8), Failure> {
    let numbers = id.split_once('.').and_then(|(subsystem, node)| {
        let numbers = (subsystem.parse().ok()?, node.parse().ok()?);
        Some(numbers)
    });
    numbers.ok_or_else(|| {
        Failure::argument(format!(
            "{id:?} is not the id of a node: give subsystem and node, such as \"107.1\""
        ))
    })
}

#[pymethods]
impl Node {
    #[new]
    #[pyo3(signature = (id, host, *, loopback, interfaces, port, group, peers, local))]
    #[expect(clippy::too_many_arguments, reason = "named arguments of Python")]
    fn new(
        id: Option<&str>,
        host: Option<&str>,
        loopback: bool,
        interfaces: Option<Vec<String>>,
        port: Option<u16>,
        group: Option<&str>,
        peers: Vec<String>,
        local: Option<&str>,
    ) -> Result<Self, Failure> {
        let settings = match (id, host) {
            (None, Some(host)) => Settings::Host(parse(host)?),
            (Some(id), None) => {
                let (subsystem, node) = numbers(id)?;
                let mut config = match loopback {
                    true => Config::loopback(subsystem, node),
                    false => Config::new(subsystem, node),
                };
                if let Some(names) = interfaces {
                    config.interfaces = Interfaces::Only(names);
                }
                if let Some(port) = port {
                    config = config.port(port);
                }
                if let Some(group) = group {
                    config = config.group(parse(group)?);
                }
                for peer in peers {
                    config = config.peer(parse(&peer)?);
                }
                if let Some(address) = local {
                    config = config.local(parse(address)?);
                }
                let valid = config.validate();
                valid.map_err(|error| Failure::of("ArgumentError", &error))?;
                Settings::Own(Box::new(config))
            }
            _ => {
                return Err(Failure::argument(
                    "give either an id, such as \"107.1\", for a node of this process, or host, such \
                     as \"default\", for the node of this host",
                ));
            }
        };
        Ok(Self(Mutex::new(Stage::Settings(Box::new(settings)))))
    }

    /// Opens the links of the node.
    fn start(&self, py: Python<'_>) -> PyResult<()> {
        let mut stage = lock(&self.0);
        let Stage::Settings(settings) = &*stage else {
            let text = "a node is started once: create a new one";
            return Err(Failure::new("StateError", text).into());
        };
        let settings = settings.clone();
        let program = py.detach(|| start(*settings))?;
        *stage = Stage::Runs(Arc::new(program));
        Ok(())
    }

    /// The descriptor that is readable while events wait.
    fn descriptor(&self) -> Result<i32, Failure> {
        Ok(self.program()?.shared.queue.descriptor())
    }

    /// The next event, as `(kind, subject, values)`, or `None`.
    fn fetch(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        let next = self.program()?.shared.queue.next(Some(Duration::ZERO));
        let next = next.ok().flatten();
        next.map(|event| event.into_python(py)).transpose()
    }

    /// How many events were dropped because the event loop was slow.
    fn dropped(&self) -> Result<u64, Failure> {
        Ok(self.program()?.shared.queue.dropped())
    }

    /// Ends a request, a subscription or a control without waiting, if it has not ended.
    fn end(&self, number: u64) {
        if let Ok(program) = self.program()
            && let Some(begun) = program.shared.take(number)
        {
            let _on_runtime = program.thread.handle().enter();
            begun.abort();
        }
    }

    /// Closes the links of the node: a request.
    fn shutdown(&self) -> Result<u64, Failure> {
        let program = self.program()?;
        let place = program.place.clone();
        program.begin(async move |_, _| {
            if let Place::Node(node) = place {
                node.shutdown().await;
            }
            Ok(Answer::Nothing)
        })
    }

    /// Waits for the end of a request without an event loop, at most as long as a component may take to
    /// end. Other events are dropped.
    fn wait(&self, py: Python<'_>, number: u64) -> Result<(), Failure> {
        let program = self.program()?;
        py.detach(|| {
            while let Ok(Some(event)) = program.shared.queue.next(Some(2 * END)) {
                if matches!(event, Event::Done { request, .. } if request == number) {
                    break;
                }
            }
        });
        Ok(())
    }

    /// Ends the threads of the node. Without effect on a node that does not run.
    fn finish(&self, py: Python<'_>) {
        let stage = std::mem::replace(&mut *lock(&self.0), Stage::Ended);
        if let Stage::Runs(program) = stage {
            program.shared.stopper.end();
            py.detach(|| {
                if let Some(thread) = program.thread.end() {
                    // An error means that it has panicked, which is its end, too.
                    let _ = thread.join();
                }
            });
        }
    }
}

impl Node {
    pub(crate) fn program(&self) -> Result<Arc<Program>, Failure> {
        match &*lock(&self.0) {
            Stage::Runs(program) if program.thread.is_of_other_process() => {
                Err(Failure::forked("node"))
            }
            Stage::Runs(program) => Ok(program.clone()),
            Stage::Settings(_) => {
                let text = "the node does not run: use `async with`, or await its start()";
                Err(Failure::new("StateError", text))
            }
            Stage::Ended => Err(Failure::closed("node")),
        }
    }
}

fn start(settings: Settings) -> Result<Program, Failure> {
    let failed = |error: std::io::Error| Failure::of("StartError", &error);
    let thread = NodeThread::start().map_err(failed)?;
    let shared = Arc::new(Shared::new().map_err(failed)?);
    shared.stopper.start().map_err(failed)?;
    let place = match settings {
        Settings::Host(address) => Ok(Place::Host(Host::at(address))),
        Settings::Own(config) => {
            let started = thread.handle().block_on(async { Runs::start(*config) });
            started.map(Place::Node)
        }
    };
    let place = place.map_err(|error| {
        shared.stopper.end();
        Failure::of("StartError", &error)
    })?;
    Ok(Program {
        thread,
        place,
        shared,
    })
}
