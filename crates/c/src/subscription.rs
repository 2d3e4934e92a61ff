//! Subscriptions to the reports of peers.

use std::ffi::c_void;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use jaus::component::{SubscribeError, Subscription, Undecoded, When};
use jaus::node::now;
use jaus::service::Topic;
use jaus_binding::{Step, follow_reports, lock};
use tokio::task::JoinHandle;

use crate::argument::{check_out, message, one_component, put};
use crate::client::report_of;
use crate::component::{ComponentEntry, check_not_freed, running};
use crate::event::Event;
use crate::sink::Sink;
use crate::status::{Failure, JausStatus, run};
use crate::table::Table;
use crate::types::{
    JausAddress, JausComponent, JausEventCallback, JausEventKind, JausSubscription,
    JausSubscriptionState,
};

static SUBSCRIPTIONS: Table<SubscriptionEntry> = Table::new("subscription");

/// A subscription of the program.
struct SubscriptionEntry {
    component: Arc<ComponentEntry>,
    sink: Sink,
    shown: Arc<Mutex<Shown>>,
    task: Mutex<Option<JoinHandle<()>>>,
}

/// The state of a subscription at its last update.
#[derive(Default)]
struct Shown {
    state: JausSubscriptionState,
    arrived: Option<Instant>,
}

impl Shown {
    fn note(&mut self, reports: &Subscription<Undecoded>, is_report: bool) {
        self.state.is_up = reports.is_up();
        self.state.rate = reports.hz().unwrap_or_default();
        self.state.lost = reports.lost();
        self.state.missed = reports.missed();
        if is_report {
            self.arrived = reports.age().map(|age| now() - age);
        }
    }
}

fn not_subscribed(error: &SubscribeError) -> Failure {
    let status = match error {
        SubscribeError::Impossible { .. } => JausStatus::InvalidArgument,
        SubscribeError::Ended { .. } => JausStatus::Refused,
        SubscribeError::Stopped => JausStatus::Stopped,
        _ => JausStatus::NotSent,
    };
    Failure::of(status, error)
}

/// Passes updates on until the subscription ends.
async fn follow(
    reports: Subscription<Undecoded>,
    subject: u64,
    shown: Arc<Mutex<Shown>>,
    sink: Sink,
) {
    let peer = reports.peer();
    let event = |kind| Event {
        subject,
        ..Event::new(kind, peer)
    };
    follow_reports(reports, |reports, step| {
        lock(&shown).note(reports, matches!(step, Step::Report(_)));
        sink.tell(match step {
            Step::Report(message) => Event {
                message,
                arrived: lock(&shown).arrived,
                lost: reports.lost(),
                ..event(JausEventKind::Report)
            },
            Step::Up => Event {
                rate: reports.hz().unwrap_or_default(),
                ..event(JausEventKind::SubscriptionUp)
            },
            Step::Down(why) => event(JausEventKind::SubscriptionDown).because(&why),
            Step::Ended(why) => event(JausEventKind::SubscriptionEnded).because(&why),
            Step::Stopped => {
                event(JausEventKind::SubscriptionEnded).because(&"the component has stopped")
            }
        });
    })
    .await;
}

impl SubscriptionEntry {
    /// Ends the subscription. Waits for a callback that runs, but not in a callback.
    fn end(&self) {
        let task = lock(&self.task).take();
        if let Some(task) = task {
            self.component.node.runtime.end(task);
        }
        self.sink.close();
    }
}

/// Ends the subscriptions of a component, and frees them.
pub(crate) fn end_all_of(component: &Arc<ComponentEntry>) {
    for subscribed in SUBSCRIPTIONS.remove_all(|it| Arc::ptr_eq(&it.component, component)) {
        subscribed.end();
    }
}

