//! A page at its operator's hand: its clock, its connections, and what the hand holds.

use std::time::Duration;

use jaus_test_kit::random::Random;
use serde_json::{Value, json};

use crate::browser::{self, Load, Thaw};
use crate::cable::{Cable, Connection, Frame};
use crate::story;
use crate::vehicle::Way;

/// What the operator holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Device {
    Keys,
    Touch,
    Gamepad,
}

/// A hand that holds something.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grip {
    pub(crate) device: Device,
    /// When the hand lets go, or is lost.
    pub(crate) ends: Duration,
    /// Whether the page does not learn of the end.
    pub(crate) gets_lost: bool,
    next_sign: Duration,
    period: Duration,
    /// When the page got the last proof that the hand is there.
    pub(crate) last_sign: Duration,
    /// Whether there was a proof after the first.
    pub(crate) has_renewed: bool,
}

/// What the operator sees.
#[derive(Clone, Debug, Default)]
pub(crate) struct View {
    pub(crate) vehicle: u16,
    /// The line on manual driving, and the last notice.
    pub(crate) line: String,
    notice: String,
    pub(crate) emergency: String,
    pub(crate) by_hand: bool,
    /// Whether the page says that all vehicles are to be stopped.
    pub(crate) is_latched: bool,
    /// How the page's connection is.
    pub(crate) link: String,
}

pub(crate) struct Page {
    pub(crate) number: usize,
    /// Where the hand of this page drives to, by which a vehicle shows who drives it.
    pub(crate) way: Way,
    pub(crate) cable: Cable,
    pub(crate) view: View,
    pub(crate) grip: Option<Grip>,
    /// Until when the browser stands still.
    pub(crate) frozen: Option<Duration>,
    /// Milliseconds of the page's clock in one of true time.
    rate: f64,
    local: f64,
    lived: Duration,
    next: f64,
    load: u64,
    connections: Vec<Connection>,
    events: Vec<Value>,
}

impl Page {
    pub(crate) fn new(number: usize, way: Way, seed: u64, rate: f64) -> Self {
        Self {
            number,
            way,
            cable: Cable::new(seed),
            view: View::default(),
            grip: None,
            frozen: None,
            rate,
            local: 1000.0 * number as f64,
            lived: Duration::ZERO,
            next: 0.0,
            load: 0,
            connections: Vec::new(),
            events: Vec::new(),
        }
    }

    pub(crate) const fn slew(&mut self, rate: f64) {
        self.rate = rate;
    }

    /// Something happens to the page now.
    pub(crate) fn happen(&mut self, event: Value) {
        let Value::Array(mut event) = event else {
            return;
        };
        event.insert(0, json!(self.local));
        self.events.push(Value::Array(event));
    }

    /// Loads the page; what was there is gone, with its connections.
    pub(crate) fn open(&mut self, now: Duration, is_new: bool) {
        for connection in std::mem::take(&mut self.connections) {
            self.cable.send_up(now, connection, Frame::Close);
        }
        self.events.clear();
        self.load += 1;
        let load = if is_new { Load::New } else { Load::Again };
        self.call(now, load, Thaw::No);
    }

    /// Lives until `now`.
    pub(crate) fn live(&mut self, now: Duration, random: &mut Random) {
        self.local += (now - self.lived).as_secs_f64() * 1000.0 * self.rate;
        self.lived = now;
        while let Some((connection, frame)) = self.cable.down.receive(now) {
            self.take(connection, frame);
        }
        self.sign(now);
        let thaw = match self.frozen {
            Some(until) if now < until => return,
            Some(_) => random.choose(&[Thaw::Timers, Thaw::Events]),
            None => Thaw::No,
        };
        let was_frozen = self.frozen.take().is_some();
        if was_frozen || !self.events.is_empty() || self.local >= self.next {
            self.call(now, Load::No, thaw);
        }
    }

    /// Takes a frame from the station.
    fn take(&mut self, connection: Connection, frame: Frame) {
        let (load, number) = connection;
        if load != self.load {
            return;
        }
        match frame {
            // Pages open connections, not the station.
            Frame::Open(..) => {}
            Frame::Opened => self.happen(json!(["opened", number])),
            Frame::Text(text) => self.happen(json!(["message", number, text])),
            Frame::Close => {
                self.connections.retain(|it| *it != connection);
                self.happen(json!(["closed", number]));
            }
        }
    }

