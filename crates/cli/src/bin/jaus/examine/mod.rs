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

use self::case::Settings;
use self::examiner::Examiner;
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
        self.network.require_plain()?;
        let (wanted, config) = self.network.for_examination(passing_id())?;
        runtime::run(self.examine(wanted, config))
    }

    /// Examines the peer. `wanted` is the intended id of our node.
    async fn examine(&self, wanted: Option<JausId>, config: Config) -> Result<Outcome, Failure> {
        let config = config.or_any_free_port();
        let mut sockets = Sockets::open(interfaces(&config, self.target)?, &config)?;
        let local = sockets.local();
        let settings = Settings {
            target: self.target,
            own: JausId::new(config.subsystem, config.node, 1),
            last_number: RandomState::new().build_hasher().finish() as u16,
            wanted,
            port: local.map_or(0, |local| local.port()),
            no_group: sockets.no_group.take(),
            listen: self.timeout,
            control: self.control,
            payload_limit: config.payload_limit,
        };
        if !self.json {
            let from = local.map_or_else(String::new, |local| format!(" at {local}"));
            let on = sockets.names();
            say(format_args!(
                "asking {} as {}{from} on {on} …",
                self.target, settings.own
            ));
        }
        let mut output = Output::new();
        let mut examiner = Examiner::new(settings);
        let colours = (!self.json).then(|| colours_wanted(&std::io::stdout()));
        let whole = go_on(&mut examiner, &mut sockets, colours, &mut output).await?;
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
    sockets: &mut Sockets,
    colours: Option<bool>,
    output: &mut Output,
) -> Result<bool, Failure> {
    let begun = Instant::now();
    let stop = runtime::end(None);
    tokio::pin!(stop);
    examiner.start(Duration::ZERO);
    loop {
        send(examiner, sockets, begun);
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
                send(examiner, sockets, begun);
                return Ok(false);
            }
            happening = sockets.next() => handle(examiner, begun, happening),
            () = sleep_until(begun + timeout) => examiner.handle_timeout(begun.elapsed()),
        }
    }
}

/// Sends the queued messages.
fn send(examiner: &mut Examiner, sockets: &mut Sockets, begun: Instant) {
    while let Some(send) = examiner.poll_send() {
        if let Some(happening) = sockets.send(&send) {
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
