//! The types of the interface.

use std::ffi::{c_char, c_void};

use jaus::address::JausId;

/// The address of a component: subsystem, node and component, such as 101.1.33. 65535 and 255 mean
/// all.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JausAddress {
    /// 1 to 65534.
    pub subsystem: u16,
    /// 1 to 254.
    pub node: u8,
    /// 1 to 254.
    pub component: u8,
}

impl From<JausId> for JausAddress {
    fn from(id: JausId) -> Self {
        Self {
            subsystem: id.subsystem(),
            node: id.node(),
            component: id.component(),
        }
    }
}

impl From<JausAddress> for JausId {
    fn from(address: JausAddress) -> Self {
        Self::new(address.subsystem, address.node, address.component)
    }
}

/// Can be delayed.
pub const JAUS_PRIORITY_LOW: u8 = 0;
/// Nearly all messages.
pub const JAUS_PRIORITY_STANDARD: u8 = 1;
/// Before ordinary traffic.
pub const JAUS_PRIORITY_HIGH: u8 = 2;
/// Before everything else.
pub const JAUS_PRIORITY_SAFETY_CRITICAL: u8 = 3;

/// A subsystem that moves or acts.
pub const JAUS_KIND_VEHICLE: u16 = 10001;
/// An operator control unit.
pub const JAUS_KIND_OPERATOR_CONTROL_UNIT: u16 = 20001;
/// A subsystem of another kind.
pub const JAUS_KIND_OTHER_SUBSYSTEM: u16 = 30001;

/// Starting; cannot be controlled yet.
pub const JAUS_STATE_INITIALIZE: u8 = 0;
/// Acts on the commands of the client in control.
pub const JAUS_STATE_READY: u8 = 1;
/// Can be controlled, but does not act.
pub const JAUS_STATE_STANDBY: u8 = 2;
/// Shutting down.
pub const JAUS_STATE_SHUTDOWN: u8 = 3;
/// Something is broken.
pub const JAUS_STATE_FAILURE: u8 = 4;
/// Stopped by an emergency.
pub const JAUS_STATE_EMERGENCY: u8 = 5;
/// The value of `JausEventKind_ControlStatus` before the peer's first report.
pub const JAUS_STATE_UNKNOWN: u8 = 255;

/// The component is ready for work, or its failure is repaired.
pub const JAUS_CONDITION_INITIALIZED: u8 = 0;
/// Something is broken: the component goes to the state Failure, which ends control.
pub const JAUS_CONDITION_FAILED: u8 = 1;
/// The person responsible on site has checked the vehicle: all emergencies end.
pub const JAUS_CONDITION_SAFE: u8 = 2;
/// The component stops by itself, as by a stop input: an emergency begins that no client can clear.
pub const JAUS_CONDITION_STOPPED: u8 = 3;
/// The reason of `JAUS_CONDITION_STOPPED` is over: its emergency ends. Those that clients have set remain.
pub const JAUS_CONDITION_STOP_RELEASED: u8 = 4;

/// As the standard's commands need: 500 ms for efforts, velocities and commands of your own; vectors
/// while their client shows life; goals until they are reached.
pub const JAUS_VALIDITY_BY_CODE: u8 = 0;
/// 500 ms after receipt.
pub const JAUS_VALIDITY_BRIEF: u8 = 1;
/// While the client shows life at least every second.
pub const JAUS_VALIDITY_WHILE_ALIVE: u8 = 2;
/// Until it is done, as long as control lasts.
pub const JAUS_VALIDITY_UNTIL_DONE: u8 = 3;

/// A node, or the connection to the node of this host.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JausNode {
    /// The number of the object; 0 is none.
    pub id: u64,
}

/// A component.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JausComponent {
    /// The number of the object; 0 is none.
    pub id: u64,
}

/// A service of a component, before the component starts.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JausService {
    /// The number of the component.
    pub component: u64,
    /// The place of the service among its services.
    pub place: u32,
}

/// A subscription to the reports of a peer.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JausSubscription {
    /// The number of the object; 0 is none.
    pub id: u64,
}

