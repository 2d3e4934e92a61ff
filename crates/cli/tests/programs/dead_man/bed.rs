//! The vehicle and the operator's station of the end-to-end tests, with their motors on a serial line, and the
//! operator's browser on a host of its own, behind a relay.
//!
//! ```text
//!  browser on Xvfb ── relay ── station ── communicator ── drivers ── motors
//! ```

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

use jaus_test_kit::hosts::{add_host, ip, on_host};
use jaus_test_kit::waiting::block_until;

use super::motor::Motors;
use super::relay::{Conditions, Relay};
use crate::e2e::browser::Browser;
use crate::e2e::system::System;

/// The station's address on the browser's side.
const STATION: &str = "10.219.1.2";
/// Its interface there.
const PAGE_INTERFACE: &str = "page";
const TOKEN: &str = "dead-man-table-0123456789";
/// Hardware addresses of the two ends, written into both hosts: no address resolution that could be lost.
const ENDS: [&str; 2] = ["02:00:00:00:00:01", "02:00:00:00:00:02"];

/// Conditions of the link in both directions: from the browser, and back.
pub(crate) type BothWays = [Conditions; 2];
pub(crate) const CLEAR: BothWays = [Conditions::CLEAR; 2];

/// All hosts and processes; removed when dropped.
pub(crate) struct Bed {
    pub(crate) link: Relay,
    pub(crate) motors: Motors,
    pub(crate) display: Display,
    names: [String; 2],
    // After the relay and the display, which use its hosts.
    system: System,
    _token: tempfile::NamedTempFile,
}

impl Bed {
    /// Creates the hosts and starts the programs.
    ///
    /// # Errors
    /// If this machine does not permit it.
    pub(crate) fn new() -> Result<Self, String> {
        let motors = Motors::new();
        let token = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(token.path(), TOKEN).unwrap();
        let file = token.path().to_str().unwrap();
        let address = format!("{STATION}:8080");
        let station = [
            "--listen",
            &address,
            "--token-file",
            file,
            "--interface",
            "vehicle",
        ];
        let system = System::new()?
            .with_flags("jaus-primitive-driver", &["--sabertooth", motors.device()])
            .with_flags("jaus-ocu", &station);
        let names = ["browser", "relay"].map(|it| format!("{}-{it}", system.operator()));
        set_up(&names, system.operator())?;
        let link = Relay::start(&names[1], ["browser", "station"])?;
        system.start_all();
        // Chromium drops its requests when the interfaces get their IPv6 addresses.
        sleep(Duration::from_secs(3));
        Ok(Self {
            link,
            motors,
            display: Display::start(&names[0])?,
            names,
            system,
            _token: token,
        })
    }

    /// The address of the page, with the token.
    pub(crate) fn page(&self) -> String {
        format!("http://{STATION}:8080/#token={TOKEN}")
    }

    /// How long after this time the primitive driver's last emergency began.
    pub(crate) fn emergency_after(&self, time: SystemTime) -> Option<Duration> {
        let log = self.system.log("jaus-primitive-driver");
        let line = log
            .lines()
            .rfind(|it| it.contains("the state is emergency"))?;
        // For example 2026-11-28T04:51:04.346374Z.
        let (_, clock) = line.split_once('T')?;
        let mut parts = clock.split_once('Z')?.0.split(':').map(str::parse::<f64>);
        let mut part = || parts.next()?.ok();
        let began = part()? * 3600.0 + part()? * 60.0 + part()?;
        let since_1970 = time.duration_since(SystemTime::UNIX_EPOCH).ok()?;
        let time = since_1970.as_secs_f64() % 86_400.0;
        Some(Duration::from_secs_f64((began - time).rem_euclid(86_400.0)))
    }

