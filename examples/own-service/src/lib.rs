//! The service `urn:example:Lamp`, from its definition in `services/Lamp.xml`.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering::Relaxed};

use jaus::component::Handlers;

/// What the build makes of the definition.
pub mod messages {
    include!(concat!(env!("OUT_DIR"), "/messages.rs"));
}

use messages::report_lamp::Brightness;
use messages::{QueryLamp, ReportLamp, SetLamp, lamp};

/// The service: it remembers how bright the lamp is, and tells it to whoever asks.
pub fn service() -> Handlers {
    let brightness = Arc::new(AtomicU8::new(0));
    let shown = brightness.clone();
    Handlers::new(lamp::LATEST)
        // Here a real one would dim its lamp.
        .receive(move |set: SetLamp, _, _| brightness.store(set.brightness.raw(), Relaxed))
        .answer(move |_: QueryLamp| ReportLamp {
            brightness: Brightness::from_raw(shown.load(Relaxed)),
        })
}
