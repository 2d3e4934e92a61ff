//! A bridge between a JAUS vehicle and ROS 2, and what it needs to speak with ROS 2 without ROS installed.
//!
//! A session of this crate speaks with nodes of ROS 2 that use the middleware `rmw_zenoh_cpp`, which is
//! available from ROS 2 Jazzy on. It uses the same keys, encoding and liveliness tokens:
//!
//! * [`interface`]: message types, read from the text of `.msg` files; those that a vehicle needs are
//!   part of the crate.
//! * [`message`]: messages, whose [values](Value) are set and read by path.
//! * [`cdr`]: the encoding of messages.
//! * [`graph`]: keys of topics, liveliness tokens, quality of service, attachments.
//!
//! * [`session`]: nodes, publishers and subscriptions in a zenoh network. Those above do no I/O.
//! * [`bridge`]: the vehicle, seen and commanded from ROS. `docs/ros2.md` is the guide to the program.
//!
//! ```
//! use jaus_ros2::{Interfaces, Message, cdr};
//!
//! let twist = Interfaces::bundled()?.get("geometry_msgs/msg/Twist")?;
//! let mut message = Message::new(&twist);
//! message.set("linear.x", 0.5)?;
//! let octets = cdr::encode(&message);
//! assert_eq!(cdr::decode(&twist, &octets)?.float("linear.x")?, 0.5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Sources
//! The keys, tokens, texts of quality of service and attachments follow rmw_zenoh_cpp 0.2.4 and newer
//! (its `docs/design.md`, and its sources up to 0.2.5). Before 0.2.3 its default durability was another
//! one, and before 0.2.4 its attachment had another form, so that older versions do not work. The type
//! hashes follow REP 2016 (`RIHS01`), and the texts of types ROS's page on interfaces. The encoding is
//! the plain CDR of OMG's DDS-XTypes, version 1. `tests` compare with hashes that ROS publishes, and with
//! other implementations of CDR and zenoh; ROS 2 itself is not part of them.
#![forbid(unsafe_code)]

pub mod bridge;
pub mod cdr;
pub mod graph;
mod hash;
pub mod interface;
pub mod message;
pub mod session;

pub use jsidl::ros::Value;

pub use graph::{Attachment, Gid, Qos, TopicName};
pub use interface::{Interface, InterfaceError, Interfaces, TypeName};
pub use message::{Message, ValueError};
pub use session::{Ros, SessionError};
