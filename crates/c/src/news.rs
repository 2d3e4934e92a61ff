//! What a component tells its program by itself: its standing, and the components that it finds.

use jaus::address::JausId;
use jaus::component::{Change, Component};
use tokio::task::AbortHandle;

use crate::event::Event;
use crate::sink::Sink;
use crate::types::JausEventKind;

/// The address of no component.
pub(crate) const NOBODY: JausId = JausId::new(0, 0, 0);

/// Tells a sink of each change of the component's standing. On the library's runtime.
pub(crate) fn of_standing(component: &Component, sink: Sink) -> AbortHandle {
    let mut standings = component.watch_standing();
    let task = async move {
        while standings.changed().await.is_ok() {
            let standing = *standings.borrow_and_update();
            let controller = standing.controller.map_or(NOBODY, |it| it.id);
            sink.tell(Event {
                value: standing.state as u8,
                ..Event::new(JausEventKind::Standing, controller)
            });
        }
    };
    tokio::runtime::Handle::current().spawn(task).abort_handle()
}

/// Tells a sink of components that are found and lost. On the library's runtime.
pub(crate) fn of_discovery(component: &Component, sink: Sink) -> AbortHandle {
    let mut changes = component.watch();
    let task = async move {
        while let Some(change) = changes.next().await {
            match change {
                Change::Services(id) => sink.tell(Event::new(JausEventKind::Found, id)),
                Change::Lost(id, _) => sink.tell(Event::new(JausEventKind::Lost, id)),
                _ => {}
            }
        }
    };
    tokio::runtime::Handle::current().spawn(task).abort_handle()
}
