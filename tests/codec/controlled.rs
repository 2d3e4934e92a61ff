//! A service whose state machine extends that of Access Control: it follows the component's
//! control, and the stack answers whether the sender is in control.

use std::time::Duration;

use jaus::address::JausId;
use jaus::service::rig::{CLIENT, Rig, STRANGER};
use jaus::service::{Call, Handlers, State};

use crate::constructs::controlled::{QuerySiren, ReportSiren, SoundSiren, siren};

const TONE: Duration = Duration::from_secs(3);

/// Counts its tones, and how often it was silenced.
#[derive(Default)]
struct Siren {
    tones: u8,
    silenced: u8,
}

impl siren::Service<Call<'_>> for Siren {
    fn silence(&mut self, _: &mut Call<'_>) {
        self.silenced += 1;
        self.tones += 10;
    }

    fn sound(&mut self, call: &mut Call<'_>) {
        self.tones += 1;
        call.raise_after(TONE, siren::Internal::ToneEnded);
    }

    fn send_report_siren(&mut self, _: &mut Call<'_>) -> ReportSiren {
        ReportSiren { tones: self.tones }
    }
}

#[test]
fn the_machine_follows_the_components_control() {
    let siren = Handlers::of(siren::Server::new(Siren::default()));
    let mut rig = Rig::new(vec![Box::new(siren)]);
    let mut tones_after = |controller: Option<JausId>, from: JausId| {
        rig.stand(State::Ready, controller);
        rig.send(from, &SoundSiren);
        rig.ask::<ReportSiren>(&QuerySiren).unwrap().tones
    };
    let start = tones_after(None, STRANGER);
    assert_eq!(start % 10, 0, "nobody is in control");
    assert_eq!(tones_after(Some(CLIENT), STRANGER), start);
    assert_eq!(tones_after(Some(CLIENT), CLIENT), start + 1);
    assert_eq!(
        tones_after(Some(CLIENT), CLIENT),
        start + 1,
        "it sounds already"
    );
    assert_eq!(
        tones_after(None, CLIENT),
        start + 11,
        "silenced with control"
    );
    assert_eq!(tones_after(Some(CLIENT), CLIENT), start + 12);
}

#[test]
fn an_event_of_the_service_comes_after_its_delay() {
    let siren = Handlers::of(siren::Server::new(Siren::default()));
    let mut rig = Rig::new(vec![Box::new(siren)]);
    let moment = Duration::from_millis(1);
    let mut tones_later = |pause: Duration| {
        rig.run(pause);
        rig.send(CLIENT, &SoundSiren);
        rig.ask::<ReportSiren>(&QuerySiren).unwrap().tones
    };
    assert_eq!(tones_later(moment), 1);
    assert_eq!(tones_later(TONE - moment), 1, "it still sounds");
    assert_eq!(tones_later(moment), 2);
}
