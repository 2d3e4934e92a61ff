//! The text in which Prometheus reads metrics: OpenMetrics 1.0, or the older Prometheus text format
//! 0.0.4, which only differs in details.

use std::fmt::{self, Display, Write as _};

/// A text format.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Format {
    /// Prometheus text format 0.0.4.
    #[default]
    Prometheus,
    /// OpenMetrics 1.0.
    OpenMetrics,
}

impl Format {
    /// The format for the value of a header `Accept`.
    pub(super) fn accepted(accept: &str) -> Self {
        match accept.contains("application/openmetrics-text") {
            true => Self::OpenMetrics,
            false => Self::Prometheus,
        }
    }

    pub(super) const fn content_type(self) -> &'static str {
        match self {
            Self::Prometheus => "text/plain; version=0.0.4; charset=utf-8",
            Self::OpenMetrics => "application/openmetrics-text; version=1.0.0; charset=utf-8",
        }
    }
}

/// The type of a metric.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Only grows; its samples end in `_total`.
    Counter,
    Gauge,
}

impl Kind {
    const fn name(self) -> &'static str {
        match self {
            Self::Counter => "counter",
            Self::Gauge => "gauge",
        }
    }
}

/// The unit of a metric, which ends its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unit {
    /// A count or a state.
    None,
    Seconds,
    Bytes,
    Ratio,
    MetersPerSecond,
}

impl Unit {
    const fn name(self) -> Option<&'static str> {
        match self {
            Self::None => None,
            Self::Seconds => Some("seconds"),
            Self::Bytes => Some("bytes"),
            Self::Ratio => Some("ratio"),
            Self::MetersPerSecond => Some("meters_per_second"),
        }
    }
}

/// Metrics of one moment, as text.
#[derive(Debug)]
pub(super) struct Exposition {
    format: Format,
    text: String,
}

impl Exposition {
    pub(super) const fn new(format: Format) -> Self {
        Self {
            format,
            text: String::new(),
        }
    }

    /// Begins a family of counters. `name` has neither its unit nor `_total`.
    pub(super) fn counter(&mut self, name: &str, unit: Unit, help: &str) -> Family<'_> {
        self.family(Kind::Counter, name, unit, help)
    }

    /// Begins a family of gauges. `name` does not have its unit.
    pub(super) fn gauge(&mut self, name: &str, unit: Unit, help: &str) -> Family<'_> {
        self.family(Kind::Gauge, name, unit, help)
    }

    fn family(&mut self, kind: Kind, name: &str, unit: Unit, help: &str) -> Family<'_> {
        let family = match unit.name() {
            Some(unit) => format!("{name}_{unit}"),
            None => name.to_owned(),
        };
        let sample = match kind {
            Kind::Counter => format!("{family}_total"),
            Kind::Gauge => family.clone(),
        };
        let described = match self.format {
            Format::Prometheus => &sample,
            Format::OpenMetrics => &family,
        };
        let (help, kind) = (Escaped(help), kind.name());
        self.line(format_args!("# HELP {described} {help}"));
        self.line(format_args!("# TYPE {described} {kind}"));
        if let (Format::OpenMetrics, Some(unit)) = (self.format, unit.name()) {
            self.line(format_args!("# UNIT {family} {unit}"));
        }
        Family {
            exposition: self,
            sample,
        }
    }

    /// The whole text.
    pub(super) fn finish(mut self) -> String {
        if self.format == Format::OpenMetrics {
            self.text.push_str("# EOF\n");
        }
        self.text
    }

    fn line(&mut self, line: impl Display) {
        // A string takes any text.
        let _ = writeln!(self.text, "{line}");
    }
}

/// One metric, with a sample for each set of labels.
#[derive(Debug)]
pub(super) struct Family<'e> {
    exposition: &'e mut Exposition,
    sample: String,
}

impl Family<'_> {
    /// Adds a sample.
    pub(super) fn add(&mut self, labels: &[(&str, &dyn Display)], value: impl Into<Value>) {
        let mut line = self.sample.clone();
        for (index, (name, value)) in labels.iter().enumerate() {
            let separator = if index == 0 { '{' } else { ',' };
            let value = value.to_string();
            let _ = write!(line, "{separator}{name}=\"{}\"", Escaped(&value));
        }
        let end = if labels.is_empty() { "" } else { "}" };
        self.exposition
            .line(format_args!("{line}{end} {}", value.into()));
    }
}

