//! Liveliness tokens: the keys by which nodes, publishers, subscriptions and services are known.

use std::fmt;
use std::str::FromStr;

use twox_hash::XxHash3_128;

use super::{NodeName, Qos, TopicName};
use crate::interface::{Interface, shown};

/// The first chunk of every token.
pub(super) const ADMIN_SPACE: &str = "@ros2_lv";
/// The most octets of a token that is read.
const LONGEST_TOKEN: usize = 2048;

/// What a token stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum EntityKind {
    /// A node.
    Node,
    /// A publisher of a topic.
    Publisher,
    /// A subscription of a topic.
    Subscription,
    /// A server of a service.
    Service,
    /// A client of a service.
    Client,
}

impl EntityKind {
    /// Every kind with its chunk of the key.
    const ALL: [(Self, &'static str); 5] = [
        (Self::Node, "NN"),
        (Self::Publisher, "MP"),
        (Self::Subscription, "MS"),
        (Self::Service, "SS"),
        (Self::Client, "SC"),
    ];

    fn chunk(self) -> &'static str {
        let of_this = Self::ALL.iter().find(|(kind, _)| *kind == self);
        of_this.map_or("", |(_, chunk)| chunk)
    }
}

/// The identity of a publisher or another entity, in the whole network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Gid(pub [u8; 16]);

impl Gid {
    /// The identity of the entity that has this token: XXH3 with 128 bits of the key.
    #[must_use]
    pub fn of_token(key: &str) -> Self {
        Self(XxHash3_128::oneshot(key.as_bytes()).to_le_bytes())
    }
}

impl fmt::Display for Gid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|octet| write!(f, "{octet:02x}"))
    }
}

/// The topic or the service of an entity, and how it uses it.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Endpoint {
    /// The name, such as `/v101/odom`.
    pub name: String,
    /// The name of the type, such as `nav_msgs::msg::dds_::Odometry_`.
    pub type_name: String,
    /// The hash of the type, such as `RIHS01_3cc97dc7…`.
    pub type_hash: String,
    /// The quality of service.
    pub qos: Qos,
}

impl Endpoint {
    /// A topic with its message type.
    #[must_use]
    pub fn new(topic: &TopicName, interface: &Interface, qos: Qos) -> Self {
        Self {
            name: topic.to_string(),
            type_name: interface.name().dds(),
            type_hash: interface.hash(),
            qos,
        }
    }
}

/// An entity of the graph, as its liveliness token says it.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Token {
    /// The domain.
    pub domain: u32,
    /// The zenoh session of the entity, its id in hexadecimal digits.
    pub session: String,
    /// The number of its node in the session.
    pub node_id: u64,
    /// Its own number in the session; for a node, the same.
    pub id: u64,
    /// What it is.
    pub kind: EntityKind,
    /// The enclave of ROS's security, or `/`.
    pub enclave: String,
    /// The namespace of its node, or `/`.
    pub namespace: String,
    /// The name of its node.
    pub node: String,
    /// Its topic or service; a node has none.
    pub endpoint: Option<Endpoint>,
}

/// A key that is no token of rmw_zenoh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{key}` is not a liveliness token of rmw_zenoh: {reason}")]
pub struct TokenError {
    key: String,
    reason: &'static str,
}

impl Token {
    /// The token of a node.
    #[must_use]
    pub fn of_node(domain: u32, session: &str, id: u64, name: &NodeName) -> Self {
        Self {
            domain,
            session: session.to_owned(),
            node_id: id,
            id,
            kind: EntityKind::Node,
            enclave: "/".to_owned(),
            namespace: name.namespace().to_owned(),
            node: name.name().to_owned(),
            endpoint: None,
        }
    }

    /// The token of an entity of this token's node.
    #[must_use]
    pub fn with_endpoint(&self, id: u64, kind: EntityKind, endpoint: Endpoint) -> Self {
        Self {
            id,
            kind,
            endpoint: Some(endpoint),
            ..self.clone()
        }
    }

    /// How the tokens of its session begin.
    pub(super) fn prefix_of_session(&self) -> String {
        format!("{ADMIN_SPACE}/{}/{}/", self.domain, self.session)
    }

    /// The name of its topic or service.
    pub(super) fn topic(&self) -> Option<&str> {
        self.endpoint.as_ref().map(|it| it.name.as_str())
    }

    /// The full name of the node, such as `/v101/bridge`.
    #[must_use]
    pub fn node_name(&self) -> String {
        format!("{}/{}", self.namespace.trim_end_matches('/'), self.node)
    }
}

/// A name as a chunk of a key.
fn mangled(name: &str) -> String {
    match name {
        "" => "%".to_owned(),
        _ => name.replace('/', "%"),
    }
}

fn demangled(chunk: &str) -> String {
    chunk.replace('%', "/")
}

impl fmt::Display for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{ADMIN_SPACE}/{}/{}/{}/{}/{}/{}/{}/{}",
            self.domain,
            self.session,
            self.node_id,
            self.id,
            self.kind.chunk(),
            mangled(&self.enclave),
            mangled(&self.namespace),
            mangled(&self.node)
        )?;
        let Some(endpoint) = &self.endpoint else {
            return Ok(());
        };
        write!(
            f,
            "/{}/{}/{}/{}",
            mangled(&endpoint.name),
            mangled(&endpoint.type_name),
            mangled(&endpoint.type_hash),
            endpoint.qos
        )
    }
}

impl FromStr for Token {
    type Err = TokenError;

    fn from_str(key: &str) -> Result<Self, TokenError> {
        parse(key).map_err(|reason| TokenError {
            key: shown(key),
            reason,
        })
    }
}

fn parse(key: &str) -> Result<Token, &'static str> {
    if key.len() > LONGEST_TOKEN {
        return Err("it is longer than 2048 octets");
    }
    let mut chunks = key.split('/');
    let mut chunk = || match chunks.next() {
        None | Some("") => Err("a chunk is missing"),
        Some(chunk) => Ok(chunk),
    };
    if chunk()? != ADMIN_SPACE {
        return Err("it does not begin with @ros2_lv");
    }
    let number = |chunk: &str| chunk.parse().map_err(|_| "an id is not a number");
    let domain = chunk()?.parse().map_err(|_| "the domain is not a number")?;
    let session = chunk()?.to_owned();
    let (node_id, id) = (number(chunk()?)?, number(chunk()?)?);
    let kind = chunk()?;
    let kind = EntityKind::ALL.iter().find(|(_, known)| *known == kind);
    let kind = kind.ok_or("its kind is not NN, MP, MS, SS or SC")?.0;
    let [enclave, namespace, node] = [chunk()?, chunk()?, chunk()?].map(demangled);
    let endpoint = match kind {
        EntityKind::Node => None,
        _ => {
            let [name, type_name, type_hash] = [chunk()?, chunk()?, chunk()?].map(demangled);
            // The entity exists, whatever its quality of service is.
            let qos = chunk()?.parse().unwrap_or_default();
            Some(Endpoint {
                name,
                type_name,
                type_hash,
                qos,
            })
        }
    };
    Ok(Token {
        domain,
        session,
        node_id,
        id,
        kind,
        enclave,
        namespace,
        node,
        endpoint,
    })
}
