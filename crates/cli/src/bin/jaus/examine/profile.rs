//! Recognises known peers, with the evidence.

use jaus::peer::{Certainty, Departure, LargeStyle, Recogniser, Sign, Verdict};
use jaus::wire::{Version, ra::RaId};
use serde_json::{Value as Json, json};

use super::case::Case;
use super::seen::Listener;

/// Recognised kind of a peer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Profile {
    /// It speaks AS5669A.
    As5669a(Verdict),
    /// It speaks only the Reference Architecture: its subsystem number there.
    Ra(u8),
    /// Not enough messages received.
    Unknown,
}

impl Case {
    /// Recognises the peer by all its messages and its reactions to probes.
    pub(super) fn recognise(&self) -> Verdict {
        let mut recogniser = self.unprovoked();
        if self.reserved.misreads_type {
            recogniser.note(Sign::MisreadType);
        }
        if self.reserved.answers_for_zero {
            recogniser.note(Sign::AnswersForZero);
        }
        recogniser.verdict()
    }

    /// Recognises the peer without probes, as a node does.
    fn unprovoked(&self) -> Recogniser {
        let mut recogniser = Recogniser::default();
        let all = self.seen.all().iter();
        for heard in all.filter(|heard| Some(heard.frame.source) == self.id) {
            recogniser.handle_frame(&heard.frame, heard.stale);
            if heard.listener == Listener::Group {
                recogniser.handle_frame_to_all(&heard.frame);
            }
        }
        if let Some(offers) = &self.services {
            let offers = offers.iter();
            recogniser.handle_services(offers.map(|o| (o.urn.as_str(), o.major, o.minor)));
        }
        recogniser
    }

    /// Whether each fragment to the peer must begin with the message code.
    pub(super) fn repeats_code(&self) -> bool {
        let verdict = self.recognise();
        let sure = verdict.certainty >= Certainty::Likely;
        sure && verdict.peer.large_style() == Some(LargeStyle::RepeatedCode)
    }

    /// The profile at the end.
    pub(super) fn profile(&self) -> Profile {
        let of_it = |version: Version| {
            let all = self
                .seen
                .all()
                .iter()
                .filter(move |heard| heard.frame.version == version);
            let ip = self.address.map(|address| address.ip());
            all.filter(move |heard| Some(heard.from.ip()) == ip)
        };
        if of_it(Version::As5669a).next().is_some() {
            return Profile::As5669a(self.recognise());
        }
        let older = of_it(Version::Ra).chain(of_it(Version::As5669)).next();
        older.map_or(Profile::Unknown, |heard| {
            Profile::Ra(RaId::from(heard.frame.source).subsystem)
        })
    }
}

impl Profile {
    /// The profile as text, line by line.
    pub(super) fn in_words(&self, case: &Case) -> Vec<String> {
        let verdict = match self {
            Self::Unknown => return vec!["not recognised: too few messages received".to_owned()],
            Self::Ra(_) => {
                return vec![
                    "Reference Architecture 3.x (OpenJAUS 3.x and similar), not AS5669A".to_owned(),
                    "→ connect it through `jaus-ra-gateway`: docs/ra-gateway.md".to_owned(),
                ];
            }
            Self::As5669a(verdict) => verdict,
        };
        let reasons = verdict.reasons.iter().map(|sign| sign.explanation());
        let peer = verdict.peer;
        let mut lines = Vec::new();
        match verdict.certainty {
            Certainty::Unknown => {
                lines.push("none: it looks like a peer that conforms to the standard".to_owned());
                lines.extend(reasons.map(|reason| format!("although {reason}: no evidence alone")));
                return lines;
            }
            Certainty::Guess => {
                lines.push(format!("not recognised; it may be {}", peer.title()));
                lines.extend(reasons.map(|reason| format!("because {reason}")));
                return lines;
            }
            Certainty::Likely | Certainty::Certain => {
                lines.push(format!("{} ({})", peer.title(), verdict.certainty));
                lines.extend(reasons.map(|reason| format!("because {reason}")));
            }
        }
        if case.unprovoked().certain() != peer {
            let id = case.id.map_or_else(String::new, |id| id.to_string());
            let once = match verdict.certainty {
                Certainty::Certain => "it has sent enough messages by itself",
                _ => "that is certain",
            };
            lines.push(format!(
                "→ a node applies this profile once {once}, or with these settings: [[profile]] \
                 id = \"{id}\", profile = \"{peer}\""
            ));
        }
        let departures: Vec<_> = departures(verdict).map(|it| it.name).collect();
        if !departures.is_empty() {
            lines.push(format!("known departures: {}", departures.join("; ")));
        }
        lines
    }

    pub(super) fn to_json(&self) -> Json {
        match self {
            Self::Unknown => Json::Null,
            Self::Ra(subsystem) => json!({"peer": "ra", "subsystem": subsystem}),
            Self::As5669a(verdict) => {
                let departures = departures(verdict).map(|departure| {
                    json!({"name": departure.name, "does": departure.does, "ours": departure.ours})
                });
                let reasons = verdict.reasons.iter().map(|sign| sign.explanation());
                json!({
                    "peer": verdict.peer.name(),
                    "certainty": verdict.certainty.to_string(),
                    "reasons": reasons.collect::<Vec<_>>(),
                    "departures": departures.collect::<Vec<_>>(),
                })
            }
        }
    }
}

/// The departures of the peer, if it is certain which one it is.
fn departures(verdict: &Verdict) -> impl Iterator<Item = &'static Departure> {
    let is_certain = verdict.certainty == Certainty::Certain;
    let all = is_certain.then(|| verdict.peer.departures());
    all.into_iter().flatten()
}
