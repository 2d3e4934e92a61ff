//! Echo of messages of any size.

use std::net::Ipv4Addr;
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::Outgoing;
use jaus::link::STANDARD_PORT;
use jaus::node::{Node, Port};
use tokio::time::{interval, sleep, timeout};

use super::{Outcome, RoleArguments};

/// The code of a test message: user-defined (AS5710 leaves D000h and above to users), so that no
/// service acts on it.
const TEST: u16 = 0xD7F0;
/// Size of the message by which both sides learn each other's address, in octets.
const GREETING: usize = 16;
/// Time without an answer after which a possibly lost message is sent again.
const AGAIN: Duration = Duration::from_secs(3);
/// Interval of the broadcasts and their content: Query Identification of the subsystem.
const CALL: Duration = Duration::from_secs(2);
const WHO: [u8; 3] = [0x00, 0x2B, 2];
/// Interval of the messages of [`keep`].
const BEAT: Duration = Duration::from_millis(200);

/// A test message: its code, and octets that differ from packet to packet.
fn test(size: usize) -> Bytes {
    let octet = |index: usize| (index.wrapping_mul(7) + index / 251) as u8;
    let mut message: Vec<u8> = (0..size).map(octet).collect();
    message[..2].copy_from_slice(&TEST.to_le_bytes());
    message.into()
}

/// Sends a message, expects it back unchanged, and shuts the node down.
pub(super) async fn send(arguments: &RoleArguments) -> Outcome {
    let (node, port) = open(arguments)?;
    let outcome = there_and_back(port, arguments).await;
    node.shutdown().await;
    outcome
}

async fn there_and_back(mut port: Port, arguments: &RoleArguments) -> Outcome {
    let is_acknowledged = arguments.by != "unacknowledged";
    greet(&mut port, arguments).await?;
    let message = test(arguments.size);
    loop {
        let wait = if is_acknowledged {
            deliver(&port, arguments, message.clone()).await?;
            arguments.within
        } else {
            let outgoing = Outgoing::new(port.id(), arguments.other, message.clone());
            port.send(outgoing).map_err(|error| error.to_string())?;
            AGAIN
        };
        if let Ok(outcome) = timeout(wait, returns(&mut port, arguments, &message)).await {
            outcome?;
            println!("{} octets there and back", message.len());
            return Ok(());
        }
        println!("nothing came back yet");
    }
}

/// Sends a message again and again, and prints each echo.
pub(super) async fn keep(arguments: &RoleArguments) -> Outcome {
    let (_node, mut port) = open(arguments)?;
    let message = test(GREETING);
    loop {
        let outgoing = Outgoing::new(port.id(), arguments.other, message.clone());
        port.send(outgoing).map_err(|error| error.to_string())?;
        if let Ok(outcome) = timeout(AGAIN, returns(&mut port, arguments, &message)).await {
            outcome?;
            println!("report: it came back");
        } else {
            println!("nothing came back");
        }
        sleep(BEAT).await;
    }
}

/// Echoes every test message, acknowledged. Broadcasts a query from time to time, as discovery
/// does, so that a peer that never broadcasts learns our address.
pub(super) async fn echo(arguments: &RoleArguments) -> Outcome {
    let everywhere = (Ipv4Addr::UNSPECIFIED, STANDARD_PORT).into();
    let node = Node::start(arguments.config()?.tcp_listen(everywhere));
    let node = node.map_err(|error| error.to_string())?;
    let mut port = node
        .attach(arguments.id.component())
        .map_err(|error| error.to_string())?;
    println!("listening");
    let mut calls = interval(CALL);
    loop {
        let message = tokio::select! {
            message = port.recv() => message.ok_or("the node has stopped")?,
            _ = calls.tick() => {
                let call = Outgoing::new(port.id(), JausId::EVERYONE, Bytes::from_static(&WHO));
                port.send(call).map_err(|error| error.to_string())?;
                continue;
            }
        };
        if !message.payload.starts_with(&TEST.to_le_bytes()) {
            continue;
        }
        let (length, source) = (message.payload.len(), message.source);
        let is_right = message.payload == test(length);
        println!("{length} octets from {source}, right: {is_right}");
        let back = Outgoing {
            acknowledge: true,
            ..Outgoing::new(port.id(), source, message.payload)
        };
        // A failed echo is ignored.
        let _ = port.send(back);
    }
}

fn open(arguments: &RoleArguments) -> Result<(Node, Port), String> {
    let config = if arguments.by == "tcp" {
        let peer = format!("{}@{}:3794", arguments.other, arguments.address);
        let peer = peer.parse().map_err(|error| format!("{peer}: {error}"))?;
        arguments.config()?.without_udp().tcp_connect(peer)
    } else {
        arguments.config()?
    };
    let node = Node::start(config).map_err(|error| error.to_string())?;
    let port = node
        .attach(arguments.id.component())
        .map_err(|error| error.to_string())?;
    Ok((node, port))
}

/// Exchanges a small message, so that both sides know each other's address and large messages are
/// not multicast.
async fn greet(port: &mut Port, arguments: &RoleArguments) -> Outcome {
    let greeting = test(GREETING);
    loop {
        let outgoing = Outgoing::new(port.id(), arguments.other, greeting.clone());
        port.send(outgoing).map_err(|error| error.to_string())?;
        if let Ok(outcome) = timeout(AGAIN, returns(port, arguments, &greeting)).await {
            return outcome;
        }
    }
}

async fn deliver(port: &Port, arguments: &RoleArguments, message: Bytes) -> Outcome {
    let outgoing = Outgoing::new(port.id(), arguments.other, message);
    port.deliver(outgoing)
        .await
        .map_err(|error| error.to_string())
}

/// Waits for the message to come back; another one of its size is an error.
async fn returns(port: &mut Port, arguments: &RoleArguments, message: &Bytes) -> Outcome {
    while let Some(received) = port.recv().await {
        if received.source != arguments.other || received.payload.len() != message.len() {
            continue;
        }
        if received.payload == *message {
            return Ok(());
        }
        return Err(format!(
            "{} octets came back, and not the same",
            message.len()
        ));
    }
    Err("the node has stopped".to_owned())
}
