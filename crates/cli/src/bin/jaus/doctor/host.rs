//! Checks of this host without network traffic: interfaces, buffers, clock.
#![expect(clippy::disallowed_methods, reason = "checks the clock itself")]

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
                "only the loopback interface is used: nodes on other hosts are out of reach",
            )
            .advice("to reach other hosts, bring up a network interface or omit --loopback"),
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
            format_args!("{name} has no multicast; the subnet's broadcast address is used"),
        )
        .advice(format_args!(
            "run `ip link set {} multicast on` if others use multicast, or name them with --peer",
            interface.name
        ));
    }
    Finding::warning(
        CHECK,
        format_args!("{name} has neither multicast nor broadcast: no nodes are found there"),
    )
    .advice("name the nodes on it with --peer ADDRESS (`peers` in a settings file)")
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
        "the kernel limits receive buffers to {limit} octets, but {wanted} are needed: bursts and \
         large messages may be lost"
    );
    Some(Finding::warning(CHECK, what).advice(format_args!(
        "run `sudo sysctl -w net.core.rmem_max={wanted}`, and set it in /etc/sysctl.d to keep it"
    )))
}

/// Compares the time of day with the monotonic clock.
pub(super) struct ClockWatch {
    started: Instant,
    time_of_day: SystemTime,
}

impl ClockWatch {
    pub(super) fn start() -> Self {
        Self {
            started: Instant::now(),
            time_of_day: SystemTime::now(),
        }
    }

    pub(super) fn finish(self) -> Finding {
        let passed = self.started.elapsed();
        let advanced = match SystemTime::now().duration_since(self.time_of_day) {
            Ok(forward) => forward.as_secs_f64(),
            Err(back) => -back.duration().as_secs_f64(),
        };
        let since_1970 = self.time_of_day.duration_since(SystemTime::UNIX_EPOCH);
        clock(
            since_1970.unwrap_or_default(),
            advanced - passed.as_secs_f64(),
        )
    }
}

/// `step` is the lead of the time of day over the monotonic clock, in seconds.
fn clock(since_1970: Duration, step: f64) -> Finding {
    const CHECK: &str = "clock";
    const NTP: &str = "synchronise it (`timedatectl set-ntp true`, chrony, or the vehicle's GNSS)";
    /// 2025-01-01, before this program was written.
    const PLAUSIBLE: Duration = Duration::from_secs(1_735_689_600);
    /// More than slewing changes within a moment.
    const STEP: f64 = 0.05;
    if since_1970 < PLAUSIBLE {
        return Finding::warning(CHECK, "this host's clock is not set: it is before 2025")
            .advice(NTP);
    }
    if step.abs() > STEP {
        let what = format_args!("this host's clock was just stepped by {step:.2} s");
        return Finding::warning(CHECK, what).advice(
            "timestamps from before and after the step are inconsistent; wait until it is stable",
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
