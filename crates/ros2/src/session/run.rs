//! The thread of a session, which makes all calls of zenoh.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use zenoh::bytes::ZBytes;
use zenoh::config::Config;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::CongestionControl;
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Session, Wait as _};

use super::shared::{Entity, Inbox, Incoming, Outgoing, Role, Shared, State};
use crate::cdr::LONGEST;
use crate::graph::{Attachment, EntityKind, Gid, History, Qos, Reliability, Token, tokens_key};

/// How often the thread looks whether the session has a connection.
const TURN: Duration = Duration::from_secs(1);

/// Runs the session until it is closed.
pub(super) fn run(shared: &Arc<Shared>, config: &Config) {
    let open = || Running::open(shared.clone(), config.clone());
    let wait = |time| {
        let state = shared.lock();
        !state.is_closing && !shared.wait(state, time).is_closing
    };
    if let Some(running) = jaus_zenoh::open_session(open, wait) {
        running.run();
    }
    shared.end();
}

/// What the thread does next.
enum Task {
    /// Declares an entity with the key of its token.
    Declare(u64, String, Declaration),
    Withdraw(u64),
    Publish(u64, Outgoing),
}

/// What belongs to a token.
enum Declaration {
    Node,
    Publisher { key: String, qos: Qos },
    Subscription { key: String, inbox: Arc<Inbox> },
}

/// An entity that is declared. The token is first, so that it is withdrawn first.
struct Declared {
    _token: LivelinessToken,
    publisher: Option<Sender>,
    _subscriber: Option<Subscriber<()>>,
}

/// A publisher with the number of its last message.
struct Sender {
    publisher: Publisher<'static>,
    gid: Gid,
    sequence: i64,
}

/// An open session.
struct Running {
    shared: Arc<Shared>,
    declared: BTreeMap<u64, Declared>,
    session: Session,
    _graph: Subscriber<()>,
}

impl Running {
    fn open(shared: Arc<Shared>, config: Config) -> zenoh::Result<Self> {
        let session = zenoh::open(config).wait()?;
        let id = session.zid().to_string();
        let for_tokens = shared.clone();
        let graph = session
            .liveliness()
            .declare_subscriber(tokens_key(shared.domain))
            .history(true)
            .callback(move |sample| receive_token(&for_tokens, &sample))
            .wait()?;
        tracing::info!(session = id, "zenoh session open");
        let mut state = shared.lock();
        state.session = Some(id);
        state.touched = state.wanted.keys().copied().collect();
        drop(state);
        Ok(Self {
            shared,
            declared: BTreeMap::new(),
            session,
            _graph: graph,
        })
    }

    fn run(mut self) {
        let mut looked = None;
        loop {
            let now = jaus::node::now();
            if looked.is_none_or(|looked| now >= looked + TURN) {
                self.look_for_connection();
                looked = Some(now);
            }
            let mut state = self.shared.lock();
            if state.is_closing {
                break;
            }
            let task = next_task(&mut state, self.shared.domain);
            let Some(task) = task else {
                drop(self.shared.wait(state, TURN));
                continue;
            };
            drop(state);
            if let Err(error) = self.execute(task) {
                tracing::warn!(%error, "zenoh refuses a node, a publisher or a subscription");
            }
        }
        self.close();
    }

    fn close(mut self) {
        let dropped = {
            let mut state = self.shared.lock();
            state.session = None;
            state.graph.dropped()
        };
        if dropped > 0 {
            tracing::info!("{dropped} liveliness tokens left out: malformed or too many");
        }
        // Those of nodes, which have lower numbers, last.
        while self.declared.pop_last().is_some() {}
        if let Err(error) = self.session.close().wait() {
            tracing::debug!(%error, "the zenoh session did not close");
        }
    }

    fn look_for_connection(&self) {
        let info = self.session.info();
        let mut others = info.routers_zid().wait().chain(info.peers_zid().wait());
        let is_connected = others.next().is_some();
        let mut state = self.shared.lock();
        if state.is_connected != is_connected {
            state.is_connected = is_connected;
            drop(state);
            tracing::info!(is_connected, "connection to the zenoh network");
            self.shared.announce_change();
        }
    }

    fn execute(&mut self, task: Task) -> zenoh::Result<()> {
        match task {
            Task::Declare(id, token, declaration) => {
                let declared = self.declare(token, declaration)?;
                self.declared.insert(id, declared);
            }
            Task::Withdraw(id) => drop(self.declared.remove(&id)),
            Task::Publish(id, outgoing) => {
                let declared = self.declared.get_mut(&id);
                if let Some(sender) = declared.and_then(|it| it.publisher.as_mut()) {
                    sender.publish(outgoing);
                }
            }
        }
        Ok(())
    }

