//! Checks of this host without network traffic: interfaces, buffers, clock.
#![expect(
    clippy::disallowed_methods,
    reason = "it is the clock that is looked at"
)]

use std::fs;
use std::time::{Duration, Instant, SystemTime};

use jaus::link::{Group, Interface, interface};
use jaus::node::Config;

use super::finding::Finding;

/// The chosen interfaces, with findings.
pub(super) fn interfaces(config: &Config) -> (Vec<Interface>, Vec<Finding>) {
    const CHECK: &str = "interface";
    let chosen = match config.interfaces.choose(config.ip) {
        Ok(chosen) => chosen,
        Err(error) => return (Vec::new(), vec![Finding::problem(CHECK, error)]),
    };
    let mut findings: Vec<Finding> = chosen.iter().map(|i| carries(config, i)).collect();
    let left_out = interface::list().unwrap_or_default();
    let left_out = left_out.into_iter().filter(|other| {
        other.address.is_ipv4()
            && !other.is_loopback()
            && chosen.iter().all(|one| one.index != other.index)
    });
    findings.extend(left_out.map(|other| {
        let state = if other.up { "not chosen" } else { "down" };
        Finding::ok(
            CHECK,
            format_args!("{} {} is {state}", other.name, other.address),
        )
    }));
    if chosen.iter().all(Interface::is_loopback) {
        findings.push(
            Finding::ok(
                CHECK,
                "only loopback is used: nodes of other hosts are out of reach",
            )
            .advice("if they are meant: bring a network up, or leave --loopback out"),
        );
    }
    (chosen, findings)
}

fn carries(config: &Config, interface: &Interface) -> Finding {
    const CHECK: &str = "interface";
    let name = format!("{} {}", interface.name, interface.address);
    if interface.multicast {
        return Finding::ok(CHECK, format_args!("{name} is up and carries multicast"));
    }
    if config.group == Group::Off {
        return Finding::ok(CHECK, format_args!("{name} is up; multicast is turned off"));
    }
    if interface.broadcast.is_some() {
        return Finding::warning(
            CHECK,
            format_args!("{name} carries no multicast; the network's broadcast address is used"),
        )
        .advice(format_args!(
            "`ip link set {} multicast on` if others use multicast, or name them with --peer",
            interface.name
        ));
    }
    Finding::warning(
        CHECK,
        format_args!("{name} carries neither multicast nor broadcasts: nobody is found there"),
    )
    .advice("name the nodes behind it with --peer ADDRESS (peers in a settings file)")
}

/// Checks whether the kernel grants the requested buffer sizes.
pub(super) fn buffers(config: &Config) -> Option<Finding> {
    const CHECK: &str = "buffers";
    const LIMIT: &str = "/proc/sys/net/core/rmem_max";
    let limit: usize = fs::read_to_string(LIMIT).ok()?.trim().parse().ok()?;
    let wanted = config.receive_buffer;
    if limit >= wanted {
        return Some(Finding::ok(
            CHECK,
            format_args!("the kernel allows receive buffers of {limit} octets"),
        ));
    }
    let what = format_args!(
        "receive buffers are limited to {limit} octets, {wanted} are asked for: bursts and large \
         messages may get lost"
    );
    Some(Finding::warning(CHECK, what).advice(format_args!(
        "`sudo sysctl -w net.core.rmem_max={wanted}`, and in /etc/sysctl.d to keep it"
    )))
}

/// Compares the time of day with the monotonic clock.
pub(super) struct ClockWatch {
    started: Instant,
    told: SystemTime,
}

impl ClockWatch {
    pub(super) fn start() -> Self {
        Self {
            started: Instant::now(),
            told: SystemTime::now(),
        }
    }

    pub(super) fn finish(self) -> Finding {
        let passed = self.started.elapsed();
        let told = match SystemTime::now().duration_since(self.told) {
            Ok(forward) => forward.as_secs_f64(),
            Err(back) => -back.duration().as_secs_f64(),
        };
        let since_1970 = self.told.duration_since(SystemTime::UNIX_EPOCH);
        clock(since_1970.unwrap_or_default(), told - passed.as_secs_f64())
    }
}

/// `step` is the lead of the time of day over the monotonic clock, in seconds.
fn clock(since_1970: Duration, step: f64) -> Finding {
    const CHECK: &str = "clock";
    const NTP: &str = "let it follow a time server (`timedatectl set-ntp true`, chrony, or the \
                       vehicle's GNSS)";
    /// 2025-01-01, before this program was written.
    const PLAUSIBLE: Duration = Duration::from_secs(1_735_689_600);
    /// More than slewing changes within a moment.
    const STEP: f64 = 0.05;
    if since_1970 < PLAUSIBLE {
        return Finding::warning(
            CHECK,
            "the clock of this host was never set: it is before 2025",
        )
        .advice(NTP);
    }
    if step.abs() > STEP {
        let what = format_args!("the clock of this host was just set by {step:.2} s");
        return Finding::warning(CHECK, what).advice(
            "time stamps of before and after do not fit together; wait until it is stable",
        );
    }
    Finding::ok(CHECK, "the time of day is plausible and runs steadily")
}

#[cfg(test)]
mod tests {
    use super::super::finding::Mark;
    use super::*;

    #[test]
    fn a_clock_that_was_never_set_or_jumps_is_noticed() {
        let now = Duration::from_secs(1_800_000_000);
        assert_eq!(clock(now, 0.01).mark, Mark::Ok);
        assert_eq!(clock(now, -0.2).mark, Mark::Warning);
        assert_eq!(clock(Duration::from_secs(9), 0.0).mark, Mark::Warning);
    }
}
