//! A scripted vehicle with the behaviour of JAUS++: it can be discovered, queried, subscribed to,
//! controlled and driven, and deviates from the standard in a few points.

use std::time::{Duration, Instant};

use jaus::address::JausId;

use super::body;
use super::events::Events;
use super::speaker::{Heard, Speaker};

/// Its services, named as at that time.
pub(super) const SERVICES: [&str; 9] = [
    "urn:jaus:jss:core:Transport",
    "urn:jaus:jss:core:Events",
    "urn:jaus:jss:core:Discovery",
    "urn:jaus:jss:core:AccessControl",
    "urn:jaus:jss:core:Management",
    "urn:jaus:jss:core:Time",
    "urn:jaus:jss:core:Liveness",
    "urn:jaus:jss:mobility:VelocityStateSensor",
    "urn:jaus:jss:mobility:PrimitiveDriver",
];
/// Interval of its broadcasts.
const CALL: Duration = Duration::from_secs(5);
/// Interval of the time steps.
const TURN: Duration = Duration::from_millis(20);
/// Control lasts this long without another Request Control; nothing else renews it.
const HOLD: Duration = Duration::from_millis(6250);
/// The timeout of control that it reports, in seconds.
const TIMEOUT: u8 = 5;
/// Speed at full effort in m/s, and the change per time step.
const FASTEST: f64 = 2.0;
const STEP: f64 = 0.05;
/// Status codes.
const READY: u8 = 1;
const IS_STANDBY: u8 = 2;

/// The client in control.
struct Controller {
    id: JausId,
    authority: u8,
    since: Instant,
}

struct Vehicle {
    speaker: Speaker,
    status: u8,
    controller: Option<Controller>,
    push: f64,
    velocity: f64,
    events: Events,
}

/// Runs until it is killed.
pub(super) fn run(speaker: Speaker) -> Result<(), String> {
    let mut vehicle = Vehicle {
        speaker,
        status: IS_STANDBY,
        controller: None,
        push: 0.0,
        velocity: 0.0,
        events: Events::default(),
    };
    println!("listening");
    let (mut call, mut turn) = (Instant::now(), Instant::now());
    loop {
        let now = Instant::now();
        if now >= call {
            let question = body::message(body::QUERY_IDENTIFICATION, &[&[2]]);
            vehicle.speaker.say(JausId::EVERYONE, &question);
            call = now + CALL;
        }
        if now >= turn {
            vehicle.move_on(now);
            turn = now + TURN;
        }
        if let Some(heard) = vehicle.speaker.hear(turn) {
            vehicle.answer(&heard)?;
        }
    }
}

impl Vehicle {
    fn answer(&mut self, heard: &Heard) -> Result<(), String> {
        let Some(code) = body::code(&heard.payload) else {
            return Ok(());
        };
        let rest = &heard.payload[2..];
        match code {
            body::UPDATE_EVENT => {
                return Err("Update Event: it is what JAUS++ crashes at".to_owned());
            }
            body::CREATE_EVENT | body::CANCEL_EVENT | body::QUERY_EVENTS => {
                let velocity = self.velocity;
                let query = |query: &[u8]| velocity_report(query, velocity);
                for answer in self.events.handle(heard.source, &heard.payload, query) {
                    self.speaker.say(heard.source, &answer);
                }
            }
            body::REQUEST_CONTROL => self.request(heard.source, rest),
            body::RELEASE_CONTROL => {
                if self.is_controller(heard.source) {
                    self.release();
                }
            }
            body::RESUME | body::STANDBY | body::SET_WRENCH_EFFORT => self.command(code, heard),
            code if code == body::report(body::QUERY_IDENTIFICATION) => {
                let question = body::message(body::QUERY_CONFIGURATION, &[&[2]]);
                let services = body::services(&SERVICES);
                if self.speaker.habits.registers {
                    let register = body::message(body::REGISTER_SERVICES, &[&services]);
                    self.speaker.say(heard.source, &register);
                }
                self.speaker.say(heard.source, &question);
            }
            _ => {
                if let Some(answer) = self.report(code, rest) {
                    self.speaker.say(heard.source, &answer);
                } else if let Some(answer) = velocity_report(&heard.payload, self.velocity) {
                    self.speaker.say(heard.source, &answer);
                }
            }
        }
        Ok(())
    }

