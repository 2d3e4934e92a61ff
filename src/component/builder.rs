//! How a component comes to be.

use std::sync::Arc;

use tokio::sync::{mpsc, watch};

use super::Component;
use super::directories::{Directories, Membership};
use super::driver::{Driver, Publisher};
use super::handle::Shared;
use super::watch::Outlet;
use crate::address::JausId;
use crate::node::{self, Node, Port};
use crate::service::{
    AccessControl, Discovery, EventSettings, Kind, Liveness, Management, Patience, Profile, Scope,
    Service, Stack, Timing, Transport, UnsafeService,
};

/// A component that is not attached yet. Transport, Discovery, Liveness and Events are always
/// offered.
#[must_use = "a component exists once it is attached to a node"]
pub struct Builder {
    profile: Profile,
    scope: Scope,
    timing: Timing,
    patience: Patience,
    seed: Option<u64>,
    liveness: Liveness,
    guard: Guard,
    events: EventSettings,
    services: Vec<Box<dyn Service>>,
}

/// What stands between a client and a command.
enum Guard {
    None,
    AccessControl(AccessControl),
    Management(Management),
}

/// Why a component could not be attached.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AttachError {
    /// The node would not take it.
    #[error(transparent)]
    Node(#[from] node::AttachError),
    /// A service moves something, or is set up, and what makes that safe is missing.
    #[error(transparent)]
    Unsafe(#[from] UnsafeService),
    /// Report Identification has one octet for the length of a name.
    #[error("the name \"{name}\" has {length} octets, and at most 255 can be told to others")]
    NameTooLong {
        /// Its beginning.
        name: String,
        /// Its length in octets.
        length: usize,
    },
}

impl Builder {
    pub(super) fn new(kind: Kind, name: impl Into<String>) -> Self {
        Self {
            profile: Profile::new(kind, name),
            scope: Scope::default(),
            timing: Timing::default(),
            patience: Patience::default(),
            seed: None,
            liveness: Liveness::new(),
            guard: Guard::None,
            events: EventSettings::default(),
            services: Vec::new(),
        }
    }

    /// Offers a service.
    pub fn offer(mut self, service: impl Service + 'static) -> Self {
        self.services.push(Box::new(service));
        self
    }

    /// What clients may subscribe to at most.
    pub const fn event_settings(mut self, settings: EventSettings) -> Self {
        self.events = settings;
        self
    }

    /// Offers Access Control: only the client in control is obeyed. Replaces Management.
    pub const fn access_control(mut self, settings: AccessControl) -> Self {
        self.guard = Guard::AccessControl(settings);
        self
    }

    /// Offers Management, and Access Control with it: the component acts only while a client
    /// controls it and has made it ready.
    pub const fn management(mut self, settings: Management) -> Self {
        self.guard = Guard::Management(settings);
        self
    }

    /// Names the component itself; without this it has the subsystem's name.
    pub fn component_name(mut self, name: impl Into<String>) -> Self {
        self.profile.component = name.into();
        self
    }

    /// Names the node; without this it has the subsystem's name.
    pub fn node_name(mut self, name: impl Into<String>) -> Self {
        self.profile.node = name.into();
        self
    }

    /// Names the system that the subsystem belongs to; without this it has the subsystem's name.
    pub fn system_name(mut self, name: impl Into<String>) -> Self {
        self.profile.system = name.into();
        self
    }

    /// Whom to look for; everybody without this.
    pub const fn scope(mut self, scope: Scope) -> Self {
        self.scope = scope;
        self
    }

    /// How often discovery speaks, and when it gives a peer up.
    pub const fn timing(mut self, timing: Timing) -> Self {
        self.timing = timing;
        self
    }

    /// How long [`Component::query`] waits.
    pub const fn patience(mut self, patience: Patience) -> Self {
        self.patience = patience;
        self
    }

    /// A Liveness service other than the standard one, for instance with a heartbeat.
    pub fn liveness(mut self, liveness: Liveness) -> Self {
        self.liveness = liveness;
        self
    }

    /// Where the jitter of discovery's times comes from; the id without this.
    pub const fn seed(mut self, seed: u64) -> Self {
        self.seed = Some(seed);
        self
    }

    /// Brings the component to life on a node, under a number from 1 to 254.
    ///
    /// # Errors
    /// If the number or a name is unusable, the number is taken, or a service is
    /// [not safe](UnsafeService) by itself.
    ///
    /// # Panics
    /// Outside of a tokio runtime, which a running node has.
    pub fn attach(self, node: &Node, component: u8) -> Result<Component, AttachError> {
        self.check_names()?;
        self.live_on(node.attach(component)?)
    }

    /// Brings the component to life on a port that is there already, such as one to the node of
    /// this host, which another process runs ([`Host::attach`](node::Host::attach)).
    ///
    /// # Errors
    /// If a name is unusable, or a service is [not safe](UnsafeService) by itself.
    ///
    /// # Panics
    /// Outside of a tokio runtime, which a port has.
    pub fn live_on(self, port: Port) -> Result<Component, AttachError> {
        self.check_names()?;
        let id = port.id();
        let patience = self.patience;
        let seed = self.seed.unwrap_or_else(|| id.to_u32().into());
        let membership = Directories::join(&port, self.scope, self.timing, seed);
        let stack = self.stack(id, &membership);
        stack.check()?;
        let (commands, inbox) = mpsc::channel(Shared::COMMANDS);
        let (directory, directories) = watch::channel(());
        let (standing, standings) = watch::channel(*stack.standing());
        let changes = Arc::new(Outlet::new(Shared::CHANGES));
        let messages = Arc::new(Outlet::new(Shared::MESSAGES));
        let publisher = Publisher {
            directory,
            standing,
            changes: changes.clone(),
            messages: messages.clone(),
        };
        let shared = Shared {
            sender: port.sender(),
            commands,
            known: membership.directory(),
            directories,
            standings,
            changes,
            messages,
        };
        tokio::spawn(Driver::new(stack, membership, port, inbox, publisher, patience).run());
        Ok(Component::new(shared))
    }

    fn stack(mut self, id: JausId, membership: &Membership) -> Stack {
        let discovery = Discovery::join(membership.directory(), id, self.profile);
        let mut services: Vec<Box<dyn Service>> =
            vec![Box::new(Transport), Box::new(self.liveness)];
        services.append(&mut self.services);
        let stack = Stack::new(discovery, services).event_settings(self.events);
        match self.guard {
            Guard::None => stack,
            Guard::AccessControl(settings) => stack.access_control(settings),
            Guard::Management(settings) => stack.management(settings),
        }
    }

    fn check_names(&self) -> Result<(), AttachError> {
        let Profile {
            system,
            subsystem,
            node,
            component,
            ..
        } = &self.profile;
        for name in [system, subsystem, node, component] {
            if name.len() > usize::from(u8::MAX) {
                let beginning = name.chars().take(40).collect();
                return Err(AttachError::NameTooLong {
                    name: beginning,
                    length: name.len(),
                });
            }
        }
        Ok(())
    }
}
