//! `jaus vehicle` as a process.

use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};

use jaus::address::JausId;

use crate::support::jaus;
use jaus_test_kit::vehicle_process::VehicleProcess;

/// Id of the vehicle.
pub(crate) const VEHICLE: JausId = JausId::new(2105, 1, 1);

/// A vehicle on the loopback interface; killed when dropped.
pub(crate) struct Vehicle {
    _process: VehicleProcess,
    pub(crate) address: SocketAddr,
    pub(crate) group: SocketAddrV4,
}

impl Vehicle {
    /// Starts it, and waits until it is ready.
    pub(crate) fn start() -> Self {
        let port = free_port();
        let group = SocketAddrV4::new(Ipv4Addr::new(239, 255, 79, 1), free_port());
        let process = VehicleProcess::start(
            jaus()
                .args([
                    "vehicle",
                    "--id",
                    &VEHICLE.to_string(),
                    "--name",
                    "Rover",
                    "--profile",
                    "contest",
                ])
                .args(["--loopback", "--port", &port.to_string()])
                .args(["--group", &group.to_string()]),
        );
        Self {
            _process: process,
            address: SocketAddr::from((Ipv4Addr::LOCALHOST, port)),
            group,
        }
    }
}

fn free_port() -> u16 {
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    socket.local_addr().unwrap().port()
}
