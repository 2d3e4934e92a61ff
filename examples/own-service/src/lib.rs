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

/// The service: it keeps the brightness that the client in control sets, and reports it to anyone.
pub fn service() -> Handlers {
    let brightness = Arc::new(AtomicU8::new(0));
    let shown = brightness.clone();
    Handlers::new(lamp::LATEST)
        // Here a real one would dim its lamp. A command that moves something is taken with `command`
        // instead, and stopped with `on_stop`.
        .configure(move |set: SetLamp, _, _| brightness.store(set.brightness.raw(), Relaxed))
        .answer(move |_: QueryLamp| ReportLamp {
            brightness: Brightness::from_raw(shown.load(Relaxed)),
        })
}
