//! The zenoh session: opens it, and runs it in a thread of its own.
//!
//! Calls of zenoh may wait for a congested link, so the node's task makes none of them.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::node::now;
use jaus::wire::Priority;
use tokio::sync::mpsc;
use zenoh::bytes::Encoding;
use zenoh::config::{Config, EndPoint};
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::qos::{self, CongestionControl};
use zenoh::query::{QueryTarget, Queryable, Reply};
use zenoh::sample::{Locality, Sample, SampleKind};
use zenoh::{Session, Wait as _};

use crate::key::Key;
use crate::link::{Answer, Shared};
use crate::queue::{Command, Publication};
use crate::view::Request;

/// How the zenoh session finds the network.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct NetworkSettings {
    /// A zenoh settings file (JSON5), for TLS, access control and all else.
    pub file: Option<PathBuf>,
    /// Endpoints of routers or other bridges to connect to, such as `tcp/192.168.7.2:7447`.
    pub connect: Vec<String>,
    /// Endpoints to listen on, such as `tcp/0.0.0.0:7447`.
    pub listen: Vec<String>,
    /// The id of the session in the zenoh network, unless the file sets one; a random one if `None`.
    pub id: Option<String>,
}

/// Why there are no settings for a zenoh session.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NetworkError {
    /// There is nowhere to connect to.
    #[error(
        "no zenoh network: add --connect tcp/HOST:7447, --listen tcp/0.0.0.0:7447, or \
         --zenoh-config FILE"
    )]
    Nowhere,
    /// The settings file cannot be used.
    #[error("{file}: {reason}")]
    File {
        /// The file.
        file: String,
        /// The reason that zenoh gives.
        reason: String,
    },
    /// An endpoint is malformed.
    #[error("`{endpoint}` is not a zenoh endpoint: write for example tcp/192.168.7.2:7447")]
    Endpoint {
        /// The endpoint.
        endpoint: String,
    },
    /// Ids get rights on a network that proves nobody's identity.
    #[error(
        "--accept lets ids do more than observe, and {reason}: whoever reaches this zenoh network could \
         act as these ids. Use TLS with client certificates on all links (--zenoh-config), or state \
         --trust-network"
    )]
    Unproven {
        /// The setting that admits links without TLS or without client certificates.
        reason: String,
    },
    /// zenoh refuses a setting.
    #[error("zenoh refuses the setting {setting}: {reason}")]
    Setting {
        /// The setting.
        setting: &'static str,
        /// The reason that zenoh gives.
        reason: String,
    },
}

impl NetworkSettings {
    /// The settings for zenoh. Without a file, the session searches for nothing and listens nowhere
    /// but where it is told to.
    ///
    /// # Errors
    /// A file that cannot be used, a malformed endpoint, or nowhere to connect to.
    pub fn config(&self) -> Result<Config, NetworkError> {
        let mut config = match &self.file {
            Some(file) => Config::from_file(file).map_err(|error| NetworkError::File {
                file: file.display().to_string(),
                reason: error.to_string(),
            })?,
            None if self.connect.is_empty() && self.listen.is_empty() => {
                return Err(NetworkError::Nowhere);
            }
            None => self.explicit()?,
        };
        for (setting, endpoints) in [
            ("connect/endpoints", &self.connect),
            ("listen/endpoints", &self.listen),
        ] {
            if self.file.is_none() || !endpoints.is_empty() {
                insert(&mut config, setting, &list(endpoints)?)?;
            }
        }
        let has_id = config.get_json("id").is_ok_and(|id| id != "null");
        if let Some(id) = self.id.as_deref().filter(|_| !has_id) {
            insert(&mut config, "id", &serde_json::Value::from(id).to_string())?;
        }
        Ok(config)
    }

    /// The settings of a session that searches for nothing.
    fn explicit(&self) -> Result<Config, NetworkError> {
        let mut config = Config::default();
        // A client changes to another of its routers when it loses one.
        let mode = match self.listen.is_empty() {
            true => "\"client\"",
            false => "\"peer\"",
        };
        for (setting, value) in [
            ("mode", mode),
            ("scouting/multicast/enabled", "false"),
            ("scouting/gossip/enabled", "false"),
        ] {
            insert(&mut config, setting, value)?;
        }
        Ok(config)
    }
}

