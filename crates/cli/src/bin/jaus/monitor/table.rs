//! The monitor's table, in place on a terminal or line by line elsewhere.

use std::io::{IsTerminal, stdout};

use terminal_size::{Height, Width, terminal_size};

use super::sample::{DropRow, LinkRow, PeerRow, View};
use jaus_cli::failure::Failure;
use jaus_cli::output::{Output, colours_wanted};
use jaus_text::visible;

/// Maximum number of rows without a limit and without a terminal.
const MOST: usize = 1000;
/// The first words of the headings, which no row begins with.
const HEADINGS: [&str; 3] = ["ID ", "LINK ", "DROPPED "];
/// Assumed terminal size, if none is reported.
const USUAL: (usize, usize) = (80, 24);
/// Escape sequences: the alternate screen without a cursor, and back.
const OPEN: &str = "\x1b[?1049h\x1b[?25l";
const CLOSE: &str = "\x1b[?25h\x1b[?1049l";
const HOME: &str = "\x1b[H";
const REST_OF_LINE: &str = "\x1b[K";
const REST_OF_SCREEN: &str = "\x1b[J";

/// Output of the tables.
pub(super) struct Screen {
    output: Output,
    style: Style,
    limit: Option<usize>,
    shown: bool,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Style {
    /// In place.
    Live,
    /// One after the other.
    Lines,
    Json,
}

impl Screen {
    pub(super) fn open(json: bool, once: bool, limit: Option<usize>) -> Self {
        let style = match json {
            true => Style::Json,
            false if !once && stdout().is_terminal() => Style::Live,
            false => Style::Lines,
        };
        Self {
            output: Output::new(),
            style,
            limit,
            shown: false,
        }
    }

    pub(super) fn show(&mut self, view: &View) -> Result<(), Failure> {
        let first = !std::mem::replace(&mut self.shown, true);
        match self.style {
            Style::Json => self.output.line(view.to_json()),
            Style::Lines => {
                let lines = lines(view, self.limit.unwrap_or(MOST), usize::MAX);
                let gap = if first { "" } else { "\n" };
                self.output.line(format_args!("{gap}{}", lines.join("\n")))
            }
            Style::Live => {
                let (width, height) = size();
                let (links, drops) = (view.links.len(), view.drops.len());
                // Headings, blank lines and the last row with the cursor.
                let others = 6 + links + drops;
                let room = height.saturating_sub(others).max(1);
                let mut screen = String::from(if first { OPEN } else { "" });
                screen.push_str(HOME);
                let lines = lines(view, self.limit.unwrap_or(MOST).min(room), width);
                let colours = colours_wanted(&stdout());
                for line in lines.iter().take(height.saturating_sub(1)) {
                    let line: String = line.chars().take(width).collect();
                    let is_heading = HEADINGS.iter().any(|it| line.starts_with(it));
                    match is_heading && colours {
                        true => screen.push_str(&format!("\x1b[1m{line}\x1b[0m")),
                        false => screen.push_str(&line),
                    }
                    screen.push_str(REST_OF_LINE);
                    screen.push_str("\r\n");
                }
                screen.push_str(REST_OF_SCREEN);
                screen.push_str("Press Ctrl-C to end");
                self.output.part(&screen)
            }
        }
    }

