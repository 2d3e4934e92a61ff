//! `jaus doctor --peer`: one peer is recognised, and the exchanges are tried with it one by one, so
//! that the first that fails can be named with its likely cause.
//!
//! [`examiner`] decides what is asked and judges what comes, without sockets and clock;
//! [`sockets`] carries it.

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
mod sockets;
mod standing;
mod target;
#[cfg(test)]
mod tests;
mod transfer;

use std::time::Duration;

use jaus::address::JausId;
use jaus::link::{Interface, Interfaces, interface};
use jaus::node::Config;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::{Output, say};
use jaus_cli::runtime;
use tokio::time::{Instant, sleep_until};

use self::case::Settings;
use self::examiner::Examiner;
pub(super) use self::sockets::RA_GROUP;
use self::sockets::{Happening, Sockets};
pub(super) use self::target::Target;

/// How long to wait for a first sign if nobody says: JAUS++ speaks to everybody every 5 s.
const LISTEN: Duration = Duration::from_secs(6);

/// Options of an examination, and how its result is shown.
pub(super) struct Options {
    pub(super) target: Target,
    /// How long to wait for a first sign.
    pub(super) listen: Option<Duration>,
    /// Whether control may be taken.
    pub(super) control: bool,
    pub(super) json: bool,
    pub(super) colours: bool,
}

/// Examines the peer. `wanted` is the id that our node is to have.
pub(super) async fn examine(
    options: Options,
    wanted: Option<JausId>,
    config: Config,
) -> Result<Outcome, Failure> {
    let config = config.or_any_free_port();
    let mut sockets = Sockets::open(interfaces(&config, options.target)?, &config)?;
    let local = sockets.local();
    let settings = Settings {
        target: options.target,
        own: JausId::new(config.subsystem, config.node, 1),
        wanted,
        port: local.map_or(0, |local| local.port()),
        no_group: sockets.no_group.take(),
        listen: options.listen.unwrap_or(LISTEN),
        control: options.control,
        payload_limit: config.payload_limit,
    };
    if !options.json {
        let from = local.map_or_else(String::new, |local| format!(" at {local}"));
        let on = sockets.names();
        say(format_args!(
            "asking {} as {}{from} on {on} …",
            options.target, settings.own
        ));
    }
    let mut output = Output::new();
    let mut examiner = Examiner::new(settings);
    let whole = go_on(&mut examiner, &mut sockets, &options, &mut output).await?;
    let case = examiner.case();
    if options.json {
        output.line(report::to_json(case, whole))?;
    } else {
        output.line(report::profile(case))?;
        output.line(format_args!("\n{}", report::conclusion(case, whole)))?;
    }
    Ok(report::outcome(case, whole))
}

/// The interfaces on which the peer may be: the one that leads to its address, or else all that are
/// chosen.
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
    // Without flags, any interface of the host will do: loopback is not chosen by itself.
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

/// Carries the examination; says whether it came to its end.
#[expect(clippy::disallowed_methods, reason = "an examination has its time")]
async fn go_on(
    examiner: &mut Examiner,
    sockets: &mut Sockets,
    options: &Options,
    output: &mut Output,
) -> Result<bool, Failure> {
    let begun = Instant::now();
    let stop = runtime::end(None);
    tokio::pin!(stop);
    examiner.start(Duration::ZERO);
    loop {
        send(examiner, sockets, begun);
        while let Some((trial, before)) = examiner.poll_trial() {
            let line = report::line(trial, before, options.colours);
            if let Some(line) = line.filter(|_| !options.json) {
                output.line(line)?;
            }
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

/// Sends what is to be sent.
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
        Happening::Refused(refusal) => examiner.handle_refusal(now, refusal),
        Happening::Tcp(answer) => examiner.handle_tcp(now, answer),
    }
}
