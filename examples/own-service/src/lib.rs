//! The service `urn:example:Lamp`, from its definition in `services/Lamp.xml`.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering::Relaxed};

use jaus::component::Handlers;

/// Generated from the definition at build time.
pub mod messages {
    include!(concat!(env!("OUT_DIR"), "/messages.rs"));
}

use messages::report_lamp::Brightness;
use messages::{QueryLamp, ReportLamp, SetLamp, lamp};

/// The service: it stores the brightness set by the client in control, and reports it to any
/// client.
pub fn service() -> Handlers {
    let brightness = Arc::new(AtomicU8::new(0));
    let shown = brightness.clone();
    Handlers::new(lamp::LATEST)
        // A real lamp would be dimmed here. To move something, register a command with `command`
        // instead, and stop it with `on_stop`.
        .configure(move |set: SetLamp, _, _| brightness.store(set.brightness.raw(), Relaxed))
        .answer(move |_: QueryLamp| ReportLamp {
            brightness: Brightness::from_raw(shown.load(Relaxed)),
        })
}
