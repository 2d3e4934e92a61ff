//! The texts of events in printable characters, before any form of the log writes them.

use std::fmt::Debug;

use jaus_text::visible;
use tracing::field::{Field, FieldSet, Value, ValueSet, Visit, display};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Metadata, Subscriber};
use tracing_subscriber::layer::{Context, Layer};
use tracing_subscriber::registry::LookupSpan;

/// Most fields of one event, as the macros of tracing have it.
const MOST: usize = 32;

/// Hands events and spans to the layer that writes them, with the texts of all fields
/// [visible](jaus_text::visible): an event can hold text of a peer in any of them.
pub(super) struct Visible<L>(pub(super) L);

impl<S, L> Layer<S> for Visible<L>
where
    S: Subscriber + for<'l> LookupSpan<'l>,
    L: Layer<S>,
{
    fn on_new_span(&self, attributes: &Attributes<'_>, id: &Id, context: Context<'_, S>) {
        let metadata = attributes.metadata();
        let mut texts = Fields::default();
        attributes.record(&mut texts);
        texts.of(metadata.fields(), |values| {
            let visible = match attributes.parent() {
                Some(parent) => Attributes::child_of(parent.clone(), metadata, values),
                None if attributes.is_root() => Attributes::new_root(metadata, values),
                None => Attributes::new(metadata, values),
            };
            self.0.on_new_span(&visible, id, context);
        });
    }

    fn on_record(&self, id: &Id, record: &Record<'_>, context: Context<'_, S>) {
        let Some(metadata) = context.metadata(id) else {
            return;
        };
        let mut texts = Fields::default();
        record.record(&mut texts);
        texts.of(metadata.fields(), |values| {
            self.0.on_record(id, &Record::new(values), context);
        });
    }

    fn on_event(&self, event: &Event<'_>, context: Context<'_, S>) {
        let metadata: &'static Metadata<'static> = event.metadata();
        let mut texts = Fields::default();
        event.record(&mut texts);
        texts.of(metadata.fields(), |values| {
            let visible = match event.is_contextual() {
                true => Event::new(metadata, values),
                false => Event::new_child_of(event.parent().cloned(), metadata, values),
            };
            self.0.on_event(&visible, context);
        });
    }
}

/// Fields and their values.
#[derive(Default)]
struct Fields(Vec<(Field, Box<dyn Value>)>);

impl Fields {
    /// Calls `then` with the values.
    fn of(&self, fields: &FieldSet, then: impl FnOnce(&ValueSet<'_>)) {
        let Some((first, _)) = self.0.first() else {
            return then(&fields.value_set(&[]));
        };
        // A field without a value is no field.
        let mut values: [(&Field, Option<&dyn Value>); MOST] = [(first, None); MOST];
        for (place, (field, value)) in values.iter_mut().zip(&self.0) {
            *place = (field, Some(&**value));
        }
        then(&fields.value_set(&values));
    }

    fn add(&mut self, field: &Field, value: impl Value + 'static) {
        self.0.push((field.clone(), Box::new(value)));
    }
}

impl Visit for Fields {
    fn record_f64(&mut self, field: &Field, value: f64) {
        self.add(field, value);
    }

    fn record_i64(&mut self, field: &Field, value: i64) {
        self.add(field, value);
    }

    fn record_u64(&mut self, field: &Field, value: u64) {
        self.add(field, value);
    }

    fn record_i128(&mut self, field: &Field, value: i128) {
        self.add(field, value);
    }

    fn record_u128(&mut self, field: &Field, value: u128) {
        self.add(field, value);
    }

    fn record_bool(&mut self, field: &Field, value: bool) {
        self.add(field, value);
    }

    fn record_str(&mut self, field: &Field, value: &str) {
        self.add(field, visible(value).into_owned());
    }

    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        self.add(field, display(visible(&format!("{value:?}")).into_owned()));
    }
}

#[cfg(test)]
mod tests {
    use std::fmt;
    use std::io::{self, Write};
    use std::sync::{Arc, Mutex};

    use jaus_text::is_unprintable;
    use tracing_subscriber::layer::SubscriberExt as _;

    use super::*;

    #[derive(Clone, Default)]
    struct Written(Arc<Mutex<Vec<u8>>>);

    impl Write for Written {
        fn write(&mut self, octets: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().extend_from_slice(octets);
            Ok(octets.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    const NAME: &str = "Müller \x1b]0;title\x07\x1b[8m\r\nfake line \u{202e}\u{9b}2J\u{200b}";

    /// An error that names a peer.
    #[derive(Debug)]
    struct Fault;

    impl fmt::Display for Fault {
        fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str(NAME)
        }
    }

    impl std::error::Error for Fault {}

    fn log_hostile_text() {
        let error: &(dyn std::error::Error + 'static) = &Fault;
        let span = tracing::info_span!("peer", name = %NAME, later = tracing::field::Empty);
        let _span = span.enter();
        span.record("later", NAME);
        tracing::info!(text = NAME, shown = %Fault, debug = ?NAME, error, count = 7, "from {NAME}");
    }

    /// The log of hostile text in a form; with colours of our own, if it has any.
    fn logged(json: bool, colours: bool) -> String {
        let written = Written::default();
        let to = written.clone();
        let layer = tracing_subscriber::fmt::layer()
            .with_ansi(colours)
            .with_writer(move || to.clone());
        let layer = match json {
            true => Visible(layer.json().flatten_event(true)).boxed(),
            false => Visible(layer).boxed(),
        };
        let log = tracing_subscriber::registry().with(layer);
        tracing::subscriber::with_default(log, log_hostile_text);
        let written = written.0.lock().unwrap().clone();
        String::from_utf8(written).unwrap()
    }

    #[test]
    fn an_event_is_one_printable_line_whatever_its_fields_hold() {
        for json in [false, true] {
            let log = logged(json, false);
            let line = log.strip_suffix('\n').unwrap();
            assert!(!line.contains(is_unprintable), "{line:?}");
            for text in [
                "text", "shown", "debug", "error", "later", "Müller", "title",
            ] {
                assert!(line.contains(text), "{text} is not in {line}");
            }
        }
        let line = logged(false, false);
        assert_eq!(line.matches("title").count(), 7, "{line}");
        let line: serde_json::Value = serde_json::from_str(&logged(true, false)).unwrap();
        assert_eq!(line["count"], 7, "numbers stay numbers");
    }

    #[test]
    fn colours_of_the_log_are_its_own() {
        let log = logged(false, true);
        assert!(log.contains("\x1b[32m INFO\x1b[0m"), "{log:?}");
        assert!(
            !log.contains("\x1b[8m") && !log.contains("\x1b]"),
            "{log:?}"
        );
    }

    #[test]
    fn a_long_text_of_a_field_is_cut() {
        let written = Written::default();
        let to = written.clone();
        let layer = tracing_subscriber::fmt::layer().with_writer(move || to.clone());
        let log = tracing_subscriber::registry().with(Visible(layer));
        let name = "n".repeat(65_000);
        tracing::subscriber::with_default(log, || tracing::info!(name, "a name"));
        let written = written.0.lock().unwrap().clone();
        assert!(written.len() < 1_200, "{}", written.len());
    }
}