fn insert(config: &mut Config, setting: &'static str, value: &str) -> Result<(), NetworkError> {
    let inserted = config.insert_json5(setting, value);
    inserted.map_err(|error| NetworkError::Setting {
        setting,
        reason: error.to_string(),
    })
}

/// Endpoints as a JSON list.
fn list(endpoints: &[String]) -> Result<String, NetworkError> {
    for endpoint in endpoints {
        if endpoint.parse::<EndPoint>().is_err() {
            let endpoint = endpoint.chars().take(100).collect();
            return Err(NetworkError::Endpoint { endpoint });
        }
    }
    Ok(serde_json::Value::from(endpoints).to_string())
}

/// How long the thread waits between attempts to open the session.
const RETRY: Duration = Duration::from_secs(1);
/// How long the thread waits for work. It is woken before.
const TURN: Duration = Duration::from_secs(1);

/// Opens a session, and tries again every second. `wait` waits for that time, and returns whether to try again.
pub fn open_session<S>(
    mut open: impl FnMut() -> zenoh::Result<S>,
    mut wait: impl FnMut(Duration) -> bool,
) -> Option<S> {
    let mut has_warned = false;
    loop {
        match open() {
            Ok(session) => return Some(session),
            Err(error) if !has_warned => {
                tracing::warn!(%error, "no zenoh network yet: trying again every second");
                has_warned = true;
            }
            Err(error) => tracing::debug!(%error, "no zenoh network yet"),
        }
        if !wait(RETRY) {
            return None;
        }
    }
}

/// Runs the session until the bridge closes it. A thread calls it.
pub(crate) fn run(shared: &Arc<Shared>, config: &Config, requests: &mpsc::Sender<Request>) {
    let open = || Running::open(shared.clone(), config.clone(), requests.clone());
    let wait = |time| {
        let state = shared.lock();
        !state.is_closing && !shared.wait(state, time).is_closing
    };
    if let Some(running) = open_session(open, wait) {
        running.run();
    }
}

/// An open session.
struct Running {
    shared: Arc<Shared>,
    session: Session,
    requests: mpsc::Sender<Request>,
    _subscribers: Vec<Subscriber<()>>,
    tokens: BTreeMap<JausId, LivelinessToken>,
    queryables: Vec<Queryable<()>>,
}

impl Running {
    fn open(
        shared: Arc<Shared>,
        config: Config,
        requests: mpsc::Sender<Request>,
    ) -> zenoh::Result<Self> {
        let session = zenoh::open(config).wait()?;
        let mut subscribers = Vec::new();
        let (messages, presences) = {
            let exchange = &shared.lock().exchange;
            (exchange.subscriptions(), exchange.presences())
        };
        for key in presences {
            let shared = shared.clone();
            let subscriber = session
                .liveliness()
                .declare_subscriber(key)
                .history(true)
                .callback(move |sample| receive_token(&shared, &sample));
            subscribers.push(subscriber.wait()?);
        }
        for key in messages {
            let shared = shared.clone();
            let subscriber = session
                .declare_subscriber(key)
                .allowed_origin(Locality::Remote)
                .callback(move |sample| receive_message(&shared, &sample));
            subscribers.push(subscriber.wait()?);
        }
        tracing::info!(zid = %session.zid(), "zenoh session open");
        shared.with(crate::exchange::Exchange::handle_open);
        Ok(Self {
            shared,
            session,
            requests,
            _subscribers: subscribers,
            tokens: BTreeMap::new(),
            queryables: Vec::new(),
        })
    }

    fn run(mut self) {
        loop {
            let mut state = self.shared.lock();
            let answers = std::mem::take(&mut state.answers);
            let command = state.exchange.poll_command(now());
            if command.is_none() && answers.is_empty() {
                if state.is_closing {
                    break;
                }
                drop(self.shared.wait(state, TURN));
                continue;
            }
            drop(state);
            answers.iter().for_each(reply);
            if let Some(command) = command
                && let Err(error) = self.execute(command)
            {
                tracing::debug!(%error, "zenoh refuses a command");
            }
        }
        self.tokens.clear();
        if let Err(error) = self.session.close().wait() {
            tracing::debug!(%error, "the zenoh session did not close");
        }
    }

