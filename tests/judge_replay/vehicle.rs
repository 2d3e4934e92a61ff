//! `jaus vehicle`, in a process of its own.

use std::io::{BufRead, BufReader};
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::process::{Child, Stdio};

use jaus::address::JausId;

use crate::cli_support::jaus;

/// Who the vehicle is.
pub(crate) const VEHICLE: JausId = JausId::new(2105, 1, 1);

/// A vehicle on the loopback interface; killed when dropped.
pub(crate) struct Vehicle {
    child: Child,
    pub(crate) address: SocketAddr,
    pub(crate) group: SocketAddrV4,
}

impl Vehicle {
    /// Starts it, and waits until it is there.
    pub(crate) fn start() -> Self {
        let port = free_port();
        let group = SocketAddrV4::new(Ipv4Addr::new(239, 255, 79, 1), free_port());
        let mut child = jaus()
            .args(["vehicle", "--id", &VEHICLE.to_string(), "--name", "Rover"])
            .args(["--loopback", "--port", &port.to_string()])
            .args(["--group", &group.to_string()])
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        let mut introduction = String::new();
        while !introduction.contains("Ctrl-C") {
            let read = stdout.read_line(&mut introduction).unwrap();
            assert_ne!(read, 0, "the vehicle has ended: {introduction}");
        }
        // It may go on talking.
        std::thread::spawn(move || stdout.lines().map_while(Result::ok).for_each(drop));
        Self {
            child,
            address: SocketAddr::from((Ipv4Addr::LOCALHOST, port)),
            group,
        }
    }
}

impl Drop for Vehicle {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn free_port() -> u16 {
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    socket.local_addr().unwrap().port()
}
