//! The service `urn:example:Lamp`, from its definition in `services/Lamp.xml`.

use std::time::Duration;

use jaus::component::{Call, Handlers};

/// Generated from the definition at build time.
pub mod messages {
    include!(concat!(env!("OUT_DIR"), "/messages.rs"));
}

use messages::report_lamp::Brightness;
use messages::{QueryLamp, ReportLamp, SetLamp, lamp};

/// The service. Its commands need control, and its state machine decides when they are accepted,
/// because the definition says so.
pub fn service() -> Handlers<lamp::Server<Lamp>> {
    Handlers::of(lamp::Server::new(Lamp::default()))
}

/// The lamp. A real one would be switched and dimmed here.
#[derive(Debug, Default)]
pub struct Lamp {
    wanted: Brightness,
    shown: Brightness,
}

impl lamp::Service<Call<'_>> for Lamp {
    fn query_lamp(&mut self, _: QueryLamp, _: &mut Call<'_>) -> Option<ReportLamp> {
        let brightness = self.shown;
        Some(ReportLamp { brightness })
    }

    fn is_dark(&self, message: &SetLamp) -> bool {
        message.brightness.raw() == 0
    }

    fn warm_up(&mut self, message: &SetLamp, call: &mut Call<'_>) {
        self.wanted = Brightness::from_raw(message.brightness.raw());
        call.raise_after(Duration::from_millis(200), lamp::Internal::WarmedUp);
    }

    fn shine(&mut self, call: &mut Call<'_>) {
        self.shown = self.wanted;
        call.changed::<QueryLamp>();
    }

    fn dim(&mut self, message: &SetLamp, call: &mut Call<'_>) {
        self.shown = Brightness::from_raw(message.brightness.raw());
        call.changed::<QueryLamp>();
    }

    fn switch_off(&mut self, call: &mut Call<'_>) {
        self.shown = Brightness::from_raw(0);
        call.changed::<QueryLamp>();
    }
}
