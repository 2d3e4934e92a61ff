//! A socket that sends with any source id.

use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::codec::Message;
use jaus::wire::{Frame, judp};

use jaus_test_kit::hosts::SETTINGS;

use super::clients::{ECHO, VEHICLE};
use crate::testbed::TO_STRANGERS;

/// Sends with any source id, and counts the octets received.
pub(crate) struct Attacker {
    socket: UdpSocket,
    /// Sends a copy of everything to the echo socket, if set.
    echo: Option<UdpSocket>,
    sequence: u16,
    /// Divides the time of an attack.
    hurry: u32,
    pub(crate) packets: u64,
    octets: u64,
}

impl Attacker {
    /// Aims at the port of JUDP for as long as the attack says; with the setting `brief:PORT`, at
    /// that port for a quarter of the time.
    pub(crate) fn new() -> Self {
        Self::from(([10, 217, 0, 9], judp::PORT).into())
    }

    /// Like [`new`](Self::new), with an address of its own.
    pub(crate) fn from(own: SocketAddr) -> Self {
        let port = std::env::var(SETTINGS).ok();
        let port = port.and_then(|it| it.strip_prefix("brief:")?.parse().ok());
        let victim = TO_STRANGERS.parse().unwrap();
        let victim = SocketAddr::new(victim, port.unwrap_or(judp::PORT));
        let hurry = if port.is_some() { 4 } else { 1 };
        Self {
            hurry,
            ..Self::between(own, victim)
        }
    }

    pub(crate) fn between(own: SocketAddr, victim: SocketAddr) -> Self {
        let socket = UdpSocket::bind(own).unwrap();
        socket.connect(victim).unwrap();
        socket.set_nonblocking(true).unwrap();
        Self {
            socket,
            echo: None,
            sequence: 0,
            hurry: 1,
            packets: 0,
            octets: 0,
        }
    }

    /// Sends every datagram also to the echo socket on the vehicle's host.
    pub(crate) fn with_echo(mut self) -> Self {
        let echo = UdpSocket::bind(("10.217.0.10", 0)).unwrap();
        echo.connect((TO_STRANGERS, ECHO)).unwrap();
        self.echo = Some(echo);
        self
    }

    pub(crate) fn send<M: Message>(&mut self, source: JausId, message: &M) {
        let payload = message.encode().unwrap();
        self.sequence = self.sequence.wrapping_add(1);
        self.send_frame(&Frame {
            sequence: self.sequence,
            ..Frame::new(source, VEHICLE, payload)
        });
    }

    pub(crate) fn send_frame(&mut self, frame: &Frame) {
        self.send_octets(&judp::encode(frame).unwrap());
    }

    pub(crate) fn send_octets(&mut self, datagram: &[u8]) {
        // Datagrams that the kernel refuses are lost.
        let _ = self.socket.send(datagram);
        self.packets += 1;
        if let Some(echo) = &self.echo {
            let _ = echo.send(datagram);
        }
    }

    /// Counts received octets; nothing is answered.
    pub(crate) fn listen(&mut self) {
        let mut buffer = [0; 65_535];
        while let Ok(length) = self.socket.recv(&mut buffer) {
            self.octets += length as u64;
        }
    }

    /// Repeats an action at a rate per second, and receives in between.
    pub(crate) fn repeat(
        &mut self,
        time: Duration,
        rate: u32,
        mut act: impl FnMut(&mut Self, u32),
    ) {
        let time = time / self.hurry;
        let (begun, mut number) = (Instant::now(), 0);
        println!("\nbegun");
        while begun.elapsed() < time {
            while number < (begun.elapsed().as_secs_f64() * f64::from(rate)) as u32 {
                act(self, number);
                number += 1;
            }
            self.listen();
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Adds the counters of another attacker.
    pub(crate) fn add(&mut self, other: &Self) {
        self.packets += other.packets;
        self.octets += other.octets;
    }

    pub(crate) fn report(&self) {
        println!("\nattack packets={} octets={}", self.packets, self.octets);
    }
}