    /// The answer to a query about itself.
    fn report(&self, code: u16, rest: &[u8]) -> Option<Vec<u8>> {
        let id = self.speaker.id;
        let answer = |parts: &[&[u8]]| Some(body::message(body::report(code), parts));
        match code {
            body::QUERY_HEARTBEAT => answer(&[]),
            body::QUERY_AUTHORITY => answer(&[&[0]]),
            body::QUERY_STATUS => answer(&[&[self.status, 0, 0, 0, 0]]),
            body::QUERY_TIMEOUT => answer(&[&[TIMEOUT]]),
            body::QUERY_CONTROL => {
                let Some(controller) = &self.controller else {
                    return answer(&[&[0, 0, 0, 0, 0]]);
                };
                let id = controller.id;
                let subsystem = id.subsystem().to_le_bytes();
                // Its own authority, not the client's.
                answer(&[&subsystem, &[id.node(), id.component(), 0]])
            }
            body::QUERY_IDENTIFICATION => {
                let about = *rest.first()?;
                // There is no system type: a vehicle, or a component.
                let kind: u16 = match about {
                    2 => 10_001,
                    3 => 40_001,
                    4 => 60_001,
                    _ => return None,
                };
                let name = self.speaker.habits.name.as_bytes();
                answer(&[&[about], &kind.to_le_bytes(), &[name.len() as u8], name])
            }
            body::QUERY_CONFIGURATION => Some(body::alone(body::report(code), id, &[])),
            body::QUERY_SERVICES => {
                let services = body::services(&SERVICES);
                match rest {
                    [0] => {}
                    // Wildcards match no component here.
                    [1, node, 1, component]
                        if (*node, *component) == (id.node(), id.component()) => {}
                    _ => return answer(&[&[0]]),
                }
                Some(body::alone(body::report(code), id, &services))
            }
            _ => None,
        }
    }

    fn is_controller(&self, id: JausId) -> bool {
        self.controller
            .as_ref()
            .is_some_and(|controller| controller.id == id)
    }

    fn request(&mut self, from: JausId, rest: &[u8]) {
        let authority = rest.first().copied().unwrap_or_default();
        let before = self
            .controller
            .as_ref()
            .map(|controller| (controller.id, controller.authority));
        let is_granted = before.is_none_or(|(id, than)| id == from || authority > than);
        // 0 granted, 2 insufficient authority.
        let response = if is_granted { 0 } else { 2 };
        if is_granted {
            if let Some((id, _)) = before.filter(|(id, _)| *id != from) {
                let reject = body::message(body::REJECT_CONTROL, &[&[0]]);
                self.speaker.say(id, &reject);
            }
            self.controller = Some(Controller {
                id: from,
                authority,
                since: Instant::now(),
            });
        }
        let confirm = body::message(body::CONFIRM_CONTROL, &[&[response]]);
        self.speaker.say(from, &confirm);
    }

    /// Ends control.
    fn release(&mut self) {
        let Some(controller) = self.controller.take() else {
            return;
        };
        let reject = body::message(body::REJECT_CONTROL, &[&[0]]);
        self.speaker.say(controller.id, &reject);
        self.status = IS_STANDBY;
        self.push = 0.0;
    }

    /// Only the client in control may command; without one, any client may.
    fn command(&mut self, code: u16, heard: &Heard) {
        if self.controller.is_some() && !self.is_controller(heard.source) {
            return;
        }
        match code {
            body::RESUME => self.status = READY,
            body::STANDBY => self.status = IS_STANDBY,
            _ if self.status == READY => {
                self.push = body::push_in(&heard.payload).unwrap_or(self.push);
            }
            _ => {}
        }
    }

    /// Advances one time step: changes speed, sends reports, and may end control.
    fn move_on(&mut self, now: Instant) {
        if self
            .controller
            .as_ref()
            .is_some_and(|controller| now > controller.since + HOLD)
        {
            self.release();
        }
        let wanted = match self.status {
            READY => self.push / 100.0 * FASTEST,
            _ => 0.0,
        };
        let before = self.velocity;
        self.velocity += (wanted - self.velocity).clamp(-STEP, STEP);
        let has_changed = before != self.velocity;
        let velocity = self.velocity;
        for (client, event) in self
            .events
            .due(now, has_changed, |query| velocity_report(query, velocity))
        {
            self.speaker.say(client, &event);
        }
    }
}

/// The answer to a query, if it asks for the velocity.
fn velocity_report(query: &[u8], velocity: f64) -> Option<Vec<u8>> {
    (body::code(query) == Some(body::QUERY_VELOCITY)).then(|| body::velocity(velocity))
}
