//! Sentences of a GNSS receiver: NMEA 0183, as far as a vehicle needs it.
//!
//! GGA gives the position, RMC and VTG the course, and GGA, RMC and GSA whether there is a fix at
//! all. The talker (`GP`, `GN`, …) is ignored. A sentence needs a correct checksum; a wrong, cut or
//! unknown sentence is counted and has no other effect.

use std::time::Duration;

/// A position measured by a receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fix {
    /// Time of the measurement since midnight UTC.
    pub time: Duration,
    /// Latitude in degrees, north positive (WGS 84).
    pub latitude: f64,
    /// Longitude in degrees, east positive.
    pub longitude: f64,
    /// Altitude in metres above the ellipsoid, if known.
    pub altitude: Option<f64>,
    /// How the position was determined.
    pub quality: Quality,
    /// Horizontal dilution of precision.
    pub hdop: f64,
}

/// How a position was determined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quality {
    /// By satellites alone.
    Autonomous,
    /// With corrections.
    Differential,
    /// With the phase of the carrier, not all ambiguities resolved.
    RtkFloat,
    /// With the phase of the carrier.
    RtkFixed,
}

impl Fix {
    /// Standard deviation in metres north and east.
    #[must_use]
    pub fn deviation(&self) -> f64 {
        let ranging = match self.quality {
            Quality::Autonomous => 2.5,
            Quality::Differential => 1.0,
            Quality::RtkFloat => 0.3,
            Quality::RtkFixed => 0.02,
        };
        ranging * self.hdop.clamp(0.5, 50.0)
    }
}

/// Motion over ground measured by a receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Course {
    /// Speed in metres per second.
    pub speed: f64,
    /// Direction of motion in radians clockwise from true north.
    pub direction: f64,
}

/// News from a receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Navigation {
    /// A new position.
    Fix(Fix),
    /// A new course.
    Course(Course),
    /// The receiver has no usable position.
    NoFix,
}

/// Reads the octets of a receiver.
///
/// ```
/// use jaus_vehicle::navigation::{Navigation, Receiver};
///
/// let mut receiver = Receiver::default();
/// let sentence = b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n";
/// assert!(matches!(receiver.handle_octets(sentence)[..], [Navigation::Fix(_)]));
/// assert_eq!(receiver.errors(), 0);
/// ```
#[derive(Debug, Default)]
pub struct Receiver {
    /// The sentence being received, from its `$` on.
    sentence: Vec<u8>,
    /// Time of the last fix. A receiver that repeats it has stopped measuring.
    last: Option<Duration>,
    errors: u64,
}

impl Receiver {
    /// The longest sentence. The standard allows 82 characters; some receivers send more digits.
    const LONGEST: usize = 128;

    /// Takes octets in any portions. Returns the news of complete sentences.
    pub fn handle_octets(&mut self, octets: &[u8]) -> Vec<Navigation> {
        octets.iter().filter_map(|&it| self.handle(it)).collect()
    }

    /// Number of sentences that were cut, damaged or invalid.
    #[must_use]
    pub const fn errors(&self) -> u64 {
        self.errors
    }

    fn handle(&mut self, octet: u8) -> Option<Navigation> {
        match octet {
            b'$' => {
                self.errors += u64::from(!self.sentence.is_empty());
                self.sentence = vec![octet];
                None
            }
            b'\r' | b'\n' if self.sentence.is_empty() => None,
            b'\r' | b'\n' => {
                let sentence = std::mem::take(&mut self.sentence);
                let fields = fields(&sentence);
                self.errors += u64::from(fields.is_none());
                self.read(&fields?)
            }
            // Between sentences: other protocols, or the rest of an overlong one.
            _ if self.sentence.is_empty() => None,
            _ if self.sentence.len() >= Self::LONGEST => {
                self.errors += 1;
                self.sentence.clear();
                None
            }
            _ => {
                self.sentence.push(octet);
                None
            }
        }
    }

    fn read(&mut self, fields: &[&str]) -> Option<Navigation> {
        let news = match fields.first()?.get(2..)? {
            "GGA" => gga(fields),
            "RMC" => rmc(fields),
            "VTG" => vtg(fields),
            "GSA" => gsa(fields),
            _ => return None,
        };
        let Some(news) = news else {
            self.errors += 1;
            return None;
        };
        if let Some(Navigation::Fix(fix)) = news
            && self.last.replace(fix.time) == Some(fix.time)
        {
            return None;
        }
        news
    }
}

/// The fields of a sentence with a correct checksum, without `$` and checksum.
fn fields(sentence: &[u8]) -> Option<Vec<&str>> {
    let text = std::str::from_utf8(sentence.get(1..)?).ok()?;
    let (body, sum) = text.rsplit_once('*')?;
    let found = body.bytes().fold(0, |sum, octet| sum ^ octet);
    let is_right = sum.len() == 2 && u8::from_str_radix(sum, 16).ok()? == found;
    is_right.then(|| body.split(',').collect())
}

