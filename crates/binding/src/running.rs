//! The life of a component.
#![expect(clippy::disallowed_methods, reason = "an end has a time limit")]

use std::time::{Duration, Instant};

use jaus::component::{AttachError, Builder, Component, Service};
use jaus::endpoint::Received;
use jaus::node::{Host, HostError, Node, Port};
use jaus::service::{Context, Handled};
use tokio::sync::oneshot;

/// How long a component that ends may take to stop and to release what it controls.
pub const END: Duration = Duration::from_secs(2);

/// Where components run.
#[derive(Debug, Clone)]
pub enum Place {
    /// On a node of this process.
    Node(Node),
    /// On the node of this host, in another process.
    Host(Host),
}

impl Place {
    /// Attaches a component under this number. It may wait for the node of this host.
    ///
    /// # Errors
    /// If the node does not accept it.
    pub async fn attach(&self, number: u8) -> Result<Port, NotStarted> {
        Ok(match self {
            Self::Node(node) => node.attach(number).map_err(AttachError::from)?,
            Self::Host(host) => host.attach(number).await?,
        })
    }
}

/// Why a component was not started.
#[derive(Debug, thiserror::Error)]
pub enum NotStarted {
    /// The node of this host does not accept it.
    #[error(transparent)]
    Host(#[from] HostError),
    /// The component was not attached.
    #[error(transparent)]
    Attach(#[from] AttachError),
}

/// A component that runs.
#[derive(Debug)]
pub struct Running {
    component: Component,
    /// Ends when the component's services are gone.
    ended: oneshot::Receiver<()>,
}

impl Running {
    /// Starts a component under this number. On a runtime.
    ///
    /// # Errors
    /// If the node does not accept it, or a service lacks what makes it safe.
    pub async fn start(builder: Builder, place: &Place, number: u8) -> Result<Self, NotStarted> {
        Ok(Self::on(builder, place.attach(number).await?)?)
    }

    /// Starts a component that was [attached](Place::attach). On a runtime.
    ///
    /// # Errors
    /// If a name is invalid, or a service lacks what makes it safe.
    pub fn on(builder: Builder, port: Port) -> Result<Self, AttachError> {
        let (alive, ended) = oneshot::channel();
        let component = builder.offer(Ending { _alive: alive }).live_on(port)?;
        Ok(Self { component, ended })
    }

    /// The component.
    #[must_use]
    pub const fn component(&self) -> &Component {
        &self.component
    }

    /// Ends the component, and waits until it has stopped and has freed its number, but at most [`END`]. On
    /// a runtime.
    pub async fn end(self) {
        drop(self.component);
        let ended = self.ended;
        let gone = async {
            // An error means that it has ended.
            let _ = ended.await;
            // The task that owned the services still frees the component's number. One that is started now
            // on its thread runs after that.
            let _ = tokio::spawn(async {}).await;
        };
        // If it takes too long, it ends later.
        let _ = tokio::time::timeout(END, gone).await;
    }
}

/// Shows when the services of a component are gone. It offers nothing.
struct Ending {
    _alive: oneshot::Sender<()>,
}

impl Service for Ending {
    fn offers(&self) -> Vec<jaus::codec::ServiceId> {
        Vec::new()
    }

    fn handle_message(&mut self, _: Instant, _: &Received, _: &mut Context<'_>) -> Handled {
        Handled::No
    }
}
