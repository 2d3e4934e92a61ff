//! Readiness as reported to an RA component and to JAUS clients.
//!
//! OpenJAUS's primitive driver moves only while its controller reports ready or standby, and opens
//! a service connection for that as long as it considers the gateway its controller. The gateway is
//! therefore ready for a component only while a JAUS client has control; a component that requests
//! the status without a client in control is still controlled under the gateway's id and is
//! released again.

use std::time::{Duration, Instant};

use bytes::Bytes;

use super::Proxy;
use super::codes::STATUS;
use crate::RaId;
use crate::connection::ConnectionId;
use crate::ids::RaComponent;
use crate::message::Message;
use crate::messages::ra33::ReportComponentControl;

/// The service connection that reports the gateway's readiness to the RA component.
#[derive(Debug, Default)]
pub(super) struct Readiness {
    connection: Option<ConnectionId>,
    /// Last reported readiness.
    reported: Option<bool>,
    /// Whether JAUS clients were notified that the component is not available.
    was_reclaiming: bool,
    /// When to release the component again, if the connection remains without a client in control.
    release: Option<Instant>,
    /// Number of such releases since the connection was made.
    releases: u32,
}

impl Readiness {
    /// A connection that remains this long without a client in control shows that the release was
    /// lost.
    const GHOST: Duration = Duration::from_secs(3);
    /// Limit of releases, for components that keep the connection for their own reasons.
    const MOST_RELEASES: u32 = 10;

    /// Handles a connection of the RA component.
    pub(super) fn connect(&mut self, now: Instant, connection: ConnectionId) {
        self.connection = Some(connection);
        self.reported = None;
        self.release = Some(now + Self::GHOST);
    }

    /// Handles the end of a connection, possibly this one.
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
    /// The gateway status reported to the RA component.
    pub(super) fn own_status(&self) -> Bytes {
        status(self.lease.controller().is_some())
    }

    /// Reports readiness to the RA component, and availability of the component to JAUS clients.
    pub(super) fn report_readiness(&mut self, now: Instant) {
        let reclaiming = self.lease.is_reclaiming();
        if std::mem::replace(&mut self.readiness.was_reclaiming, reclaiming) && !reclaiming {
            self.mirror.outdate(STATUS);
            self.ask(STATUS);
        }
        let is_ready = self.lease.controller().is_some();
        let Some(connection) = self.readiness.connection else {
            return;
        };
        if self.readiness.reported.replace(is_ready) != Some(is_ready) {
            self.connections
                .set_report(now, connection, status(is_ready));
            self.readiness.release = (!is_ready).then(|| now + Readiness::GHOST);
        }
    }

    /// Releases a driver that still requests the gateway's status although no client has control of
    /// it.
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
            tracing::warn!(%component, "still considers the gateway in control: released again");
        }
        *releases += 1;
        *release = Some(now + Readiness::GHOST);
        self.lease.release_again(now);
    }
}

/// Report Component Status without secondary status: ready, or initializing.
pub(in crate::gateway) const fn status(is_ready: bool) -> Bytes {
    const READY: &[u8] = &[1, 0, 0, 0, 0];
    const INITIALIZE: &[u8] = &[0, 0, 0, 0, 0];
    Bytes::from_static(if is_ready { READY } else { INITIALIZE })
}

/// Controller of the sender of a Report Component Control.
pub(super) fn controller(message: &Message) -> Option<RaId> {
    let report: ReportComponentControl = message.body().ok()?;
    Some(RaId {
        subsystem: report.subsystem_id,
        node: report.node_id,
        component: report.component_id,
        instance: report.instance_id,
    })
}
