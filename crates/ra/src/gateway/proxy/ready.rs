//! What an RA component and JAUS clients are told of readiness.
//!
//! OpenJAUS's primitive driver drives only while its controller reports that it is ready or in standby,
//! and asks for that by a service connection as long as it takes the gateway for its controller. So
//! the gateway is ready for a component only while a JAUS client has control of it; and a component
//! that wants the status when none has is still held in the gateway's id and is released again.

use std::time::{Duration, Instant};

use bytes::Bytes;

use super::Proxy;
use super::codes::STATUS;
use crate::connection::ConnectionId;
use crate::ids::RaComponent;
use crate::messages::ra33::ReportComponentControl;
use crate::{Message, RaId};

/// The service connection by which the RA component is told whether the gateway is ready.
#[derive(Debug, Default)]
pub(super) struct Readiness {
    connection: Option<ConnectionId>,
    /// What it was told last.
    told: Option<bool>,
    /// Whether JAUS clients were told that the component is not available.
    was_reclaiming: bool,
    /// When the component is released again if the connection is still there and no client has control.
    release: Option<Instant>,
    /// How often that has happened since the connection was made.
    releases: u32,
}

impl Readiness {
    /// A connection that is there for so long without a client in control shows that the release was
    /// lost.
    const GHOST: Duration = Duration::from_secs(3);
    /// A component that keeps the connection for reasons of its own is released no more often.
    const MOST_RELEASES: u32 = 10;

    /// The RA component has connected.
    pub(super) fn connect(&mut self, now: Instant, connection: ConnectionId) {
        self.connection = Some(connection);
        self.told = None;
        self.release = Some(now + Self::GHOST);
    }

    /// A connection has ended, perhaps this one.
    pub(super) fn disconnect(&mut self, connection: ConnectionId) {
        if self.connection == Some(connection) {
            *self = Self {
                was_reclaiming: self.was_reclaiming,
                ..Self::default()
            };
        }
    }

    pub(super) const fn poll_timeout(&self) -> Option<Instant> {
        self.release
    }
}

impl Proxy {
    /// What the RA component is told of the gateway's state.
    pub(super) fn own_status(&self) -> Bytes {
        status(self.lease.controller().is_some())
    }

    /// Tells the RA component whether the gateway is ready, and JAUS clients when the component has
    /// become available.
    pub(super) fn tell_readiness(&mut self, now: Instant) {
        let reclaiming = self.lease.is_reclaiming();
        if std::mem::replace(&mut self.readiness.was_reclaiming, reclaiming) && !reclaiming {
            self.mirror.outdate(STATUS);
            self.ask(STATUS);
        }
        let is_ready = self.lease.controller().is_some();
        let Some(connection) = self.readiness.connection else {
            return;
        };
        if self.readiness.told.replace(is_ready) != Some(is_ready) {
            self.connections
                .set_report(now, connection, status(is_ready));
            self.readiness.release = (!is_ready).then(|| now + Readiness::GHOST);
        }
    }

    /// Releases a driver that still wants to know whether the gateway is ready though no client has
    /// control of it.
    pub(super) fn release_again(&mut self, now: Instant) {
        let Readiness {
            release, releases, ..
        } = &mut self.readiness;
        if release.is_none_or(|due| due > now) {
            return;
        }
        *release = None;
        let is_driver = RaComponent(self.ra.component).is_driver();
        if !is_driver || self.lease.is_engaged() || *releases >= Readiness::MOST_RELEASES {
            return;
        }
        if *releases == 0 {
            let component = self.ra;
            tracing::warn!(%component, "still takes the gateway for its controller: released again");
        }
        *releases += 1;
        *release = Some(now + Readiness::GHOST);
        self.lease.release_again(now);
    }
}

/// Report Component Status without further words: ready, or initializing.
pub(in crate::gateway) const fn status(is_ready: bool) -> Bytes {
    const READY: &[u8] = &[1, 0, 0, 0, 0];
    const INITIALIZE: &[u8] = &[0, 0, 0, 0, 0];
    Bytes::from_static(if is_ready { READY } else { INITIALIZE })
}

/// Who controls the sender of a Report Component Control.
pub(super) fn controller(message: &Message) -> Option<RaId> {
    let report: ReportComponentControl = message.body().ok()?;
    Some(RaId {
        subsystem: report.subsystem_id,
        node: report.node_id,
        component: report.component_id,
        instance: report.instance_id,
    })
}