    /// Restores the terminal.
    pub(super) fn close(&mut self) {
        if self.style == Style::Live && self.shown {
            // A failure at this point cannot be reported.
            let _ = self.output.part(CLOSE);
        }
    }
}

fn size() -> (usize, usize) {
    match terminal_size() {
        Some((Width(width), Height(height))) => (width.into(), height.into()),
        None => USUAL,
    }
}

/// The width of all columns of peers but the name, with the spaces between them.
const OTHER_COLUMNS: usize = 72;
/// The width of the column of clocks, with the space before it.
const CLOCKS: usize = 8;
/// The narrowest and the widest column of names.
const NAMES: (usize, usize) = (8, 26);

/// The width of the column of names: that of the longest name, as far as a screen has room for it.
fn name_width(longest: usize, screen: usize) -> usize {
    let (narrowest, widest) = NAMES;
    let room = screen.saturating_sub(OTHER_COLUMNS).max(narrowest);
    longest.clamp(narrowest, widest).min(room)
}

/// The name of the component, or else of its subsystem, or else its kind.
fn name(peer: &PeerRow) -> &str {
    match (&*peer.name, &*peer.subsystem) {
        ("", "") => &peer.kind,
        ("", subsystem) => subsystem,
        (name, _) => name,
    }
}

/// The whole table, with at most `most` peers, for a screen of this width.
fn lines(view: &View, most: usize, screen: usize) -> Vec<String> {
    let names = view.peers.iter().map(|peer| name(peer).chars().count());
    let has_clocks = view.peers.iter().any(|peer| peer.clock.is_some());
    let clocks = if has_clocks { CLOCKS } else { 0 };
    let width = name_width(names.max().unwrap_or(0), screen.saturating_sub(clocks));
    let mut heading = format!(
        "{:12} {:width$} {:20} {:>5} {:>6} {:>5} {:>4} {:>3} {:>5} {:>3}",
        "ID", "NAME", "ADDRESS", "in/s", "oct/s", "out/s", "lost", "rep", "ms", "ago"
    );
    if has_clocks {
        heading.push_str("   clock");
    }
    let mut lines = vec![heading];
    lines.extend(
        view.peers
            .iter()
            .take(most)
            .map(|peer| peer_line(peer, width)),
    );
    match view.peers.len() {
        0 => lines.push("no peers yet".to_owned()),
        number if number > most => lines.push(format!("… and {} more", number - most)),
        _ => {}
    }
    lines.push(String::new());
    lines.push(format!(
        "{:34} {:>9} {:>9} {:>9} {:>9}  {}",
        "LINK", "in/s", "oct/s", "out/s", "oct/s", "err"
    ));
    lines.extend(view.links.iter().map(link_line));
    if !view.drops.is_empty() {
        lines.push(String::new());
        lines.push(format!("{:36} {:>9} {:>9}", "DROPPED", "per s", "in all"));
        lines.extend(view.drops.iter().map(drop_line));
    }
    lines
}

fn peer_line(peer: &PeerRow, width: usize) -> String {
    let round_trip = peer.round_trip.map_or_else(
        || "-".to_owned(),
        |time| format!("{:.2}", time.as_secs_f64() * 1e3),
    );
    let mut line = format!(
        "{:12} {:width$} {:20} {:>5} {:>6} {:>5} {:>4} {:>3} {:>5} {:>3}",
        peer.id.to_string(),
        clipped(name(peer), width),
        clipped(&peer.address, 20),
        short(peer.received),
        short(peer.received_octets),
        short(peer.sent),
        short(peer.lost as f64),
        short(peer.repeated as f64),
        clipped(&round_trip, 5),
        short(peer.silent.as_secs() as f64),
    );
    if let Some(clock) = peer.clock {
        line.push_str(&format!(" {:>7}", ahead(clock.seconds)));
    }
    line
}

/// How far a clock is ahead, in at most seven characters: `+3ms`, `-1.5s`, `-120min`, `+40d`.
fn ahead(seconds: f64) -> String {
    let (number, unit) = match seconds.abs() {
        size if size < 0.9995 => return format!("{:+.0}ms", seconds * 1e3),
        size if size < 600.0 => (seconds, "s"),
        size if size < 36_000.0 => (seconds / 60.0, "min"),
        size if size < 864_000.0 => (seconds / 3600.0, "h"),
        _ => (seconds / 86_400.0, "d"),
    };
    match number.abs() < 9.95 {
        true => format!("{number:+.1}{unit}"),
        false => format!("{number:+.0}{unit}"),
    }
}

fn link_line(link: &LinkRow) -> String {
    format!(
        "{:34} {:>9} {:>9} {:>9} {:>9}  {}",
        clipped(&link.name, 34),
        short(link.received),
        short(link.received_octets),
        short(link.sent),
        short(link.sent_octets),
        link.errors,
    )
}

fn drop_line(drop: &DropRow) -> String {
    format!(
        "{:36} {:>9} {:>9}",
        clipped(drop.reason, 36),
        short(drop.rate),
        drop.total
    )
}

/// A number in at most five characters: `0`, `0.3`, `12`, `1.5k`, `250M`.
fn short(number: f64) -> String {
    let mut number = number;
    for unit in ["", "k", "M"] {
        if number < 999.5 {
            return match number {
                _ if number == 0.0 => "0".to_owned(),
                _ if number < 9.95 && number.fract() != 0.0 => format!("{number:.1}{unit}"),
                _ => format!("{number:.0}{unit}"),
            };
        }
        number /= 1000.0;
    }
    format!("{number:.0}G")
}

/// Shortens a peer's name, in printable characters, and marks the cut.
fn clipped(text: &str, width: usize) -> String {
    let shown = visible(text);
    let mut rest = shown.chars();
    let mut clipped: String = rest.by_ref().take(width).collect();
    if rest.next().is_some() {
        clipped.pop();
        clipped.push('…');
    }
    clipped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_whole_where_the_screen_has_room_for_them() {
        for (longest, screen, width) in [
            (30, 80, 8),
            (12, 100, 12),
            (30, 100, 26),
            (3, usize::MAX, 8),
            (16, usize::MAX, 16),
            (16, 0, 8),
        ] {
            assert_eq!(name_width(longest, screen), width, "{longest} on {screen}");
        }
    }

    #[test]
    fn clocks_fit_their_column() {
        for (seconds, text) in [
            (0.0034, "+3ms"),
            (-0.9994, "-999ms"),
            (-1.5, "-1.5s"),
            (599.0, "+599s"),
            (-7200.0, "-120min"),
            (3e7, "+347d"),
        ] {
            assert_eq!(ahead(seconds), text);
            assert!(text.len() <= 7, "{text}");
        }
    }

    #[test]
    fn numbers_stay_short_and_names_harmless() {
        for (number, text) in [
            (0.0, "0"),
            (0.25, "0.2"),
            (3.0, "3"),
            (12.34, "12"),
            (999.0, "999"),
            (1500.0, "1.5k"),
            (250_000_000.0, "250M"),
            (3e12, "3000G"),
        ] {
            assert_eq!(short(number), text);
        }
        assert_eq!(clipped("Rover", 10), "Rover");
        assert_eq!(clipped("a very long name", 10), "a very lo…");
        assert_eq!(clipped("\x1b[2Jevil", 10), r"\u{1b}[2J…");
        assert_eq!(clipped("\u{202e}revoR", 16), r"\u{202e}revoR");
    }
}