    fn execute(&mut self, command: Command) -> zenoh::Result<()> {
        match command {
            Command::Announce(component) => {
                let key = self.shared.lock().exchange.token_key(component);
                let token = self.session.liveliness().declare_token(key).wait()?;
                self.tokens.insert(component, token);
            }
            Command::Withdraw(component) => {
                if let Some(token) = self.tokens.remove(&component) {
                    token.undeclare().wait()?;
                }
            }
            Command::Serve(subsystem) => self.serve(subsystem)?,
            Command::Identify(token) => self.identify(token)?,
            Command::Publish(publication) => self.publish(publication)?,
        }
        Ok(())
    }

    /// Asks the routers which sessions have declared a token, and logs what they say. Nobody answers if the
    /// administration space of the routers is off, or closed to this session.
    fn identify(&self, token: String) -> zenoh::Result<()> {
        let selector = format!("@/*/router/token/{token}");
        let log = move |reply: Reply| {
            if let Ok(sample) = reply.result()
                && let Some((router, sessions)) = declared_by(sample)
            {
                tracing::info!(
                    "{token} was declared by zenoh sessions {sessions}, says router {router}"
                );
            }
        };
        self.session
            .get(selector)
            .target(QueryTarget::All)
            .timeout(PATIENCE)
            .callback(log)
            .wait()
    }

    fn publish(&self, publication: Publication) -> zenoh::Result<()> {
        let congestion = match publication.waits {
            true => CongestionControl::Block,
            false => CongestionControl::Drop,
        };
        let encoding = match publication.priority {
            Some(_) => Encoding::APPLICATION_OCTET_STREAM,
            None => Encoding::APPLICATION_JSON,
        };
        let put = self.session.put(publication.key, publication.payload);
        put.encoding(encoding)
            .priority(priority(publication.priority))
            .congestion_control(congestion)
            // Otherwise it may wait for others to share a packet with.
            .express(publication.priority > Some(Priority::Standard))
            .allowed_destination(Locality::Remote)
            .wait()
    }

    fn serve(&mut self, subsystem: u16) -> zenoh::Result<()> {
        let key = self.shared.lock().exchange.prefix().views_of(subsystem);
        let (shared, requests) = (self.shared.clone(), self.requests.clone());
        let queryable = self.session.declare_queryable(key).callback(move |query| {
            let key = shared.lock().exchange.prefix().parse(query.key_expr());
            let request = match key {
                Some(Key::Json { component, report }) => Request::new(component, report, query),
                _ => return refuse(&shared, &query, "name one component and one report"),
            };
            if let Err(mpsc::error::TrySendError::Full(request)) = requests.try_send(request) {
                refuse(
                    &shared,
                    request.query(),
                    "too many requests wait: try again",
                );
            }
        });
        self.queryables.push(queryable.wait()?);
        Ok(())
    }
}

/// How long routers may take to say who has declared a token.
const PATIENCE: Duration = Duration::from_secs(2);
/// The most sessions with one token that are named.
const MOST_NAMED: usize = 8;

/// The router that answers, and the ids of the sessions at it that have declared a token.
fn declared_by(answer: &Sample) -> Option<(String, String)> {
    let router = answer.key_expr().as_str().split('/').nth(1)?;
    let sources: BTreeMap<String, Vec<String>> =
        serde_json::from_slice(&answer.payload().to_bytes()).ok()?;
    // Other routers only pass it on.
    let at_it = sources.into_iter().filter(|(kind, _)| kind != "routers");
    let is_id = |id: &String| id.len() <= 32 && id.chars().all(|it| it.is_ascii_hexdigit());
    let ids = at_it
        .flat_map(|(_, ids)| ids)
        .filter(is_id)
        .take(MOST_NAMED);
    let ids: Vec<_> = ids.collect();
    (!ids.is_empty() && is_id(&router.to_owned())).then(|| (router.to_owned(), ids.join(", ")))
}