/// Subscribes to the answers to a query, `length` octets from its code, and waits until the peer
/// confirms. `report` is the code of the report (0: as the standard's numbers give it). `rate` is in
/// hertz, 1/60 to 1092; 0 means on every change. With `least`, also in hertz, a lower confirmed rate is
/// an error. Not in a callback.
///
/// The subscription renews itself, and survives failures of the peer, until it is freed. Its events are
/// `JausEventKind_Report`, `..._SubscriptionUp`, `..._SubscriptionDown` and `..._SubscriptionEnded`.
/// Without a callback they are events of the component.
///
/// # Safety
/// `data` is null, or points to `length` octets. Until the subscription or the component is freed,
/// `callback` can be called with `user` on any thread. `subscription` is null, or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_component_subscribe(
    component: JausComponent,
    peer: JausAddress,
    data: *const u8,
    length: usize,
    report: u16,
    rate: f64,
    least: f64,
    callback: JausEventCallback,
    user: *mut c_void,
    subscription: *mut JausSubscription,
) -> JausStatus {
    run(|| {
        check_out(subscription, "subscription")?;
        // SAFETY: as the caller guarantees.
        let query = unsafe { message(data, length) }?;
        let topic = Topic {
            peer: one_component(peer)?,
            report: report_of(&query, report)?,
            query,
            when: when(rate, least)?,
        };
        SUBSCRIPTIONS.check_room()?;
        let (entry, running) = running(component)?;
        let runtime = entry.node.runtime.handle().clone();
        let reports = entry
            .node
            .runtime
            .wait(running.subscribe_undecoded(topic))?;
        let reports = reports.map_err(|error| not_subscribed(&error))?;
        drop(running);
        // SAFETY: as the caller guarantees; it is closed with the subscription.
        let sink = unsafe { Sink::new(callback, user, &entry.queue, entry.watchdog()) };
        let id = Table::<SubscriptionEntry>::reserve();
        // Before the first event, which names it.
        // SAFETY: as the caller guarantees.
        unsafe { put(subscription, JausSubscription { id }, "subscription") }?;
        let shown = Arc::<Mutex<Shown>>::default();
        lock(&shown).note(&reports, false);
        let following = follow(reports, id, shown.clone(), sink.clone());
        let subscribed = SubscriptionEntry {
            component: entry,
            sink,
            shown,
            task: Mutex::default(),
        };
        let subscribed = SUBSCRIPTIONS.insert(id, subscribed);
        // From now on freeing the component ends this subscription, too, so that no callback follows.
        let mut task = lock(&subscribed.task);
        if let Err(freed) = check_not_freed(component) {
            drop(task);
            if let Ok(subscribed) = SUBSCRIPTIONS.remove(id) {
                subscribed.end();
            }
            return Err(freed);
        }
        *task = Some(runtime.spawn(following));
        Ok(())
    })
}

fn when(rate: f64, least: f64) -> Result<When, Failure> {
    match rate {
        0.0 => Ok(When::OnChange),
        rate if rate > 0.0 && least >= 0.0 => Ok(When::hz(rate).at_least(least)),
        _ => Err(Failure::argument(format!(
            "{rate} Hz, at least {least} Hz: neither may be negative"
        ))),
    }
}

/// The state of a subscription as of its last event.
///
/// # Safety
/// `state` is null, or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_subscription_state(
    subscription: JausSubscription,
    state: *mut JausSubscriptionState,
) -> JausStatus {
    run(|| {
        let entry = SUBSCRIPTIONS.get(subscription.id)?;
        let shown = lock(&entry.shown);
        let age = shown.arrived.map(|arrived| (now() - arrived).as_secs_f64());
        let current = JausSubscriptionState {
            age: age.unwrap_or(-1.0),
            ..shown.state
        };
        // SAFETY: as the caller guarantees.
        unsafe { put(state, current, "state") }
    })
}

/// Ends a subscription and frees it. When it returns, its callback will not be called any more, but for
/// a call that runs when this is called in it.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_subscription_free(subscription: JausSubscription) -> JausStatus {
    run(|| {
        SUBSCRIPTIONS.remove(subscription.id)?.end();
        Ok(())
    })
}