    fn declare(&self, token: String, declaration: Declaration) -> zenoh::Result<Declared> {
        let (mut publisher, mut subscriber) = (None, None);
        match declaration {
            Declaration::Node => {}
            Declaration::Publisher { key, qos } => {
                publisher = Some(Sender {
                    publisher: self.publisher(key, qos)?,
                    gid: Gid::of_token(&token),
                    sequence: 0,
                });
            }
            Declaration::Subscription { key, inbox } => {
                let builder = self.session.declare_subscriber(key);
                let declared = builder.callback(move |sample| {
                    receive_message(&inbox, sample.attachment(), sample.payload());
                });
                subscriber = Some(declared.wait()?);
            }
        }
        Ok(Declared {
            _token: self.session.liveliness().declare_token(token).wait()?,
            publisher,
            _subscriber: subscriber,
        })
    }

    fn publisher(&self, key: String, qos: Qos) -> zenoh::Result<Publisher<'static>> {
        // As rmw_zenoh: only those who must not lose any message wait for a congested link.
        let congestion = match (qos.reliability, qos.history) {
            (Reliability::Reliable, History::KeepAll) => CongestionControl::Block,
            _ => CongestionControl::Drop,
        };
        let builder = self.session.declare_publisher(key);
        builder.congestion_control(congestion).wait()
    }
}

impl Sender {
    fn publish(&mut self, outgoing: Outgoing) {
        self.sequence += 1;
        let attachment = Attachment {
            sequence: self.sequence,
            stamp: outgoing.stamp,
            gid: self.gid,
        };
        let put = self.publisher.put(outgoing.octets);
        if let Err(error) = put.attachment(attachment.encode()).wait() {
            tracing::debug!(%error, "a message was not published");
        }
    }
}

/// Takes the next task: additions and removals first, then messages, one publisher after the other.
fn next_task(state: &mut State, domain: u32) -> Option<Task> {
    if let Some(id) = state.touched.pop_first() {
        let session = state.session.as_deref().unwrap_or_default();
        return Some(match state.wanted.get(&id) {
            None => Task::Withdraw(id),
            Some(entity) => {
                let (token, declaration) = declaration(entity, id, domain, session);
                Task::Declare(id, token.to_string(), declaration)
            }
        });
    }
    loop {
        let id = state.ready.pop_front()?;
        let role = state.wanted.get_mut(&id).map(|it| &mut it.role);
        let Some(Role::Publisher { outgoing, .. }) = role else {
            continue;
        };
        let next = outgoing.pop();
        if !outgoing.is_empty() {
            state.ready.push_back(id);
        }
        if let Some(next) = next {
            return Some(Task::Publish(id, next));
        }
    }
}

fn declaration(entity: &Entity, id: u64, domain: u32, session: &str) -> (Token, Declaration) {
    let node = Token::of_node(domain, session, entity.node_id, &entity.node);
    match &entity.role {
        Role::Node => (node, Declaration::Node),
        Role::Publisher { topic, .. } => (
            node.with_endpoint(id, EntityKind::Publisher, topic.endpoint.clone()),
            Declaration::Publisher {
                key: topic.key.clone(),
                qos: topic.endpoint.qos,
            },
        ),
        Role::Subscription { topic, inbox } => (
            node.with_endpoint(id, EntityKind::Subscription, topic.endpoint.clone()),
            Declaration::Subscription {
                key: topic.key.clone(),
                inbox: inbox.clone(),
            },
        ),
    }
}

fn receive_token(shared: &Shared, sample: &Sample) {
    let key = sample.key_expr().as_str();
    let changed = {
        let graph = &mut shared.lock().graph;
        match sample.kind() {
            SampleKind::Put => graph.insert(key),
            SampleKind::Delete => Ok(graph.remove(key)),
        }
    };
    match changed {
        Ok(true) => shared.announce_change(),
        Ok(false) => {}
        Err(error) => tracing::debug!(%error, "a liveliness token is left out"),
    }
}

/// Queues a message for its subscription, or counts it if it cannot be one.
pub(super) fn receive_message(inbox: &Inbox, attachment: Option<&ZBytes>, payload: &ZBytes) {
    let attachment = attachment.map(ZBytes::to_bytes);
    let attachment = Attachment::decode(attachment.as_deref().unwrap_or_default());
    match attachment {
        Ok(attachment) if payload.len() <= LONGEST => {
            inbox.push(Incoming {
                attachment,
                arrival: jaus::node::now(),
                octets: payload.to_bytes().into_owned(),
            });
        }
        Ok(_) => inbox.refuse("it is too long"),
        Err(error) => inbox.refuse(&error.to_string()),
    }
}