/// The priority of zenoh for a priority of JAUS. Views yield to all messages.
const fn priority(priority: Option<Priority>) -> qos::Priority {
    match priority {
        None => qos::Priority::Background,
        Some(Priority::Low) => qos::Priority::DataLow,
        Some(Priority::Standard) => qos::Priority::Data,
        Some(Priority::High) => qos::Priority::InteractiveHigh,
        Some(Priority::SafetyCritical) => qos::Priority::RealTime,
    }
}

fn receive_token(shared: &Shared, sample: &Sample) {
    let is_alive = sample.kind() == SampleKind::Put;
    let key = sample.key_expr().as_str();
    shared.with(|exchange| exchange.handle_token(now(), key, is_alive));
}

fn receive_message(shared: &Shared, sample: &Sample) {
    let payload = Bytes::from(sample.payload().to_bytes().into_owned());
    let key = sample.key_expr().as_str();
    shared.with(|exchange| exchange.handle_sample(now(), key, &payload));
}

fn refuse(shared: &Shared, query: &zenoh::query::Query, why: &str) {
    shared.lock().exchange.count_refused_view();
    if let Err(error) = query.reply_err(why).wait() {
        tracing::debug!(%error, "the refusal of a view was not sent");
    }
}

/// Sends the answer to a request for a view.
fn reply(answer: &Answer) {
    let key = answer.query.key_expr().clone();
    let sent = match &answer.result {
        Ok(json) => {
            let reply = answer.query.reply(key, json.clone());
            reply.encoding(Encoding::APPLICATION_JSON).wait()
        }
        Err(why) => answer.query.reply_err(why.clone()).wait(),
    };
    if let Err(error) = sent {
        tracing::debug!(%error, "the answer to a request for a view was not sent");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(connect: &[&str], listen: &[&str]) -> NetworkSettings {
        let owned = |endpoints: &[&str]| endpoints.iter().map(|&it| it.to_owned()).collect();
        NetworkSettings {
            file: None,
            connect: owned(connect),
            listen: owned(listen),
            ..NetworkSettings::default()
        }
    }

    #[test]
    fn without_a_file_the_session_searches_for_nothing() {
        for (settings, mode) in [
            (settings(&["tcp/127.0.0.1:7447"], &[]), "\"client\""),
            (settings(&[], &["tcp/127.0.0.1:7447"]), "\"peer\""),
        ] {
            let config = settings.config().unwrap();
            let get = |key| config.get_json(key).unwrap();
            assert_eq!(get("mode"), mode);
            assert_eq!(get("scouting/multicast/enabled"), "false");
            assert_eq!(get("scouting/gossip/enabled"), "false");
        }
    }

    #[test]
    fn a_session_listens_only_where_it_is_told_to() {
        let config = settings(&["tcp/127.0.0.1:7447"], &[]).config().unwrap();
        assert_eq!(config.get_json("listen/endpoints").unwrap(), "[]");
    }

    #[test]
    fn a_session_without_a_network_or_with_a_malformed_endpoint_is_refused() {
        let error = settings(&[], &[]).config().unwrap_err();
        assert!(error.to_string().contains("--connect"), "{error}");
        let error = settings(&["192.168.7.2"], &[]).config().unwrap_err();
        assert!(
            error.to_string().contains("tcp/192.168.7.2:7447"),
            "{error}"
        );
    }

    #[test]
    fn flags_replace_the_endpoints_of_a_file_and_leave_the_rest() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("zenoh.json5");
        let text = "{ mode: 'client', connect: { endpoints: ['tls/rover:7447'] },
            transport: { link: { tls: { root_ca_certificate: '/etc/jaus/ca.pem' } } } }";
        std::fs::write(&file, text).unwrap();
        let mut with_flag = settings(&["tls/other:7447"], &[]);
        with_flag.file = Some(file);
        let config = with_flag.config().unwrap();
        let get = |key| config.get_json(key).unwrap();
        assert_eq!(get("connect/endpoints"), "[\"tls/other:7447\"]");
        let ca = get("transport/link/tls/root_ca_certificate");
        assert_eq!(ca, "\"/etc/jaus/ca.pem\"");
        let missing = NetworkSettings {
            file: Some("/nowhere/zenoh.json5".into()),
            ..NetworkSettings::default()
        };
        let error = missing.config().unwrap_err().to_string();
        assert!(error.contains("/nowhere/zenoh.json5"), "{error}");
    }
}
