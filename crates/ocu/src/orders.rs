//! What passes between the pages' connections and the session: orders of the pages, and snapshots
//! for them.

use std::sync::Arc;
use std::time::{Duration, Instant};

use bytes::Bytes;
use serde::Serialize;
use serde_json::{Map, Value};
use tokio::sync::{mpsc, oneshot, watch};

use super::answer::Said;
use super::ownership::{Owner, PageId};
use super::page_link::TooOld;
use super::press::{KnownStops, Press};
use super::request::OperatorRequest;
use super::state::{Events, Overlay, State};
use super::token::Token;
use super::vehicle_link::VehicleLinkQuality;

/// Callback for the result of a request: success, or the reason for failure.
pub(super) type Reply = Box<dyn FnOnce(Result<(), String>) + Send>;

/// Callback for the cells of a map, or the reason why there are none.
pub(super) type CellsReply = Box<dyn FnOnce(Result<Bytes, String>) + Send>;

/// A message from a page to the session.
pub(super) enum Order {
    Opened(OpenedPage),
    OperatorRequest {
        page: PageId,
        /// The vehicle that the page means; `None` for the one that it has selected.
        vehicle: Option<u16>,
        request: OperatorRequest,
        /// With the clearing of a stop: the stops that the operator knows of, if the page says so.
        known: Option<KnownStops>,
        /// Whether the page's user may change vehicles, and not only observe them.
        may_drive: bool,
        reply: Reply,
    },
    Drive(DriveOrder),
    /// Request for the cells of a map of a vehicle.
    Cells {
        vehicle: u16,
        map: u16,
        reply: CellsReply,
    },
    /// Request for what lies over the map of a vehicle, by a page that has the zones of a revision.
    Overlay {
        vehicle: u16,
        zones: u32,
        reply: oneshot::Sender<Option<Overlay>>,
    },
    /// Request for the events after the one with a number.
    Events {
        after: u64,
        reply: oneshot::Sender<Events>,
    },
    /// A page is gone, and with it its operator.
    Gone(PageId),
}

/// A page that has connected.
pub(super) struct OpenedPage {
    pub(super) operator: Owner,
    /// The vehicle that the page wants to show.
    pub(super) vehicle: Option<u16>,
    /// What the station tells this page alone, so that no other page can replace it.
    pub(super) secret: Option<Token>,
    pub(super) replaces: Option<ReplacedPage>,
    pub(super) states: watch::Sender<Snapshot>,
}

/// The previous connection of a page, which may not have ended yet.
pub(super) struct ReplacedPage {
    pub(super) page: PageId,
    /// What the station has told that page.
    pub(super) secret: String,
}

/// A setpoint of manual drive.
pub(super) struct DriveOrder {
    pub(super) page: PageId,
    /// The vehicle that the operator has seen.
    pub(super) vehicle: Option<u16>,
    pub(super) forward: f64,
    pub(super) turn: f64,
    /// How long it has waited on its way from the page, if it is not too old.
    pub(super) waited: Result<Duration, TooOld>,
    /// When it has arrived.
    pub(super) at: Instant,
    /// For how long the operator's hand counted without another sign, when it was sent.
    pub(super) hand: Duration,
    pub(super) reply: Reply,
}

/// A stop, which overtakes all orders.
pub(super) struct StopOrder {
    pub(super) target: StopTarget,
    /// The press of which it is a copy, if the page says so.
    pub(super) press: Option<Press>,
    /// The user who stops, for the log of events.
    pub(super) user: Arc<str>,
    pub(super) reply: StopReply,
}

/// What is to be stopped.
pub(super) enum StopTarget {
    /// The vehicle of a page.
    OfPage(PageId),
    Vehicle(u16),
    All,
}

/// Callback for a stop that is taken, or the reason why it has stopped nothing so far.
pub(super) type TakenReply = Box<dyn FnOnce(Result<TakenStop, &str>) + Send>;

/// The two answers to a stop.
pub(super) struct StopReply {
    /// Called as soon as the stop is sent, or if it has stopped nothing so far.
    pub(super) taken: TakenReply,
    /// Called when every part has confirmed it, if the sender waits for that.
    pub(super) confirmed: Option<Reply>,
}