/// The value of a sample.
#[derive(Clone, Copy, Debug)]
pub(super) enum Value {
    Integer(u64),
    Float(f64),
}

impl From<u64> for Value {
    fn from(value: u64) -> Self {
        Self::Integer(value)
    }
}

impl From<usize> for Value {
    fn from(value: usize) -> Self {
        Self::Integer(value as u64)
    }
}

impl From<bool> for Value {
    fn from(value: bool) -> Self {
        Self::Integer(value.into())
    }
}

impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Self::Float(value)
    }
}

impl Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Integer(value) => value.fmt(f),
            Self::Float(f64::INFINITY) => f.write_str("+Inf"),
            Self::Float(f64::NEG_INFINITY) => f.write_str("-Inf"),
            Self::Float(value) => value.fmt(f),
        }
    }
}

/// A text of a label or a description: [visible](jaus_text::visible), with the escapes of both
/// formats.
struct Escaped<'t>(&'t str);

impl Display for Escaped<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        jaus_text::visible(self.0)
            .chars()
            .try_for_each(|c| match c {
                '\\' => f.write_str(r"\\"),
                '"' => f.write_str("\\\""),
                c => f.write_char(c),
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example(format: Format) -> String {
        let mut exposition = Exposition::new(format);
        let mut drops = exposition.counter("x_received", Unit::Bytes, "Octets received.");
        drops.add(&[("link", &"a \"b\"\\\n"), ("way", &7)], 12_u64);
        let mut speed = exposition.gauge("x_speed", Unit::MetersPerSecond, "Speed.");
        speed.add(&[], -0.5);
        exposition.finish()
    }

    #[test]
    fn openmetrics_has_units_and_an_end() {
        let expected = "# HELP x_received_bytes Octets received.\n\
            # TYPE x_received_bytes counter\n\
            # UNIT x_received_bytes bytes\n\
            x_received_bytes_total{link=\"a \\\"b\\\"\\\\\\\\n\",way=\"7\"} 12\n\
            # HELP x_speed_meters_per_second Speed.\n\
            # TYPE x_speed_meters_per_second gauge\n\
            # UNIT x_speed_meters_per_second meters_per_second\n\
            x_speed_meters_per_second -0.5\n\
            # EOF\n";
        assert_eq!(example(Format::OpenMetrics), expected);
    }

    #[test]
    fn a_label_is_printable_whatever_name_it_holds() {
        let mut exposition = Exposition::new(Format::Prometheus);
        let mut family = exposition.gauge("x", Unit::None, "X.");
        family.add(&[("name", &"\x1b[2J\"\n# EOF\u{202e}Müller")], true);
        let text = exposition.finish();
        let sample = "x{name=\"\\\\u{1b}[2J\\\"\\\\n# EOF\\\\u{202e}Müller\"} 1";
        assert_eq!(text.lines().last(), Some(sample), "{text}");
    }

    #[test]
    fn the_older_format_describes_a_counter_by_the_name_of_its_samples() {
        let expected = "# HELP x_received_bytes_total Octets received.\n\
            # TYPE x_received_bytes_total counter\n\
            x_received_bytes_total{link=\"a \\\"b\\\"\\\\\\\\n\",way=\"7\"} 12\n\
            # HELP x_speed_meters_per_second Speed.\n\
            # TYPE x_speed_meters_per_second gauge\n\
            x_speed_meters_per_second -0.5\n";
        assert_eq!(example(Format::Prometheus), expected);
    }

    #[test]
    fn values_that_are_no_numbers_have_the_spelling_of_prometheus() {
        for (value, text) in [
            (f64::NAN, "NaN"),
            (f64::INFINITY, "+Inf"),
            (f64::NEG_INFINITY, "-Inf"),
            (1e-9, "0.000000001"),
        ] {
            assert_eq!(Value::from(value).to_string(), text);
        }
    }

    #[test]
    fn openmetrics_is_for_clients_that_accept_it() {
        let prometheus = "application/openmetrics-text;version=1.0.0;q=0.5,text/plain;q=0.3";
        assert_eq!(Format::accepted(prometheus), Format::OpenMetrics);
        assert_eq!(Format::accepted("*/*"), Format::Prometheus);
    }
}
