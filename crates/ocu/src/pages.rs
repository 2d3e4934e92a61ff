//! The pages of the station, each with the vehicle that it shows.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use tokio::sync::watch;

use super::orders::{OpenedPage, ReplacedPage, Snapshot};
use super::ownership::{Owner, PageId};
use super::token::Token;

/// All pages that are connected.
#[derive(Default)]
pub(crate) struct Pages {
    open: BTreeMap<PageId, Page>,
}

struct Page {
    operator: Owner,
    secret: Option<Token>,
    vehicle: Option<u16>,
    states: watch::Sender<Snapshot>,
}

impl Pages {
    pub(crate) fn open(&mut self, opened: OpenedPage) {
        let OpenedPage {
            operator,
            vehicle,
            secret,
            states,
            ..
        } = opened;
        let page = Page {
            operator,
            secret,
            vehicle,
            states,
        };
        self.open.insert(page.operator.page, page);
    }

    pub(crate) fn close(&mut self, page: PageId) {
        self.open.remove(&page);
    }

    /// The operator at a page; `None` if the page is gone.
    pub(crate) fn operator(&self, page: PageId) -> Option<&Owner> {
        Some(&self.open.get(&page)?.operator)
    }

    /// Whether a page that replaces this one has shown its secret.
    pub(crate) fn is_replaced(&self, replaced: &ReplacedPage) -> bool {
        let page = self.open.get(&replaced.page);
        let secret = page.and_then(|page| page.secret.as_ref());
        secret.is_some_and(|secret| secret.is(&replaced.secret))
    }

    /// The vehicle that a page shows.
    pub(crate) fn vehicle(&self, page: PageId) -> Option<u16> {
        self.open.get(&page)?.vehicle
    }

    /// Makes a page show a vehicle.
    pub(crate) fn select(&mut self, page: PageId, vehicle: u16) {
        if let Some(page) = self.open.get_mut(&page) {
            page.vehicle = Some(vehicle);
        }
    }

    /// Gives a vehicle to the pages that show none, or one that this station does not know and never
    /// will.
    pub(crate) fn select_first(&mut self, first: Option<u16>, may_come: impl Fn(u16) -> bool) {
        let waits = |page: &&mut Page| !page.vehicle.is_some_and(&may_come);
        for page in self.open.values_mut().filter(waits) {
            page.vehicle = first;
        }
    }

    /// Whether another page than this one shows a vehicle.
    pub(crate) fn others_show(&self, page: PageId, vehicle: u16) -> bool {
        let mut others = self.open.iter().filter(|(id, _)| **id != page);
        others.any(|(_, it)| it.vehicle == Some(vehicle))
    }

    /// The vehicles that pages show.
    pub(crate) fn shown(&self) -> BTreeSet<u16> {
        self.open.values().filter_map(|page| page.vehicle).collect()
    }

    /// Sends each page the snapshot of its vehicle, which is made once for all pages that show it.
    pub(crate) fn publish(&self, snapshot: impl Fn(Option<u16>) -> Snapshot) {
        let mut made: BTreeMap<Option<u16>, Arc<Snapshot>> = BTreeMap::new();
        for page in self.open.values() {
            let known = made.entry(page.vehicle);
            let known = known.or_insert_with(|| Arc::new(snapshot(page.vehicle)));
            page.states.send_replace(Snapshot::clone(known));
        }
    }
}
