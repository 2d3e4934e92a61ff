//! A whole mission over secure links, with what happens to links on the way.
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "the system runs in real time, with sockets of its own"
)]

use std::sync::Arc;
use std::time::Duration;

use tokio::net::UdpSocket;
use tokio::sync::watch;
use tokio::time::sleep;

use super::super::operator::Ending;
use super::super::system::System;
use super::super::{Demo, OwnNetwork, Story, Surprise};
use super::*;

/// Far longer than the mission takes.
const LIMIT: Duration = Duration::from_secs(120);

#[derive(clap::Parser)]
struct Flags {
    #[command(flatten)]
    demo: Demo,
}

/// A NAT between the operator and the relay, which gives it another port whenever it is told to.
struct Nat {
    inside: SocketAddr,
    renew: watch::Sender<()>,
}

impl Nat {
    async fn to(relay: SocketAddr) -> Self {
        let any = ("127.0.0.1", 0);
        let inner = Arc::new(UdpSocket::bind(any).await.unwrap());
        let inside = inner.local_addr().unwrap();
        let (renew, mut renewed) = watch::channel(());
        tokio::spawn(async move {
            let mut outer = UdpSocket::bind(any).await.unwrap();
            let mut client = None;
            let (mut from_client, mut from_relay) = ([0; 65_535], [0; 65_535]);
            loop {
                tokio::select! {
                    Ok((length, from)) = inner.recv_from(&mut from_client) => {
                        client = Some(from);
                        let _ = outer.send_to(&from_client[..length], relay).await;
                    }
                    Ok((length, _)) = outer.recv_from(&mut from_relay) => {
                        if let Some(client) = client {
                            let _ = inner.send_to(&from_relay[..length], client).await;
                        }
                    }
                    Ok(()) = renewed.changed() => outer = UdpSocket::bind(any).await.unwrap(),
                }
            }
        });
        Self { inside, renew }
    }
}

impl SecureLinks {
    async fn restart_relay(&mut self) {
        self.relay.clone().shutdown().await;
        (self.relay, _) = start_relay(&self.keys, self.address).unwrap();
    }
}

#[test]
fn a_mission_arrives_although_the_relay_restarts_and_the_operators_address_changes() {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .unwrap();
    runtime.block_on(async {
        let mut links = SecureLinks::make().unwrap();
        let nat = Nat::to(links.address).await;
        links.entry_of_operator = nat.inside;
        let flags = ["demo", "--headless", "--secure", "--json"];
        let Flags { demo } = clap::Parser::parse_from(flags);
        let mut system = System::new(OwnNetwork::take().unwrap()).secured_by(links);
        let mut story = Story::new(demo.format);
        let operator = demo.start(&mut system, &mut story).await.unwrap();
        let surprise = Surprise {
            scenery: system.scenery(),
            vehicle: demo.planner().vehicle,
        };
        let disturb = async {
            sleep(Duration::from_secs(4)).await;
            nat.renew.send(()).unwrap();
            sleep(Duration::from_secs(3)).await;
            system.links().unwrap().restart_relay().await;
            std::future::pending::<()>().await;
        };
        let mission = async {
            tokio::select! {
                ending = demo.play(operator, surprise, &mut story) => ending.unwrap(),
                () = disturb => unreachable!("it never ends"),
            }
        };
        let ending = tokio::time::timeout(LIMIT, mission).await.unwrap();
        assert_eq!(ending, Ending::Arrived);
        system.stop().await;
    });
}