/// A stop that the station has taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TakenStop {
    /// Whether it stops what was not stopped before.
    pub(super) is_new: bool,
    /// How many presses the station had taken with it: states that name as many or more are younger. `None` for a
    /// copy of a press that was cleared since, which stops nothing.
    pub(super) count: Option<u64>,
}

impl StopReply {
    /// Answers a late copy of a stop that was cleared since.
    pub(super) fn ignored(self) {
        (self.taken)(Ok(TakenStop {
            is_new: false,
            count: None,
        }));
        if let Some(confirmed) = self.confirmed {
            confirmed(Err("this press was cleared since".to_owned()));
        }
    }

    /// Answers a stop that has stopped nothing so far.
    pub(super) fn refused(self, why: &str) {
        (self.taken)(Err(why));
        if let Some(confirmed) = self.confirmed {
            confirmed(Err(why.to_owned()));
        }
    }

    /// Answers that the stop is sent. Returns the callback for its confirmation.
    pub(super) fn taken(self, is_new: bool, count: u64) -> Option<Reply> {
        (self.taken)(Ok(TakenStop {
            is_new,
            count: Some(count),
        }));
        self.confirmed
    }
}

/// The pages' interface to the session.
#[derive(Clone)]
pub(super) struct Access {
    pub(super) orders: mpsc::Sender<Order>,
    pub(super) stops: mpsc::Sender<StopOrder>,
    pub(super) lists: Lists,
}

/// The state of a page's vehicle.
#[derive(Debug, Clone, Default)]
pub(super) struct Snapshot {
    pub(super) seq: u64,
    pub(super) vehicle: Option<u16>,
    pub(super) link: VehicleLinkQuality,
    /// The fields of the snapshot; none before the first.
    pub(super) fields: Arc<Map<String, Value>>,
}

/// The last snapshots that are the same for all pages, as JSON; empty before the first.
#[derive(Clone)]
pub(super) struct Lists {
    /// The list of vehicles, once a second.
    fleet: watch::Receiver<Arc<str>>,
    /// The tree of components, when it has changed.
    tree: watch::Receiver<Arc<str>>,
}

impl Lists {
    /// Makes all of them new, for a page that has just connected.
    pub(super) fn mark_changed(&mut self) {
        self.fleet.mark_changed();
        self.tree.mark_changed();
    }

    /// The next new one; `None` when the session has ended. The returned future is cancel safe.
    pub(super) async fn next(&mut self) -> Option<Arc<str>> {
        loop {
            let (changed, list) = tokio::select! {
                biased;
                changed = self.tree.changed() => (changed, &mut self.tree),
                changed = self.fleet.changed() => (changed, &mut self.fleet),
            };
            changed.ok()?;
            let json = list.borrow_and_update().clone();
            if !json.is_empty() {
                return Some(json);
            }
        }
    }
}

/// The senders of [`Lists`].
pub(super) struct Publisher {
    fleet: watch::Sender<Arc<str>>,
    tree: watch::Sender<Arc<str>>,
}

impl Publisher {
    pub(super) fn new() -> (Self, Lists) {
        let (fleet, fleets) = watch::channel(Arc::from(""));
        let (tree, trees) = watch::channel(Arc::from(""));
        let lists = Lists {
            fleet: fleets,
            tree: trees,
        };
        (Self { fleet, tree }, lists)
    }

    pub(super) fn fleet(&self, fleet: &Said<'_>) {
        // Unlike `send`, `send_replace` never fails. The server holds a receiver even without pages.
        self.fleet.send_replace(json(fleet));
    }

    pub(super) fn tree(&self, tree: &Said<'_>) {
        self.tree.send_replace(json(tree));
    }
}

/// The fields of a snapshot.
pub(super) fn fields(state: &State) -> Map<String, Value> {
    match serde_json::to_value(state) {
        Ok(Value::Object(fields)) => fields,
        // Serialisation cannot fail for numbers and text, and a structure is an object.
        _ => Map::new(),
    }
}

/// A frame as JSON.
pub(super) fn json(frame: &impl Serialize) -> Arc<str> {
    // Serialisation cannot fail for numbers and text.
    serde_json::to_string(frame).unwrap_or_default().into()
}
