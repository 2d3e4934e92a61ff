//! Rules for a vehicle under Management, derived only from its messages: which client's commands it
//! follows, its state, and its controller.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::codec::Message;
use jaus::endpoint::{Outgoing, Received};
use jaus::messages::core::{
    ClearEmergency, ConfirmControl, DeleteElement, RejectControl, ReleaseControl, RequestControl,
    Reset, Resume, SetEmergency, Standby, confirm_control, reject_control,
};
use jaus::service::{Standing, State};

pub(crate) struct Rules {
    /// How long control lasts without renewal; zero means forever.
    timeout: Duration,
    /// The client with the last confirmation of control, unless it was revoked.
    told: Option<JausId>,
    /// When that client last requested control.
    asked: Instant,
    /// The clients with an emergency, with the number of the newest message that set it.
    emergencies: BTreeMap<JausId, Numbered>,
    /// Emergencies of others that a client has cleared that has restarted since it got control. The
    /// vehicle may take it for one that is not in control.
    perhaps_cleared: BTreeMap<JausId, Numbered>,
    /// The last request for control of each client.
    requests: BTreeMap<JausId, Numbered>,
    /// The last message of each client by which it stopped the vehicle, or took it up: what it has
    /// sent before that moves nothing.
    turns: BTreeMap<JausId, Numbered>,
    /// When each client last sent a message: the client in control may clear the emergency of a
    /// client that is silent for long.
    heard: BTreeMap<JausId, Instant>,
    /// Whether the client in control has sent Resume, and nothing has stopped the vehicle since.
    resumed: bool,
    /// Clients that have restarted since they got control. The vehicle may follow them, end their
    /// control by their next message before it is followed, or take that for an old one, because
    /// they have counted their messages anew.
    restarted: BTreeMap<JausId, Instant>,
    /// The client whose control has ended since the last check.
    released: Option<JausId>,
    /// Clients whose commands it should execute now.
    acts_for: Vec<JausId>,
}

/// A message's arrival, and the number that its client gave it.
#[derive(Clone, Copy)]
struct Numbered {
    number: Option<u16>,
    at: Instant,
}

impl Numbered {
    /// What is set or cleared more than 4 s or 4096 numbers apart is in the order of arrival.
    const MEMORY: Duration = Duration::from_secs(4);
    const REACH: u16 = 4096;

    fn of(at: Instant, message: &Received) -> Self {
        let is_counted = message.destination.is_unicast();
        let number = message.sequence.filter(|_| is_counted);
        Self { number, at }
    }

    /// Whether the client sent this before the other, which has arrived already.
    fn is_before(self, other: Self) -> bool {
        let lag = self
            .number
            .zip(other.number)
            .map(|(a, b)| b.wrapping_sub(a));
        lag.is_some_and(|lag| (1..=Self::REACH).contains(&lag))
            && self.at.saturating_duration_since(other.at) < Self::MEMORY
    }
}

/// No message is on its way for longer.
const LATEST: Duration = Duration::from_secs(2);

/// Whether messages with this code stop the vehicle.
fn is_stop(code: Option<u16>) -> bool {
    let stops = [
        ReleaseControl::CODE,
        Standby::CODE,
        Reset::CODE,
        SetEmergency::CODE,
    ];
    code.is_some_and(|code| stops.contains(&code))
}

/// The message code at the head of a payload.
fn code_of(payload: &[u8]) -> Option<u16> {
    payload.first_chunk().map(|&code| u16::from_le_bytes(code))
}

impl Rules {
    /// The vehicle's command; any command would do.
    const COMMAND: u16 = DeleteElement::CODE;

    pub(crate) fn new(now: Instant, timeout: Duration) -> Self {
        Self {
            timeout,
            told: None,
            asked: now,
            emergencies: BTreeMap::new(),
            perhaps_cleared: BTreeMap::new(),
            requests: BTreeMap::new(),
            turns: BTreeMap::new(),
            heard: BTreeMap::new(),
            resumed: false,
            restarted: BTreeMap::new(),
            released: None,
            acts_for: Vec::new(),
        }
    }

    /// Notes that a client has restarted.
    pub(crate) fn restart(&mut self, now: Instant, client: JausId) {
        self.restarted.insert(client, now);
        // It may count anew.
        self.turns.remove(&client);
    }

    /// Processes a message that the vehicle is about to receive.
    pub(crate) fn hear(&mut self, now: Instant, message: &Received) {
        let client = message.source;
        self.heard.insert(client, now);
        let sent = Numbered::of(now, message);
        let commands = self.told == Some(client) && self.emergencies.is_empty();
        let code = code_of(&message.payload);
        if self.told == Some(client) && is_stop(code) {
            self.turn(client, sent);
        }
        match code {
            Some(SetEmergency::CODE) => {
                let newest = self.emergencies.entry(client).or_insert(sent);
                if !sent.is_before(*newest) {
                    *newest = sent;
                }
                self.resumed = false;
            }
            // It arrives late: its client has set the emergency again since, or has restarted and
            // counts anew.
            Some(ClearEmergency::CODE) if self.has_since(sent, client) => {}
            Some(ClearEmergency::CODE) => {
                let mut is_cleared = self.emergencies.remove(&client).is_some();
                if self.told == Some(client) {
                    let (silent, alive): (BTreeMap<_, _>, _) =
                        std::mem::take(&mut self.emergencies)
                            .into_iter()
                            .partition(|(id, _)| is_silent(&self.heard, now, *id));
                    self.emergencies = alive;
                    is_cleared |= !silent.is_empty();
                    if self.restarted.contains_key(&client) {
                        self.perhaps_cleared = silent;
                    }
                }
                if is_cleared {
                    // The client keeps control, and the timeout restarts.
                    self.asked = now;
                }
            }
            Some(Resume::CODE) if commands => {
                if !self.resumed {
                    self.turn(client, sent);
                }
                self.resumed = true;
            }
            Some(Standby::CODE | Reset::CODE) if commands => self.resumed = false,
            Some(RequestControl::CODE) => {
                self.requests.insert(client, sent);
                if commands {
                    self.asked = now;
                }
            }
            Some(Self::COMMAND) if commands && self.resumed => {
                let turn = self.turns.get(&client);
                if turn.is_none_or(|turn| !sent.is_before(*turn)) {
                    self.acts_for.push(client);
                }
            }
            _ => {}
        }
    }