    /// A browser on the display.
    pub(crate) fn browser(&self) -> Browser {
        let origin = format!("--unsafely-treat-insecure-origin-as-secure=http://{STATION}:8080");
        let flags = [
            "--test-type",
            "--window-position=0,0",
            "--window-size=1280,900",
            // A covered window must not be slower than one in front.
            "--disable-backgrounding-occluded-windows",
            &origin,
        ];
        let display = [("DISPLAY", self.display.name.as_str())];
        Browser::start_with(Some(&self.names[0]), &flags, &display)
    }
}

impl Drop for Bed {
    fn drop(&mut self) {
        for name in &self.names {
            // Missing if the setup failed halfway.
            let _ = ip(&["netns", "delete", name]);
        }
    }
}

/// Creates the hosts of the browser and of the relay, and the cables to the station.
fn set_up(names: &[String; 2], station: &str) -> Result<(), String> {
    let [browser, relay] = names;
    add_host(browser)?;
    add_host(relay)?;
    let ends = [
        (browser.as_str(), "browser", "10.219.1.1"),
        (station, "station", STATION),
    ];
    for ((host, cable, address), hardware) in ends.into_iter().zip(ENDS) {
        let peer = ["peer", "name", cable, "netns", relay];
        let link = ["link", "add", PAGE_INTERFACE, "netns", host, "type", "veth"];
        ip(&[&link[..], &peer].concat())?;
        let page = ["-n", host, "link", "set", PAGE_INTERFACE];
        // Packets are no larger than on a real cable.
        ip(&[&page[..], &["address", hardware, "gso_max_segs", "1"]].concat())?;
        let address = format!("{address}/24");
        ip(&[
            "-n",
            host,
            "address",
            "add",
            &address,
            "dev",
            PAGE_INTERFACE,
        ])?;
        ip(&[&page[..], &["up"]].concat())?;
        ip(&["-n", relay, "link", "set", cable, "up"])?;
    }
    let far = [
        (browser.as_str(), STATION, ENDS[1]),
        (station, "10.219.1.1", ENDS[0]),
    ];
    for (host, address, hardware) in far {
        let neighbour = ["neighbour", "add", address, "lladdr", hardware];
        let place = ["dev", PAGE_INTERFACE, "nud", "permanent"];
        ip(&[&["-n", host], &neighbour[..], &place].concat())?;
    }
    Ok(())
}

/// A display without a screen; closed when dropped.
pub(crate) struct Display {
    server: Child,
    name: String,
}

impl Display {
    fn start(host: &str) -> Result<Self, String> {
        let mut command = on_host(host, "Xvfb");
        // Left to itself, it would take over the socket of another measurement: it sees only those of its own host.
        let own = format!(":{}", 100 + std::process::id() % 50_000);
        command.args([
            &own,
            "-displayfd",
            "1",
            "-screen",
            "0",
            "1280x900x24",
            "-nolisten",
            "tcp",
        ]);
        let command = command.stdout(Stdio::piped()).stderr(Stdio::null());
        let mut server = command.spawn().map_err(|error| format!("Xvfb: {error}"))?;
        let mut number = String::new();
        let said = BufReader::new(server.stdout.take().unwrap()).read_line(&mut number);
        let name = format!(":{}", number.trim());
        match said {
            Ok(1..) => Ok(Self { server, name }),
            _ => Err("Xvfb did not say its display".to_owned()),
        }
    }

    /// Sends real input events by xdotool.
    pub(crate) fn input(&self, words: &str) {
        let mut command = Command::new("xdotool");
        command.args(words.split(' ')).env("DISPLAY", &self.name);
        let done = command.status().expect("xdotool is installed");
        assert!(done.success(), "xdotool {words}");
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// Waits until a condition holds, but not longer than `limit`.
pub(crate) fn within(limit: Duration, mut holds: impl FnMut() -> bool) -> bool {
    let deadline = Instant::now() + limit;
    let mut held = false;
    block_until(|| {
        held = holds();
        held || Instant::now() > deadline
    });
    held
}
