//! Echo of messages of any size.

use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::Outgoing;
use jaus::node::{Node, Port};
use tokio::time::{interval, sleep, timeout};

use super::{Outcome, RoleArguments};

/// The code of a test message: user-defined (AS5710 leaves D000h and above to users), so that no
/// service acts on it.
const TEST: u16 = 0xD7F0;
/// Octets of the message that makes each side known to the other.
const GREETING: usize = 16;
/// After this long without an answer, what may have been lost is sent again.
const AGAIN: Duration = Duration::from_secs(3);
/// Between two calls of everybody, and the words: Query Identification of the subsystem.
const CALL: Duration = Duration::from_secs(2);
const WHO: [u8; 3] = [0x00, 0x2B, 2];
/// Between two messages of [`keep`].
const BEAT: Duration = Duration::from_millis(200);

/// A test message: its code, and octets that are never the same in two packets.
fn test(size: usize) -> Bytes {
    let octet = |index: usize| (index.wrapping_mul(7) + index / 251) as u8;
    let mut message: Vec<u8> = (0..size).map(octet).collect();
    message[..2].copy_from_slice(&TEST.to_le_bytes());
    message.into()
}

/// Sends a message, gets it back as it was, and takes leave.
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

/// Has messages come back again and again, and tells of each.
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

/// Sends every test message back, acknowledged. Calls everybody now and then, as discovery does, so
/// that who calls nobody knows where we are.
pub(super) async fn echo(arguments: &RoleArguments) -> Outcome {
    let everywhere = "0.0.0.0".parse().map_err(|error| format!("{error}"))?;
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
        // A late answer is ignored.
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

/// Makes both known to each other, so that what is large does not go to everybody.
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

/// Waits until the message has come back, and nothing else of its size.
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
