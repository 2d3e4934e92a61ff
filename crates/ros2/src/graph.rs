//! The graph of ROS 2 in a zenoh network, as rmw_zenoh keeps it: which key a topic has, and which
//! nodes, publishers, subscriptions and services exist. Each of them declares a liveliness token, whose
//! key says what it is.

mod attachment;
mod name;
mod qos;
mod table;
mod token;

pub use attachment::{Attachment, AttachmentError};
pub use name::{NameError, NodeName, TopicName};
pub use qos::{Durability, History, Liveliness, Qos, QosError, Reliability};
pub use table::{Entity, Graph};
pub use token::{Endpoint, EntityKind, Gid, Token, TokenError};

use crate::interface::Interface;

/// The greatest domain: more are not portable between implementations of ROS 2.
pub const GREATEST_DOMAIN: u32 = 232;

/// The key of a topic's messages, such as
/// `0/v101/odom/nav_msgs::msg::dds_::Odometry_/RIHS01_3cc97dc7…`.
#[must_use]
pub fn topic_key(domain: u32, topic: &TopicName, interface: &Interface) -> String {
    let topic = topic.as_str().trim_matches('/');
    let (name, hash) = (interface.name().dds(), interface.hash());
    format!("{domain}/{topic}/{name}/{hash}")
}

/// The key of all liveliness tokens of a domain.
#[must_use]
pub fn tokens_key(domain: u32) -> String {
    format!("{}/{domain}/**", token::ADMIN_SPACE)
}
