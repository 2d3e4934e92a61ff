//! The application interface: components that offer services, and that find and query others.
//!
//! A vehicle that reports its velocity, and an operator that queries it:
//!
//! ```no_run
//! use jaus::component::{Component, Handlers, Kind};
//! use jaus::messages::mobility::{
//!     QueryVelocityState, QueryVelocityStateExt, ReportVelocityState, velocity_state_sensor,
//! };
//! use jaus::node::{Config, Node};
//!
//! # #[tokio::main(flavor = "current_thread")]
//! # async fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // On the vehicle: subsystem 101, node 1, component 33.
//! let node = Node::start(Config::loopback(101, 1))?;
//! let mut speed = ReportVelocityState::default();
//! speed.set_velocity_x_m_per_s(1.5)?;
//! let rover = Component::builder(Kind::Vehicle, "Rover")
//!     .offer(
//!         Handlers::new(velocity_state_sensor::LATEST)
//!             .answer(move |_: QueryVelocityState| speed.clone())
//!             .declines::<QueryVelocityStateExt>(),
//!     )
//!     .attach(&node, 33)?;
//!
//! // At the operator station: subsystem 42.
//! let station = Node::start(Config::loopback(42, 1))?;
//! let operator = Component::builder(Kind::OperatorControlUnit, "Operator").attach(&station, 1)?;
//! let sensor = operator.find(velocity_state_sensor::URN).await?;
//! let query = QueryVelocityState::all();
//! let report = operator.query(sensor, &query).await?;
//! assert_eq!(sensor, rover.id());
//! assert!((report.velocity_x_m_per_s().unwrap_or_default() - 1.5).abs() < 0.01);
//! # Ok(())
//! # }
//! ```
//!
//! An application subscribes to values that it needs repeatedly, and takes control of components
//! that it commands. Subscriptions and control renew themselves, and report when they cannot:
//!
//! ```no_run
//! # use jaus::component::{Component, Update, When};
//! # use jaus::messages::mobility::{QueryVelocityState, ReportVelocityState, SetWrenchEffort};
//! # async fn drive(operator: Component, rover: jaus::address::JausId) -> Result<(), Box<dyn std::error::Error>> {
//! let query = QueryVelocityState::none().with_velocity_x();
//! let mut speeds = operator
//!     .subscribe(rover, &query, When::hz(10.0).at_least(5.0))
//!     .await?;
//! let control = operator.control(rover, 127).await?;
//! control.resume().await?;
//! while let Some(update) = speeds.next().await {
//!     match update {
//!         Update::Report(speed) if speed.velocity_x_m_per_s() > Some(2.0) => control.standby().await?,
//!         Update::Report(_) => control.send(&SetWrenchEffort::default())?,
//!         Update::Down { since, why } => eprintln!("no speed since {since:?}: {why}"),
//!         Update::Up => {}
//!     }
//! }
//! # Ok(())
//! # }
//! ```
//!
//! [`Component::session`] does more for applications that command a vehicle through its restarts: it
//! finds the component, takes control, makes it ready, and does so again as the chosen [`Retake`]
//! policy says.
//!
//! A component runs in its own task on the current tokio runtime until the last clone of its
//! [`Component`] is dropped. The protocol is in [`service`](crate::service); this module adds only
//! the clock, the channels and the names.
#![expect(
    clippy::disallowed_methods,
    reason = "gives the services their clock and task"
)]

mod builder;
mod clients;
mod clocks;
mod command;
mod control;
mod directories;
mod driver;
mod error;
mod feed;
mod find;
mod group;
mod handle;
mod latest;
mod list;
mod offers;
mod request;
mod session;
mod subscription;
mod undecoded;
mod watch;

pub use crate::service::{
    AccessControl, Audience, CLEAR_ALL, Call, CannotSubscribe, Change, Condition, ControlLost,
    ControlRefused, Directory, EventSettings, Handlers, Identification, Kind, LaterAnswer, Level,
    Liveness, Loss, Management, NeedsControl, Offer, Outage, Patience, QueryOptions, Rejection,
    Retake, Scope, Service, SessionLoss, SessionSettings, SessionState, Standing, State,
    SubscriptionEnd, TargetState, Time, TimeOfDay, Timing, UndecodedFunctions, Validity, When,
};
pub use crate::wire::Priority;
pub use builder::{AttachError, Builder};
pub use clocks::PeerClocks;
pub use command::RunningCommand;
pub use control::Control;
pub use error::{
    ControlError, DeliverError, FindError, ManageError, OfferError, PublishError, QueryError,
    RequestError, SendError, SessionError, StopReason, Stopped, SubscribeError,
};
pub use group::{GroupSubscription, GroupUpdate, Results};
pub use handle::Component;
pub use list::List;
pub use session::Session;
pub use subscription::{FromReport, Subscription, Undecoded, Update};
pub use watch::{Messages, Watch};
