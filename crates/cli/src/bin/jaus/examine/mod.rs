//! `jaus examine`: recognises one peer and tries the exchanges with it one by one, to name
//! the first failure with its likely cause.
//!
//! [`examiner`] decides what to send and evaluates the answers, without sockets and clock;
//! [`sockets`] does the I/O.

mod case;
mod discovery;
mod events;
mod examiner;
mod exchange;
mod judgement;
mod large;
mod manners;
mod profile;
mod ra;
mod reach;
mod report;
mod reserved;
#[cfg(feature = "secure")]
mod secure;
mod seen;
mod silence;
mod sockets;
mod standing;
mod target;
#[cfg(test)]
mod tests;
mod transfer;

use std::hash::{BuildHasher, Hasher, RandomState};
use std::time::Duration;

use clap::Args;
use jaus::address::JausId;
use jaus::link::{Interface, Interfaces, interface};
use jaus::node::Config;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::network::{Network, passing_id};
use jaus_cli::output::{Output, colours_wanted, say};
use jaus_cli::runtime;
use tokio::time::{Instant, sleep_until};

use self::case::{Send, Settings};
use self::examiner::Examiner;
#[cfg(feature = "secure")]
use self::secure::Sessions;
pub(crate) use self::sockets::RA_GROUP;
use self::sockets::{Happening, Sockets};
use self::target::Target;

/// Recognise a peer's stack and try each exchange with it
///
/// Tries the exchanges in the order in which integrations fail, and names the first failure with
/// its likely cause. It sends no commands. Exit status 1 means that some exchange failed.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus examine 192.168.7.2\n  \
    jaus examine 77.1.1                   the same, found by its id\n  \
    jaus examine 77.1.1 --control         takes control and releases it, too\n  \
    jaus examine 77.1.1 --id 42.1.9 --secure-peer 192.168.7.2\n  \
    jaus examine 77.1.1 --json | jq '.exchanges[] | select(.verdict == \"failed\")'")]
pub(crate) struct Examine {
    /// The peer: an id (77.1.1), an address (192.168.7.2 or 192.168.7.2:3795), or both
    /// (77.1.1@192.168.7.2)
    #[arg(value_name = "PEER")]
    target: Target,

    /// Take control of the peer and release it, unless another client has control
    #[arg(long)]
    control: bool,

    /// How long to wait for the first sign of life; JAUS++ multicasts every 5 s
    #[arg(long, default_value = "6s", value_parser = runtime::duration)]
    timeout: Duration,

    /// Print the report as one JSON object
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    network: Network,
}

impl Examine {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        self.network.require_dialling("jaus examine")?;
        let (wanted, config) = self.network.for_examination(passing_id())?;
        runtime::run(self.examine(wanted, config))
    }

    /// Opens the sockets, or the secure links; returns them with the settings of the examination.
    async fn open(
        &self,
        wanted: Option<JausId>,
        config: &Config,
    ) -> Result<(Way, Settings), Failure> {
        let mut settings = Settings {
            target: self.target,
            own: JausId::new(config.subsystem, config.node, 1),
            last_number: RandomState::new().build_hasher().finish() as u16,
            wanted,
            is_secure: false,
            port: 0,
            no_group: None,
            listen: self.timeout,
            control: self.control,
            payload_limit: config.payload_limit,
        };
        #[cfg(feature = "secure")]
        if let Some(secure) = self.network.secure()? {
            let (Some(own), None) = (wanted, self.target.address()) else {
                return Err(Failure::new(
                    "over a secure link, name the component by its id alone, and by --id one that its \
                     node grants to the key of this host",
                ));
            };
            // The peer refuses messages from other ids.
            (settings.own, settings.wanted, settings.is_secure) = (own, None, true);
            let sessions = Sessions::open(&secure, own).await?;
            return Ok((Way::Secure(Box::new(sessions)), settings));
        }
        let mut sockets = Sockets::open(interfaces(config, self.target)?, config)?;
        settings.port = sockets.local().map_or(0, |local| local.port());
        settings.no_group = sockets.no_group.take();
        Ok((Way::Plain(sockets), settings))
    }

    /// Examines the peer. `wanted` is the intended id of our node.
    async fn examine(&self, wanted: Option<JausId>, config: Config) -> Result<Outcome, Failure> {
        let config = config.or_any_free_port();
        let (mut way, settings) = self.open(wanted, &config).await?;
        if !self.json {
            let (own, on) = (settings.own, way.name());
            say(format_args!("asking {} as {own}{on} …", self.target));
        }
        let mut output = Output::new();
        let mut examiner = Examiner::new(settings);
        let colours = (!self.json).then(|| colours_wanted(&std::io::stdout()));
        let whole = go_on(&mut examiner, &mut way, colours, &mut output).await?;
        way.end().await;
        let case = examiner.case();
        if self.json {
            output.line(report::to_json(case, whole))?;
        } else {
            output.line(report::profile(case))?;
            output.line(format_args!("\n{}", report::conclusion(case, whole)))?;
        }
        Ok(report::outcome(case, whole))
    }
}