/// Control of a peer.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JausControl {
    /// The number of the object; 0 is none.
    pub id: u64,
}

/// What an event is about.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JausEventKind {
    /// A message for a service: `data`, from its code; `source` sent it.
    Message = 1,
    /// What commands have started must stop, and the stop callback has been called.
    Stop = 2,
    /// A report of the subscription `subject`: `data`, from its code. `age` is the time since its
    /// arrival, `lost` counts the reports lost in transit so far.
    Report = 3,
    /// The subscription `subject` is up. `rate` is what the peer has confirmed.
    SubscriptionUp = 4,
    /// No reports of the subscription `subject` arrive at present; `text` has the reason. The
    /// subscription goes on and tries to get them again.
    SubscriptionDown = 5,
    /// The subscription `subject` is over; `text` has the reason.
    SubscriptionEnded = 6,
    /// The peer `source` under the control `subject` has reported the state `value`.
    ControlStatus = 7,
    /// The control `subject` of `source` is lost for good; `text` has the reason.
    ControlLost = 8,
    /// This component is in the state `value` now, and `source` controls it (0.0.0: nobody).
    Standing = 9,
    /// The services of the component `source` are known, or have changed.
    Found = 10,
    /// The component `source` is gone.
    Lost = 11,
}

/// An event. It is valid during the callback, or until the next call of `jaus_component_next_event` or
/// the end of the component. Fields that the kind does not name are 0. New versions of the library
/// may add fields at the end.
#[repr(C)]
#[derive(Debug)]
pub struct JausEvent {
    /// What it is about; determines which fields are set.
    pub kind: JausEventKind,
    /// A state.
    pub value: u8,
    /// The component that the event comes from.
    pub source: JausAddress,
    /// The id of the subscription or of the control.
    pub subject: u64,
    /// A message, from its code. Null if there is none.
    pub data: *const u8,
    /// The number of octets of `data`.
    pub length: usize,
    /// A reason for people, in UTF-8. Never null.
    pub text: *const c_char,
    /// Seconds since the arrival.
    pub age: f64,
    /// Hertz; 0 for reports on change.
    pub rate: f64,
    /// How many reports were lost in transit.
    pub lost: u64,
}

/// The answer to a query, for the time of a callback.
#[derive(Debug, Default)]
pub struct JausAnswer {
    pub(crate) report: Option<bytes::Bytes>,
}

/// A message that the library has allocated. Free it with `jaus_message_free`.
#[repr(C)]
#[derive(Debug)]
pub struct JausMessage {
    /// The message, from its code.
    pub data: *mut u8,
    /// The number of its octets.
    pub length: usize,
}

/// The state of a subscription.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub struct JausSubscriptionState {
    /// Whether reports arrive, as far as known now.
    pub is_up: bool,
    /// The rate in hertz that the peer has confirmed; 0 for reports on change.
    pub rate: f64,
    /// Seconds since the last report arrived; negative before the first.
    pub age: f64,
    /// Reports lost in transit.
    pub lost: u64,
    /// Reports dropped because the program was slow.
    pub missed: u64,
}

/// Gets an event. `user` is the pointer that was given with the callback.
///
/// A callback runs on the library's thread. It must return within 500 ms: while it runs, the whole
/// node stands still. After that time the stop callbacks of the node's components are called. It must
/// not throw.
pub type JausEventCallback =
    Option<unsafe extern "C" fn(user: *mut c_void, event: *const JausEvent)>;

/// Answers a query with `jaus_answer_set`, or not at all. As for `JausEventCallback`.
pub type JausAnswerCallback = Option<
    unsafe extern "C" fn(user: *mut c_void, query: *const JausEvent, answer: *mut JausAnswer),
>;

/// Stops everything that the commands of a component have started. Also called when nothing moves.
///
/// It runs on the library's thread or, if a callback hangs, on another one while that callback still
/// runs. It must not wait for anything that a callback holds, such as a mutex. It must not throw.
pub type JausStopCallback = Option<unsafe extern "C" fn(user: *mut c_void)>;
