//! The component's side of the [local link](crate::link::local): a component on the node of this
//! host, which another process runs.
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
//! A port to a host's node is used like one to a node of the same process. It outlives the node: when
//! that ends or crashes, the component goes on, with all that it knows; sending is an error
//! meanwhile, and as soon as a node is back it has its id there again.
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

/// The node of this host, as a component of another process reaches it.
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
    /// The node is gone. The component tries to reach it again, or its successor.
    Lost {
        /// As far as is known.
        why: String,
    },
    /// A node is there and refuses the component, for instance because another one has taken its
    /// id. The component goes on trying.
    Refused {
        /// In the node's words.
        why: String,
    },
    /// The component is attached again.
    Back,
    /// The node did not send a message that the component had sent without waiting for delivery.
    Rejected {
        /// The message.
        message: MessageHandle,
        /// In the node's words.
        why: String,
    },
}

/// A listener to [`HostEvent`]s, until the component is detached.
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
    /// The node that serves components there; [`Host::default`] is at the usual place.
    #[must_use]
    pub fn at(address: Address) -> Self {
        Self {
            address,
            ..Self::default()
        }
    }

    /// The name of the component's process, for people; the default is the program's.
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
    /// [`HostError`] says why the node cannot be reached, or refuses the component.
    pub async fn attach(&self, component: u8) -> Result<Port, HostError> {
        self.attach_as(JausId::new(0, 0, component)).await
    }

    /// Attaches a component by its full id, which must be one of the node's.
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
        writer.queue(&Record::hello(id, &self.own_name()));
        let answer = async {
            writer.flush().await?;
            reader.read().await
        };
        let answer = tokio::time::timeout(HANDSHAKE, answer).await;
        let answer = answer.map_err(|_| Error::Mute {
            place: self.address.to_string(),
        })??;
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