/// How messages reach the peer.
enum Way {
    Plain(Sockets),
    #[cfg(feature = "secure")]
    Secure(Box<Sessions>),
}

impl Way {
    /// Our address and the interfaces, or the peers.
    fn name(&self) -> String {
        match self {
            Self::Plain(sockets) => {
                let local = sockets.local();
                let from = local.map_or_else(String::new, |local| format!(" at {local}"));
                format!("{from} on {}", sockets.names())
            }
            #[cfg(feature = "secure")]
            Self::Secure(sessions) => format!(" by {}", sessions.names()),
        }
    }

    /// Sends a message; a refusal by the system is returned as an event.
    fn send(&mut self, send: &Send) -> Option<Happening> {
        match self {
            Self::Plain(sockets) => sockets.send(send),
            #[cfg(feature = "secure")]
            Self::Secure(sessions) => {
                sessions.send(send);
                None
            }
        }
    }

    /// Waits for the next event.
    async fn next(&mut self) -> Happening {
        match self {
            Self::Plain(sockets) => sockets.next().await,
            #[cfg(feature = "secure")]
            Self::Secure(sessions) => sessions.next().await,
        }
    }

    async fn end(&mut self) {
        #[cfg(feature = "secure")]
        if let Self::Secure(sessions) = self {
            sessions.end().await;
        }
    }
}

/// The interfaces of the peer: the one that leads to its address, or all chosen ones.
fn interfaces(config: &Config, target: Target) -> Result<Vec<Interface>, Failure> {
    let chosen = config.interfaces.choose(config.ip).map_err(Failure::of)?;
    let Some(address) = target.address() else {
        return Ok(chosen);
    };
    if let Some(near) = chosen.iter().find(|one| one.reaches(address)) {
        return Ok(vec![near.clone()]);
    }
    let own = interface::local_address_for(address);
    let leads = |one: &&Interface| Some(one.address) == own;
    // Without flags, any interface of the host is possible: loopback is not chosen by default.
    let all = interface::list().unwrap_or_default();
    let any = if config.interfaces == Interfaces::All {
        &all
    } else {
        &chosen
    };
    if let Some(one) = chosen.iter().find(leads).or_else(|| any.iter().find(leads)) {
        return Ok(vec![one.clone()]);
    }
    let near = any.iter().find(|one| one.reaches(address));
    near.or_else(|| chosen.first()).map(|one| vec![one.clone()]).ok_or_else(|| {
        Failure::new(format!(
            "no interface leads to {address}: `ip route get {}` shows the way; --interface chooses \
             one",
            address.ip()
        ))
    })
}

/// Runs the examination, and prints each trial, unless `colours` is `None`; returns whether it was
/// completed.
#[expect(
    clippy::disallowed_methods,
    reason = "the examination runs in real time"
)]
async fn go_on(
    examiner: &mut Examiner,
    way: &mut Way,
    colours: Option<bool>,
    output: &mut Output,
) -> Result<bool, Failure> {
    let begun = Instant::now();
    let stop = runtime::end(None);
    tokio::pin!(stop);
    examiner.start(Duration::ZERO);
    loop {
        send(examiner, way, begun);
        while let Some((trial, before)) = examiner.poll_trial() {
            let line = colours.and_then(|colours| report::line(trial, before, colours));
            line.map_or(Ok(()), |line| output.line(line))?;
        }
        let Some(timeout) = examiner.poll_timeout().filter(|_| !examiner.is_done()) else {
            return Ok(true);
        };
        tokio::select! {
            () = &mut stop => {
                examiner.leave();
                send(examiner, way, begun);
                return Ok(false);
            }
            happening = way.next() => handle(examiner, begun, happening),
            () = sleep_until(begun + timeout) => examiner.handle_timeout(begun.elapsed()),
        }
    }
}

/// Sends the queued messages.
fn send(examiner: &mut Examiner, way: &mut Way, begun: Instant) {
    while let Some(send) = examiner.poll_send() {
        if let Some(happening) = way.send(&send) {
            handle(examiner, begun, happening);
        }
    }
}

fn handle(examiner: &mut Examiner, begun: Instant, happening: Happening) {
    let now = begun.elapsed();
    match happening {
        Happening::Arrived(arrival) => examiner.handle_arrival(now, &arrival),
        Happening::Refused(address, refusal) => examiner.handle_refusal(now, address, refusal),
        Happening::Tcp(answer) => examiner.handle_tcp(now, answer),
    }
}
