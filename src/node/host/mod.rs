//! The component's side of the [local link](crate::link::local): attaches a component to the node
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
//! A port to a host's node is used like one to a node of the same process. It outlives the node: if
//! the node ends or crashes, the component continues and keeps its state. Until a node is back,
//! sending returns an error; then the component attaches again with its id.
#![expect(
    clippy::disallowed_methods,
    reason = "the connection to the node has a task and timeouts"
)]

mod client;

use std::time::Duration;

pub(super) use self::client::Client;
use super::events::EventStream;
use super::mailbox::MailboxLimits;
use super::{HostError, Port};
use crate::address::JausId;
use crate::endpoint::MessageHandle;
use crate::link::local::record::{Head, LONGEST_HEAD, LONGEST_MESSAGE, Record, RecordError};
use crate::link::local::{Address, Error, Reader, Writer, connect};

/// How long a node may take to answer a component's first record.
const HANDSHAKE: Duration = Duration::from_secs(5);

/// The node of this host, for a component of another process.
///
/// ```no_run
/// # use jaus::node::{Address, Host, HostError, MailboxLimits};
/// # async fn example() -> Result<(), HostError> {
/// let host = Host::at(Address::Path("/run/jaus/node.sock".into()))
///     .name("wheels")
///     .mailbox(MailboxLimits { messages: 64, octets: 1 << 16 });
/// let port = host.attach(33).await?;
/// println!("attached as {}", port.id());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default)]
pub struct Host {
    address: Address,
    name: Option<String>,
    limits: MailboxLimits,
}

/// An event of a component's connection to its host's node.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum HostEvent {
    /// The node is gone. The component tries to reach it or its successor.
    Lost {
        /// The reason, as far as known.
        why: String,
    },
    /// A node refuses the component, for instance because another component has taken its id. The
    /// component keeps trying.
    Refused {
        /// The node's reason.
        why: String,
    },
    /// The component is attached again.
    Back,
    /// The node rejected a message that the component had sent without waiting for delivery.
    Rejected {
        /// The message.
        message: MessageHandle,
        /// The node's reason.
        why: String,
    },
}

/// A stream of [`HostEvent`]s, until the component is detached.
pub type HostEvents = EventStream<HostEvent>;

/// A connection on which the node has attached the component.
#[derive(Debug)]
struct Attached {
    id: JausId,
    max_message: usize,
    reader: Reader,
    writer: Writer,
}

impl Host {
    /// The node that serves components at this address; [`Host::default`] uses the default address.
    #[must_use]
    pub fn at(address: Address) -> Self {
        Self {
            address,
            ..Self::default()
        }
    }

    /// The name of the component's process, for people. The default is the program's name.
    #[must_use]
    pub fn name(mut self, name: impl Into<String>) -> Self {
        self.name = Some(name.into());
        self
    }

    /// The limits of the mailbox in this process.
    #[must_use]
    pub const fn mailbox(mut self, limits: MailboxLimits) -> Self {
        self.limits = limits;
        self
    }

    /// Attaches a component, by its number within the node, 1 to 254. The [port](Port::id) has its
    /// full id.
    ///
    /// # Errors
    /// [`HostError`] gives the reason why the node cannot be reached or refuses the component.
    pub async fn attach(&self, component: u8) -> Result<Port, HostError> {
        self.attach_as(JausId::new(0, 0, component)).await
    }

    /// Attaches a component by its full id, which must belong to the node.
    ///
    /// # Errors
    /// Those of [`attach`](Self::attach).
    pub async fn attach_as(&self, id: JausId) -> Result<Port, HostError> {
        Ok(Port::to_host(Client::start(
            self.clone(),
            self.shake_hands(id).await?,
        )))
    }

    async fn shake_hands(&self, id: JausId) -> Result<Attached, HostError> {
        let stream = connect(&self.address).await?;
        let mut reader = Reader::new(stream.read, LONGEST_MESSAGE + LONGEST_HEAD);
        let mut writer = Writer::new(stream.write);
        writer.queue(&Record::with_text(Head::hello(id), &self.own_name()));
        let answer = async {
            writer.flush().await?;
            reader.read().await
        };
        let answer = tokio::time::timeout(HANDSHAKE, answer).await;
        let answer = answer.map_err(|_| Error::Mute(self.address.to_string()))??;
        match answer.head {
            Head::Welcome { id, max_message } => Ok(Attached {
                id,
                max_message: max_message as usize,
                reader,
                writer,
            }),
            Head::Refused(reason) => Err(HostError::Refused {
                reason,
                words: answer.text(),
            }),
            _ => Err(Error::Record(RecordError::Unexpected).into()),
        }
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
