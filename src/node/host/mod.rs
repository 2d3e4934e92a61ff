//! The component's side of the [local link](crate::link::local): a component that lives on the node
//! of this host, which another process runs.
//!
//! ```no_run
//! use jaus::component::{Component, Kind};
//! use jaus::node::Host;
//!
//! # #[tokio::main(flavor = "current_thread")]
//! # async fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let port = Host::default().attach(33).await?;
//! let rover = Component::builder(Kind::Vehicle, "Rover").live_on(port)?;
//! # Ok(())
//! # }
//! ```
//!
//! A port to a host's node is used like one to a node of one's own. It outlives the node: when that
//! ends or crashes, the component goes on, with all that it knows; what it sends meanwhile is an
//! error, and as soon as a node is back it has its id there again.
#![expect(
    clippy::disallowed_methods,
    reason = "here the line to the node gets its task and its patience"
)]

mod line;
mod task;

use std::time::Duration;

pub(super) use self::line::Line;
pub use self::line::{HostEvent, HostEvents};
use self::task::Task;
use super::mailbox::MailboxLimits;
use super::{HostError, Port};
use crate::address::JausId;
use crate::link::local::record::{Hello, LONGEST, Refusal, Reply, Request, VERSION, Want, Welcome};
use crate::link::local::{Address, Connection, Error, Outbox, WriteHalf, connect};

/// How long a node may take to answer a greeting.
const GREETING: Duration = Duration::from_secs(5);

/// The node of this host, as a component of another process reaches it.
#[derive(Clone, Debug, Default)]
pub struct Host {
    address: Address,
    name: Option<String>,
    limits: MailboxLimits,
}

/// A connection on which the node has taken the component in.
#[derive(Debug)]
struct Attached {
    welcome: Welcome,
    connection: Connection,
    write: WriteHalf,
    /// What the node said with its welcome.
    early: Vec<Reply>,
}

impl Host {
    /// The node that serves components there; [`Host::default`] is at the usual place.
    #[must_use]
    pub fn at(address: Address) -> Self {
        Self {
            address,
            ..Self::default()
        }
    }

    /// What the component's process calls itself; without this, by its program's name.
    #[must_use]
    pub fn name(mut self, name: impl Into<String>) -> Self {
        self.name = Some(name.into());
        self
    }

    /// How much may wait in this process until the component reads it.
    #[must_use]
    pub const fn mailbox(mut self, limits: MailboxLimits) -> Self {
        self.limits = limits;
        self
    }

    /// Attaches a component, by its number within the node, 1 to 254. Its full id is the
    /// [port's](Port::id).
    ///
    /// # Errors
    /// [`HostError`] says why the node cannot be reached, or does not want the component.
    pub async fn attach(&self, component: u8) -> Result<Port, HostError> {
        self.attach_wanted(Want::Component(component)).await
    }

    /// Attaches a component by its full id, which must be one of the node's.
    ///
    /// # Errors
    /// Those of [`attach`](Self::attach).
    pub async fn attach_as(&self, id: JausId) -> Result<Port, HostError> {
        self.attach_wanted(Want::Id(id)).await
    }

    async fn attach_wanted(&self, want: Want) -> Result<Port, HostError> {
        let attached = self.greet(want).await?;
        let task = Task::new(self.clone(), attached);
        let line = task.line();
        tokio::spawn(task.run());
        Ok(Port::to_host(line))
    }

    async fn greet(&self, want: Want) -> Result<Attached, HostError> {
        let (read, mut write) = connect(&self.address).await?;
        let mut connection = Connection::new(read, LONGEST);
        let mut outbox = Outbox::default();
        outbox.request(&Request::Hello(Hello {
            version: VERSION,
            want,
            name: self.own_name(),
        }));
        let mut early = Vec::new();
        let greeting = async {
            let said = std::future::poll_fn(|cx| outbox.poll_flush(&mut write, cx));
            said.await.map_err(Error::io("greeting the node"))?;
            while early.is_empty() {
                let read = std::future::poll_fn(|cx| {
                    connection.poll_read(cx, |body| {
                        early.push(Reply::decode(&body)?);
                        Ok(())
                    })
                });
                read.await?;
            }
            Ok::<_, Error>(())
        };
        match tokio::time::timeout(GREETING, greeting).await {
            Ok(result) => result?,
            Err(_) => {
                let place = self.address.to_string();
                return Err(Error::Mute { place }.into());
            }
        }
        match early.remove(0) {
            Reply::Welcome(welcome) => Ok(Attached {
                welcome,
                connection,
                write,
                early,
            }),
            Reply::Refused(Refusal { reason, words }) => Err(HostError::Refused { reason, words }),
            _ => Err(Error::from(crate::link::local::record::RecordError::Stranger).into()),
        }
    }

    async fn greet_again(&self, id: JausId) -> Result<Attached, HostError> {
        self.greet(Want::Id(id)).await
    }

    fn own_name(&self) -> String {
        let program = || {
            let path = std::env::args_os().next()?;
            let name = std::path::Path::new(&path).file_name()?;
            Some(name.to_string_lossy().into_owned())
        };
        self.name.clone().or_else(program).unwrap_or_default()
    }
}