/// What a sentence says; `Some(None)` if nothing of use, `None` if it is invalid.
type News = Option<Option<Navigation>>;

/// Position: time, latitude, longitude, quality, satellites, HDOP, altitude, height of the geoid.
fn gga(fields: &[&str]) -> News {
    let &[
        _,
        time,
        latitude,
        north,
        longitude,
        east,
        quality,
        _,
        hdop,
        altitude,
        _,
        geoid,
        ..,
    ] = fields
    else {
        return None;
    };
    let quality = match quality {
        "1" | "3" => Quality::Autonomous,
        "2" => Quality::Differential,
        "4" => Quality::RtkFixed,
        "5" => Quality::RtkFloat,
        // None, or estimated, entered by hand or simulated.
        "" | "0" | "6" | "7" | "8" => return Some(Some(Navigation::NoFix)),
        _ => return None,
    };
    Some(Some(Navigation::Fix(Fix {
        time: time_of_day(time)?,
        latitude: degrees(latitude, 90.0)? * sign(north, "N", "S")?,
        longitude: degrees(longitude, 180.0)? * sign(east, "E", "W")?,
        altitude: number(altitude).zip(number(geoid)).map(|(a, b)| a + b),
        quality,
        hdop: number(hdop).filter(|hdop| *hdop > 0.0)?,
    })))
}

/// Motion: time, status, position, speed in knots, course.
fn rmc(fields: &[&str]) -> News {
    let &[_, _, status, _, _, _, _, speed, course, ..] = fields else {
        return None;
    };
    match status {
        "A" => moving(speed, course),
        "V" => Some(Some(Navigation::NoFix)),
        _ => None,
    }
}

/// Motion: course, T, magnetic course, M, speed in knots.
fn vtg(fields: &[&str]) -> News {
    let &[_, course, _, _, _, speed, ..] = fields else {
        return None;
    };
    moving(speed, course)
}

/// Satellites in use: selection, and 1 without a fix, 2 or 3 with one.
fn gsa(fields: &[&str]) -> News {
    match *fields.get(2)? {
        "1" => Some(Some(Navigation::NoFix)),
        "2" | "3" => Some(None),
        _ => None,
    }
}

/// A receiver at rest leaves the course empty.
fn moving(knots: &str, course: &str) -> News {
    const KNOT: f64 = 1852.0 / 3600.0;
    if knots.is_empty() || course.is_empty() {
        return Some(None);
    }
    let (speed, course) = (number(knots)? * KNOT, number(course)?);
    let is_sound = (0.0..=500.0).contains(&speed) && (0.0..=360.0).contains(&course);
    let direction = crate::motion::wrap(course.to_radians());
    is_sound.then_some(Some(Navigation::Course(Course { speed, direction })))
}

/// A number of digits, sign and point. Rust's own syntax also has `inf` and `NaN`.
fn number(text: &str) -> Option<f64> {
    let is_plain = text
        .bytes()
        .all(|it| it.is_ascii_digit() || b".-".contains(&it));
    text.parse().ok().filter(|_| is_plain)
}

/// Degrees and minutes: `5230.1234` are 52° 30.1234'.
fn degrees(text: &str, most: f64) -> Option<f64> {
    let value = number(text).filter(|value| *value >= 0.0)?;
    let (whole, minutes) = ((value / 100.0).floor(), value % 100.0);
    let degrees = whole + minutes / 60.0;
    (minutes < 60.0 && degrees <= most).then_some(degrees)
}

fn sign(text: &str, positive: &str, negative: &str) -> Option<f64> {
    match text {
        it if it == positive => Some(1.0),
        it if it == negative => Some(-1.0),
        _ => None,
    }
}

