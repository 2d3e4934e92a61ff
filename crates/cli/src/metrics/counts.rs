//! The metrics of counters with names: those of the endpoint, and those of links of other crates.

use std::collections::BTreeMap;

use jaus::counters::Count;

use super::exposition::{Exposition, Unit};

/// The counters of one metric: the sums for each reason, or one without a reason.
struct Family {
    help: String,
    sums: BTreeMap<Option<&'static str>, u64>,
}

/// Adds the counters of a part. The names of their metrics begin with `prefix`. Counters that only
/// differ in their reason are one metric.
pub(super) fn add(
    exposition: &mut Exposition,
    prefix: &str,
    counts: impl IntoIterator<Item = Count>,
) {
    let mut families = BTreeMap::new();
    for count in counts {
        let (name, help, reason) = match count.description.split_once(": ") {
            Some((events, reason)) => (snake_case(events), help(events), Some(reason)),
            None => {
                let help = format!("Count of {}.", count.description);
                (snake_case(count.name), help, None)
            }
        };
        let sums = BTreeMap::new();
        let family = families.entry(name).or_insert(Family { help, sums });
        *family.sums.entry(reason).or_default() += count.value;
    }
    for (name, Family { help, sums }) in families {
        let mut family = exposition.counter(&format!("{prefix}_{name}"), Unit::None, &help);
        for (reason, sum) in sums {
            match reason {
                Some(reason) => family.add(&[("reason", &reason)], sum),
                None => family.add(&[], sum),
            }
        }
    }
}

/// The description of a metric with reasons.
fn help(events: &str) -> String {
    let what = match events {
        "dropped" => "received messages and datagrams that were dropped",
        "not sent" => "messages and datagrams that were not sent",
        "not forwarded" => "messages for other nodes that were not forwarded",
        events => events,
    };
    format!("Count of {what}, by reason.")
}

/// A part of a metric's name: `datagrams_received` for `DatagramsReceived`, `not_sent` for
/// `not sent`.
pub(super) fn snake_case(name: &str) -> String {
    let mut snake = String::new();
    for c in name.chars() {
        let begins = c.is_ascii_uppercase() || !c.is_ascii_alphanumeric();
        if begins && !snake.is_empty() && !snake.ends_with('_') {
            snake.push('_');
        }
        if c.is_ascii_alphanumeric() {
            snake.push(c.to_ascii_lowercase());
        }
    }
    snake
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::exposition::Format;

    fn count(name: &'static str, description: &'static str, value: u64) -> Count {
        Count {
            name,
            description,
            value,
        }
    }

    #[test]
    fn counters_that_differ_in_their_reason_are_one_metric() {
        let counts = [
            count("Forged", "beacons ignored: wrong signature", 3),
            count("BeaconsAccepted", "beacons accepted", 1),
            count("Own", "beacons ignored: own", 2),
            count("Forged", "beacons ignored: wrong signature", 4),
        ];
        let mut exposition = Exposition::new(Format::Prometheus);
        add(&mut exposition, "jaus_secure", counts);
        let expected = "# HELP jaus_secure_beacons_accepted_total Count of beacons accepted.\n\
            # TYPE jaus_secure_beacons_accepted_total counter\n\
            jaus_secure_beacons_accepted_total 1\n\
            # HELP jaus_secure_beacons_ignored_total Count of beacons ignored, by reason.\n\
            # TYPE jaus_secure_beacons_ignored_total counter\n\
            jaus_secure_beacons_ignored_total{reason=\"own\"} 2\n\
            jaus_secure_beacons_ignored_total{reason=\"wrong signature\"} 7\n";
        assert_eq!(exposition.finish(), expected);
    }

    #[test]
    fn names_have_only_characters_that_prometheus_allows() {
        for (name, expected) in [
            ("DatagramsReceived", "datagrams_received"),
            ("NotAs5669a", "not_as5669a"),
            ("not sent", "not_sent"),
            ("my-link 2", "my_link_2"),
            ("Link-A", "link_a"),
        ] {
            assert_eq!(snake_case(name), expected);
        }
    }
}