    fn turn(&mut self, client: JausId, sent: Numbered) {
        let newest = self.turns.entry(client).or_insert(sent);
        if !sent.is_before(*newest) {
            *newest = sent;
        }
    }

    /// Whether the client has set an emergency after it sent this.
    fn has_since(&self, sent: Numbered, client: JausId) -> bool {
        let newest = self.emergencies.get(&client);
        newest.is_some_and(|&newest| sent.is_before(newest))
    }

    /// Processes a message from the vehicle.
    pub(crate) fn say(&mut self, now: Instant, message: &Outgoing) -> Result<(), String> {
        let client = message.destination;
        if let Ok(confirm) = ConfirmControl::decode(&message.payload) {
            if confirm.response_code != confirm_control::ResponseCode::CONTROL_ACCEPTED {
                return Ok(());
            }
            let heard = &self.heard;
            if self
                .emergencies
                .keys()
                .any(|&id| !is_silent(heard, now, id))
            {
                return Err(format!("{client} is granted control in an emergency"));
            }
            if let Some(told) = self.told.filter(|&told| told != client) {
                return Err(format!("{told} and {client} are both in control"));
            }
            let has_begun = self.told != Some(client);
            if let Some(&request) = self.requests.get(&client).filter(|_| has_begun) {
                self.turn(client, request);
            }
            if self.told.replace(client).is_none() {
                // Its request may still be one of before.
                let is_earlier = |at: &Instant| now.saturating_duration_since(*at) > LATEST;
                self.restarted
                    .retain(|id, at| *id != client || !is_earlier(at));
                // Another client takes over as it is; one that was released must resume again.
                self.resumed &= self.released != Some(client);
            }
            self.asked = now;
        } else if let Ok(reject) = RejectControl::decode(&message.payload)
            && reject.response_code == reject_control::ResponseCode::CONTROL_RELEASED
            && self.told == Some(client)
        {
            self.told = None;
            self.released = Some(client);
        }
        Ok(())
    }

    /// Checks the vehicle's state, controller and actions.
    pub(crate) fn judge(
        &mut self,
        now: Instant,
        standing: &Standing,
        acted_for: &[JausId],
    ) -> Result<(), String> {
        let controller = standing.controller.map(|it| it.id);
        if self
            .told
            .is_some_and(|told| self.restarted.contains_key(&told))
        {
            // The vehicle does not tell it that its control has ended, or that it must resume again.
            self.told = self.told.filter(|_| controller.is_some());
            self.resumed &= standing.state == State::Ready;
        }
        if controller != self.told {
            let told = self.told;
            return Err(format!(
                "{controller:?} is in control, and {told:?} was told"
            ));
        }
        self.released = None;
        self.resumed &= controller.is_some();
        let perhaps_cleared = std::mem::take(&mut self.perhaps_cleared);
        if standing.state == State::Emergency {
            self.emergencies.extend(perhaps_cleared);
        }
        if (standing.state == State::Emergency) == self.emergencies.is_empty() {
            let clients = self.emergencies.keys();
            return Err(format!(
                "{} with emergencies of {clients:?}",
                standing.state
            ));
        }
        if (standing.state == State::Ready) != self.resumed {
            let resumed = self.resumed;
            return Err(format!("{} with resumed: {resumed}", standing.state));
        }
        let acts_for = std::mem::take(&mut self.acts_for);
        let is_wrong = |is_restarted| {
            let of = |ids: &[JausId]| -> Vec<_> {
                let counts = |id: &JausId| self.restarted.contains_key(id) == is_restarted;
                ids.iter().copied().filter(counts).collect()
            };
            let (acted_for, acts_for) = (of(acted_for), of(&acts_for));
            acted_for != acts_for && !(is_restarted && acted_for.is_empty())
        };
        if is_wrong(false) || is_wrong(true) {
            return Err(format!("acted for {acted_for:?} instead of {acts_for:?}"));
        }
        let idle = now.saturating_duration_since(self.asked);
        let limit = self.timeout + self.timeout / 4;
        let lasts = self.timeout.is_zero() || controller.is_none() || idle <= limit;
        if lasts || standing.state == State::Emergency {
            Ok(())
        } else {
            Err(format!("{controller:?} has not asked again for {idle:?}"))
        }
    }
}

/// Whether a client has been silent long enough that the client in control may clear its emergency.
fn is_silent(heard: &BTreeMap<JausId, Instant>, now: Instant, client: JausId) -> bool {
    let since = heard.get(&client);
    since.is_none_or(|&at| now.saturating_duration_since(at) >= Duration::from_secs(4))
}