    fn call(&mut self, now: Duration, load: Load, thaw: Thaw) {
        let events = std::mem::take(&mut self.events);
        let deeds = browser::run(self.number, self.local, load, thaw, &events);
        self.next = deeds.next.unwrap_or(f64::INFINITY);
        for deed in &deeds.out {
            let connection = (self.load, deed[1].as_u64().unwrap_or_default());
            let text = deed[2].as_str().unwrap_or_default().to_owned();
            match deed[0].as_str() {
                Some("connect") => {
                    self.connections.push(connection);
                    let protocols = serde_json::from_value(deed[3].clone());
                    let open = Frame::Open(text, protocols.expect("a list of words"));
                    self.cable.send_up(now, connection, open);
                }
                Some("send") => self.cable.send_up(now, connection, Frame::Text(text)),
                _ => {
                    self.connections.retain(|it| *it != connection);
                    self.cable.send_up(now, connection, Frame::Close);
                    self.happen(json!(["closed", connection.1]));
                }
            }
        }
        for (name, before) in [("line", &self.view.line), ("notice", &self.view.notice)] {
            let words = text_of(&deeds.view, name);
            if words != *before && !words.is_empty() {
                story::note(now, &format!("page {} says: {words}", self.number));
            }
        }
        let text = |name: &str| text_of(&deeds.view, name);
        self.view = View {
            vehicle: deeds.view["vehicle"].as_u64().unwrap_or_default() as u16,
            line: text("line"),
            notice: text("notice"),
            emergency: text("emergency"),
            by_hand: deeds.view["byHand"] == true,
            is_latched: deeds.view["latched"] == true,
            link: text("link"),
        };
    }

    /// All connections break: the page notices at once. Returns them.
    pub(crate) fn break_connections(&mut self) -> Vec<Connection> {
        let broken = std::mem::take(&mut self.connections);
        for &connection in &broken {
            self.cable.forget(connection);
            self.happen(json!(["closed", connection.1]));
        }
        broken
    }

    /// The connections that the page has.
    pub(crate) fn connections(&self) -> &[Connection] {
        &self.connections
    }

    /// The hand takes something up, and lets it go after `time`.
    pub(crate) fn hold(
        &mut self,
        now: Duration,
        device: Device,
        time: Duration,
        gets_lost: bool,
        random: &mut Random,
    ) {
        let ms = Duration::from_millis;
        let (first, period) = match device {
            Device::Keys => (
                random.between(&(ms(250)..ms(600))),
                random.between(&(ms(30)..ms(150))),
            ),
            // A gamepad has to be seen at rest first.
            _ => (ms(60), ms(20)),
        };
        self.happen(json!(["show", "drive"]));
        match device {
            Device::Keys => self.happen(json!(["key", "keydown", self.key(), false])),
            Device::Touch => {
                self.happen(json!(["pointer", "pointerdown", 1, 150, 150, 1]));
                let y = 150.0 - 60.0 * self.sense();
                self.happen(json!(["pointer", "pointermove", 1, 150, y, 1]));
            }
            Device::Gamepad => {
                self.read_pad(false);
            }
        }
        self.grip = Some(Grip {
            device,
            ends: now + time,
            gets_lost,
            next_sign: now + first,
            period,
            last_sign: now,
            has_renewed: false,
        });
    }

    /// The signs that the hand is there.
    fn sign(&mut self, now: Duration) {
        let Some(mut grip) = self.grip.filter(|it| it.next_sign <= now) else {
            return;
        };
        grip.next_sign = now + grip.period;
        grip.last_sign = now;
        grip.has_renewed = true;
        match grip.device {
            Device::Keys => self.happen(json!(["key", "keydown", self.key(), true])),
            Device::Gamepad => self.read_pad(true),
            // The browser holds the capture, and sends nothing.
            Device::Touch => {}
        }
        self.grip = Some(grip);
    }

    /// The hand lets go, or is lost. Returns when it was last known to be there.
    pub(crate) fn let_go(&mut self) -> Option<Grip> {
        let grip = self.grip.take()?;
        match (grip.device, grip.gets_lost) {
            (Device::Keys, false) => self.happen(json!(["key", "keyup", self.key(), false])),
            (Device::Keys, true) => {}
            (Device::Touch, false) => {
                self.happen(json!(["pointer", "pointerup", 1, 150, 150, 0]));
            }
            (Device::Touch, true) => self.happen(json!(["uncapture", 1])),
            (Device::Gamepad, false) => self.read_pad(false),
            (Device::Gamepad, true) => {}
        }
        Some(grip)
    }

    fn read_pad(&mut self, is_held: bool) {
        let pad = json!({"held": is_held, "x": 0, "y": -self.sense(), "at": self.local});
        self.happen(json!(["pads", [pad]]));
    }

    const fn key(&self) -> &'static str {
        match self.way {
            Way::Forward => "KeyW",
            Way::Backward => "KeyS",
        }
    }

    const fn sense(&self) -> f64 {
        match self.way {
            Way::Forward => 1.0,
            Way::Backward => -1.0,
        }
    }
}

fn text_of(view: &Value, name: &str) -> String {
    view[name].as_str().unwrap_or_default().to_owned()
}
