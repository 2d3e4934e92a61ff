//! Scripted peers: each has the habits of a known peer, as seen in captures, with its own framing
//! and message encoding, and does only what its role requires.

mod asking;
mod body;
mod echoing;
mod events;
mod frame;
mod habits;
mod speaker;
mod vehicle;

use std::net::Ipv4Addr;
use std::time::Instant;

use crate::suite::ours::{Outcome, RoleArguments};
use asking::Asker;
use habits::Habits;
use speaker::Speaker;

/// Plays a part of a peer: `jauspp drive`.
pub(crate) fn play(peer: &str, part: &str, arguments: &RoleArguments) -> Outcome {
    let habits = Habits::of(peer).ok_or_else(|| format!("no peer {peer}"))?;
    let address: Ipv4Addr = arguments
        .address
        .parse()
        .map_err(|_| "what is our address?".to_owned())?;
    let open = |id| Speaker::open(id, habits, address).map_err(|error| error.to_string());
    let speaker = open(arguments.id)?;
    match part {
        "vehicle" => return vehicle::run(speaker),
        "echo" => return echoing::echo(speaker),
        _ => {}
    }
    let asker = |speaker| Asker {
        speaker,
        other: arguments.other,
        deadline: Instant::now() + arguments.within,
    };
    let mut asks = asker(speaker);
    match part {
        "discover" => asks.discover(),
        "query" => asks.query().map(|velocity| println!("{velocity:.3} m/s")),
        "subscribe-periodic" => asks.periodic(),
        "subscribe-on-change" => asks.on_change(),
        "control" => asks.control(&mut asker(open(arguments.colleague())?)),
        "drive" => asks.drive(),
        "large" => asks.send(arguments.size, arguments.by != "unacknowledged"),
        "keep" => asks.keep(),
        "keep-echo" => asks.keep_echo(),
        other => Err(format!("{peer} has no part {other}")),
    }
}
