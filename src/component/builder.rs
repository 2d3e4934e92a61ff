//! The builder of a component: settings, services, and attachment to a node.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, AtomicU64};

use tokio::sync::{mpsc, watch};

use super::Component;
use super::directories::{Directories, Membership};
use super::driver::{Driver, Publisher};
use super::handle::Shared;
use super::latest::LatestSender;
use super::watch::Outlet;
use crate::address::JausId;
use crate::node::{self, Node, Port};
use crate::service::{
    AccessControl, Discovery, EventSettings, Kind, Liveness, Management, Patience, Profile, Scope,
    Service, Stack, Timing, Transport, UnsafeService,
};

/// A component that is not attached yet. It always offers Transport, Discovery, Liveness and
/// Events.
///
/// ```no_run
/// # use jaus::component::{Component, Handlers, Kind, Management};
/// # fn example(node: &jaus::node::Node, driver: Handlers) -> Result<(), jaus::component::AttachError> {
/// let driver = Component::builder(Kind::Vehicle, "Rover")
///     .component_name("Wheels")
///     .management(Management::default())
///     .offer(driver)
///     .attach(node, 33)?;
/// # Ok(())
/// # }
/// ```
#[must_use = "attach the component to a node"]
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

/// What protects commands from unauthorised clients.
enum Guard {
    None,
    AccessControl(AccessControl),
    Management(Management),
}

/// Why a component could not be attached.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AttachError {
    /// The node rejected it.
    #[error(transparent)]
    Node(#[from] node::AttachError),
    /// A service moves something or can be configured, and the component lacks what makes that
    /// safe.
    #[error(transparent)]
    Unsafe(#[from] UnsafeService),
    /// Report Identification has one octet for the length of a name.
    #[error("the name \"{name}\" has {length} octets: use at most 255")]
    NameTooLong {
        /// The beginning of the name.
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

    /// Sets the limits of events for clients.
    pub const fn event_settings(mut self, settings: EventSettings) -> Self {
        self.events = settings;
        self
    }

    /// Offers Access Control: only the client in control may command. Replaces Management.
    pub const fn access_control(mut self, settings: AccessControl) -> Self {
        self.guard = Guard::AccessControl(settings);
        self
    }

    /// Offers Management, which includes Access Control: the component acts only while a client
    /// controls it and has made it ready.
    pub const fn management(mut self, settings: Management) -> Self {
        self.guard = Guard::Management(settings);
        self
    }

    /// Names the component itself. The default is the subsystem's name.
    pub fn component_name(mut self, name: impl Into<String>) -> Self {
        self.profile.component = name.into();
        self
    }

    /// Names the node. The default is the subsystem's name.
    pub fn node_name(mut self, name: impl Into<String>) -> Self {
        self.profile.node = name.into();
        self
    }

    /// Names the system that the subsystem belongs to. The default is the subsystem's name.
    pub fn system_name(mut self, name: impl Into<String>) -> Self {
        self.profile.system = name.into();
        self
    }

    /// Sets which components discovery searches for. The default is all.
    pub const fn scope(mut self, scope: Scope) -> Self {
        self.scope = scope;
        self
    }

    /// Sets the pace and the timeouts of discovery.
    pub const fn timing(mut self, timing: Timing) -> Self {
        self.timing = timing;
        self
    }

    /// Sets the timeout and the number of tries of [`Component::query`].
    pub const fn patience(mut self, patience: Patience) -> Self {
        self.patience = patience;
        self
    }

    /// Replaces the standard Liveness service, for instance by one with a heartbeat.
    pub fn liveness(mut self, liveness: Liveness) -> Self {
        self.liveness = liveness;
        self
    }

    /// Sets the seed of discovery's jitter. The default is the id.
    pub const fn seed(mut self, seed: u64) -> Self {
        self.seed = Some(seed);
        self
    }

    /// Starts the component on a node, under a number from 1 to 254.
    ///
    /// # Errors
    /// If the number or a name is invalid, the number is in use, or the component lacks what a
    /// service needs to be [safe](UnsafeService).
    ///
    /// # Panics
    /// Outside of a tokio runtime, which a running node has.
    pub fn attach(self, node: &Node, component: u8) -> Result<Component, AttachError> {
        self.check_names()?;
        self.live_on(node.attach(component)?)
    }

    /// Starts the component on an existing port, for instance to the node of this host that another
    /// process runs ([`Host::attach`](node::Host::attach)).
    ///
    /// # Errors
    /// If a name is invalid, or the component lacks what a service needs to be
    /// [safe](UnsafeService).
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
        let (stop, stopped) = watch::channel(None);
        let refused_setpoints = Arc::new(AtomicU64::new(0));
        let changes = Arc::new(Outlet::new(Shared::CHANGES));
        let messages = Arc::new(Outlet::new(Shared::MESSAGES));
        let publisher = Publisher {
            directory,
            standing,
            stop,
            refused_setpoints: refused_setpoints.clone(),
            changes: changes.clone(),
            messages: messages.clone(),
        };
        let latest = LatestSender::new(port.sender());
        let shared = Shared {
            sender: latest.clone(),
            commands,
            known: membership.directory(),
            directories,
            standings,
            stopped,
            refused_setpoints,
            changes,
            messages,
            requests: AtomicU8::new(0),
        };
        tokio::spawn(
            Driver::new(
                stack,
                membership,
                (port, latest),
                inbox,
                publisher,
                patience,
            )
            .run(),
        );
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