/// Hours, minutes and seconds: `123519.25`.
fn time_of_day(text: &str) -> Option<Duration> {
    let part = |range| text.get(range).and_then(|it: &str| it.parse::<u32>().ok());
    let (hours, minutes) = (part(0..2)?, part(2..4)?);
    let seconds = number(text.get(4..)?)?;
    let is_sound = hours < 24 && minutes < 60 && (0.0..61.0).contains(&seconds);
    is_sound.then(|| {
        Duration::from_secs(u64::from(hours * 60 + minutes) * 60) + Duration::from_secs_f64(seconds)
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn sentence(body: &str) -> String {
        let sum = body.bytes().fold(0, |sum, octet| sum ^ octet);
        format!("${body}*{sum:02X}\r\n")
    }

    fn read(body: &str) -> (Vec<Navigation>, u64) {
        let mut receiver = Receiver::default();
        let news = receiver.handle_octets(sentence(body).as_bytes());
        (news, receiver.errors())
    }

    const GGA: &str = "GNGGA,123519.50,5230.0000,N,01324.0000,W,1,08,0.9,35.4,M,44.6,M,,";

    #[test]
    fn a_position_is_read_whole_and_in_pieces() {
        let (news, _) = read(GGA);
        let Some(Navigation::Fix(fix)) = news.first() else {
            panic!("{news:?}");
        };
        assert_eq!((fix.latitude, fix.longitude), (52.5, -13.4));
        assert_eq!(fix.time, Duration::from_millis(45_319_500));
        assert!((fix.altitude.unwrap() - 80.0).abs() < 1e-9);
        assert!((fix.deviation() - 2.25).abs() < 1e-9);
        let mut receiver = Receiver::default();
        let pieces = sentence(GGA);
        let pieces = pieces.as_bytes().chunks(7);
        let in_pieces: Vec<_> = pieces.flat_map(|it| receiver.handle_octets(it)).collect();
        assert_eq!(in_pieces, news);
    }

    #[test]
    fn the_course_comes_from_both_sentences_and_only_in_motion() {
        let course = |body| match read(body) {
            (news, 0) => news,
            other => panic!("{other:?}"),
        };
        let rmc = course("GPRMC,123519,A,4807.038,N,01131.000,E,010.0,090.0,230394,003.1,W");
        let vtg = course("GPVTG,090.0,T,,M,010.0,N,018.5,K,A");
        assert_eq!(rmc, vtg);
        let [Navigation::Course(course_over_ground)] = rmc[..] else {
            panic!("{rmc:?}");
        };
        assert!((course_over_ground.speed - 5.144).abs() < 1e-3);
        assert!((course_over_ground.direction - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
        assert_eq!(course("GPVTG,,T,,M,0.0,N,0.0,K,A"), []);
    }

    #[test]
    fn without_a_fix_every_sentence_says_so() {
        for body in [
            "GPGGA,,,,,,0,00,99.99,,,,,,",
            "GPGGA,123519,4807.038,N,01131.000,E,8,08,0.9,545.4,M,46.9,M,,",
            "GPRMC,123519,V,,,,,,,230394,,",
            "GPGSA,A,1,,,,,,,,,,,,,99.99,99.99,99.99",
        ] {
            assert_eq!(read(body), (vec![Navigation::NoFix], 0), "{body}");
        }
    }

    #[test]
    fn what_is_damaged_is_counted_and_never_a_position() {
        let good = sentence(GGA);
        for bad in [
            good.replace("5230", "5330"),
            good[..30].to_owned() + "\r\n",
            good.replace('*', ""),
            sentence(&GGA.replace("5230.0000", "9930.0000")),
            sentence(&GGA.replace("5230.0000", "5260.0000")),
            sentence(&GGA.replace("5230.0000", "NaN")),
            sentence(&GGA.replace("123519.50", "253519.50")),
            sentence(&GGA.replace(",0.9,", ",,")),
            sentence("GNGGA,123519"),
        ] {
            let mut receiver = Receiver::default();
            assert_eq!(receiver.handle_octets(bad.as_bytes()), [], "{bad}");
            assert_eq!(receiver.errors(), 1, "{bad}");
            let next = receiver.handle_octets(good.as_bytes());
            assert_eq!(next.len(), 1, "the next one is read: {bad}");
        }
    }

    #[test]
    fn half_a_sentence_does_not_spoil_the_next_one() {
        let mut receiver = Receiver::default();
        let good = sentence(GGA);
        let cut = format!("{}{good}", &good[..20]);
        assert_eq!(receiver.handle_octets(cut.as_bytes()).len(), 1);
        let flood = [b"$".as_slice(), &[b'A'; 10_000], b"\r\n"].concat();
        assert_eq!(receiver.handle_octets(&flood), []);
        let later = good.replace("19.50", "20.50");
        let later = sentence(&later[1..later.len() - 5]);
        assert_eq!(receiver.handle_octets(later.as_bytes()).len(), 1);
    }

    #[test]
    fn a_receiver_that_repeats_itself_measures_nothing_new() {
        let mut receiver = Receiver::default();
        let good = sentence(GGA);
        assert_eq!(receiver.handle_octets(good.as_bytes()).len(), 1);
        assert_eq!(receiver.handle_octets(good.as_bytes()), []);
    }

    proptest! {
        #[test]
        fn no_octets_panic_and_every_position_is_on_the_globe(
            octets in prop::collection::vec(any::<u8>(), 0..300),
            fields in prop::collection::vec("[-0-9.NSEWAV]{0,9}", 0..16),
            kind in prop::sample::select(vec!["GPGGA", "GNRMC", "GPVTG", "GAGSA"]),
        ) {
            let mut receiver = Receiver::default();
            receiver.handle_octets(&octets);
            let body = format!("{kind},{}", fields.join(","));
            for news in receiver.handle_octets(sentence(&body).as_bytes()) {
                if let Navigation::Fix(fix) = news {
                    prop_assert!(fix.latitude.abs() <= 90.0 && fix.longitude.abs() <= 180.0);
                    prop_assert!(fix.deviation().is_finite());
                }
            }
        }
    }
}
