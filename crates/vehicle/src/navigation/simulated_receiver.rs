//! A simulated GNSS receiver: the sentences that a real one would write.

use std::time::{Duration, Instant};

use super::{Course, Quality};
use crate::motion::GlobalPose;

/// Writes sentences (NMEA 0183) for true poses. Its clock shows midnight at the first one.
#[derive(Debug, Clone)]
pub struct SimulatedReceiver {
    /// How positions are determined.
    pub quality: Quality,
    /// Horizontal dilution of precision.
    pub hdop: f64,
    midnight: Option<Instant>,
}

impl Default for SimulatedReceiver {
    /// Precise: with the phase of the carrier, and a dilution of 0.8.
    fn default() -> Self {
        Self {
            quality: Quality::RtkFixed,
            hdop: 0.8,
            midnight: None,
        }
    }
}

impl SimulatedReceiver {
    /// The sentences of a position, and of the motion over ground if there is any. An unknown
    /// altitude is 0.
    #[must_use]
    pub fn fix(&mut self, now: Instant, place: &GlobalPose, course: Option<Course>) -> String {
        let quality = match self.quality {
            Quality::Autonomous => 1,
            Quality::Differential => 2,
            Quality::RtkFixed => 4,
            Quality::RtkFloat => 5,
        };
        let time = self.time(now);
        let latitude = minutes(place.latitude);
        let north = if place.latitude < 0.0 { "S" } else { "N" };
        let longitude = minutes(place.longitude);
        let east = if place.longitude < 0.0 { "W" } else { "E" };
        let hdop = self.hdop;
        let altitude = if place.altitude.is_finite() {
            place.altitude
        } else {
            0.0
        };
        let mut sentences = sentence(&format!(
            "GNGGA,{time},{latitude:0>11},{north},{longitude:0>12},{east},{quality},12,{hdop:.2},\
             {altitude:.1},M,0.0,M,,"
        ));
        if let Some(Course { speed, direction }) = course {
            let knots = speed * 3600.0 / 1852.0;
            let degrees = direction.to_degrees().rem_euclid(360.0);
            sentences += &sentence(&format!("GNVTG,{degrees:.2},T,,M,{knots:.3},N,,K,A"));
        }
        sentences
    }

    /// The sentence of a receiver without a fix.
    #[must_use]
    pub fn no_fix(&mut self, now: Instant) -> String {
        let time = self.time(now);
        sentence(&format!("GNGGA,{time},,,,,0,00,99.99,,M,,M,,"))
    }

    /// The time of day of its clock.
    fn time(&mut self, now: Instant) -> String {
        const DAY: u128 = Duration::from_secs(86_400).as_millis();
        let midnight = *self.midnight.get_or_insert(now);
        let millis = now.saturating_duration_since(midnight).as_millis() % DAY;
        let (seconds, rest) = (millis / 1000, millis % 1000);
        let (hours, minutes) = (seconds / 3600, seconds / 60 % 60);
        format!("{hours:02}{minutes:02}{:02}.{rest:03}", seconds % 60)
    }
}

/// A sentence with its checksum and end of line.
fn sentence(body: &str) -> String {
    let sum = body.bytes().fold(0, |sum, octet| sum ^ octet);
    format!("${body}*{sum:02X}\r\n")
}

/// Degrees and minutes: 52.5° are `5230.000000`.
fn minutes(degrees: f64) -> String {
    // In millionths of a minute, so that no minutes are rounded up to 60.
    let micros = (degrees.abs() * 60e6).round() as u64;
    let (whole, rest) = (micros / 60_000_000, micros % 60_000_000);
    format!("{whole}{:02}.{:06}", rest / 1_000_000, rest % 1_000_000)
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;
    use crate::navigation::{Navigation, Receiver};

    #[test]
    fn a_receiver_reads_what_it_writes_everywhere_on_the_globe() {
        let mut simulated = SimulatedReceiver::default();
        let (mut receiver, start) = (Receiver::default(), Instant::now());
        let places = [(52.5, 13.4), (-33.999_999_999, -0.5), (0.0, 179.983_333)];
        for (seconds, (latitude, longitude)) in (1..).zip(places) {
            let now = start + Duration::from_secs(seconds * 40_000);
            let place = GlobalPose {
                latitude,
                longitude,
                altitude: 80.0,
                ..GlobalPose::default()
            };
            let course = Course {
                speed: 1.5,
                direction: -1.0,
            };
            let sentences = simulated.fix(now, &place, Some(course));
            let news = receiver.handle_octets(sentences.as_bytes());
            let [Navigation::Fix(fix), Navigation::Course(read)] = news[..] else {
                panic!("{sentences}: {news:?}");
            };
            assert!((fix.latitude - latitude).abs() < 1e-8, "{sentences}");
            assert!((fix.longitude - longitude).abs() < 1e-8, "{sentences}");
            assert_eq!((fix.quality, fix.altitude), (Quality::RtkFixed, Some(80.0)));
            assert!((read.speed - 1.5).abs() < 1e-3 && (read.direction + 1.0).abs() < 1e-3);
        }
        let lost = simulated.no_fix(start);
        let news = receiver.handle_octets(lost.as_bytes());
        assert_eq!(news, [Navigation::NoFix], "{lost}");
        assert_eq!(receiver.errors(), 0);
    }
}
