//! Tests of published reports: what queries and subscribers get, when, and how often it is encoded.

use std::cell::Cell;
use std::time::UNIX_EPOCH;

use super::*;
use crate::codec::{
    DecodeError, EncodeError, Query, Reader, Report, Writer, if_serde, time_stamp, view,
};
use crate::messages::core::report_time::{DateStamp, TimeStamp};
use crate::service::{NotPublished, Publication};

/// 1 January 1970, 00:01.
const SAMPLED_AT: Duration = Duration::from_secs(60);

fn rig(handlers: Handlers) -> StackRig {
    StackRig::new(vec![Box::new(handlers)], |stack| stack)
}

fn publish<R: Report>(rig: &mut StackRig, report: R) -> Result<Vec<(JausId, Bytes)>, NotPublished> {
    let publication = Publication::new(report, UNIX_EPOCH + SAMPLED_AT);
    rig.stack.publish(rig.now, &publication)?;
    Ok(rig.said())
}

fn count(element_count: u16) -> ReportElementCount {
    ReportElementCount { element_count }
}

fn on_each_change<Q: Message>(query: &Q) -> CreateEvent {
    CreateEvent {
        event_type: EventType(1),
        ..periodic(1, 0.0, query)
    }
}

#[test]
fn queries_and_subscribers_get_the_latest_report_with_the_fields_that_they_request() {
    let mut rig = rig(Handlers::new(time::LATEST).publishes::<QueryTime>());
    let with_time = QueryTime::none().with_time_stamp();
    let with_date = QueryTime::none().with_date_stamp();
    rig.hear(CLIENT, &on_each_change(&with_time));
    rig.hear(OTHER, &periodic(1, 1.0, &with_date));
    rig.pass(SECOND);
    let date_stamp = Some(DateStamp::default());
    let report = ReportTime {
        date_stamp,
        ..ReportTime::default()
    };
    let said = publish(&mut rig, report).unwrap();
    let told = |said: &[(JausId, Bytes)]| {
        let [event] = &*events(said) else {
            panic!("not one event: {said:?}");
        };
        ReportTime::decode(&event.report_message).unwrap()
    };
    let stamped = ReportTime {
        time_stamp: Some(TimeStamp(time_stamp(SAMPLED_AT))),
        ..ReportTime::default()
    };
    assert_eq!((said[0].0, told(&said)), (CLIENT, stamped.clone()));
    let dated = ReportTime {
        date_stamp,
        ..ReportTime::default()
    };
    let said = rig.pass(SECOND);
    assert_eq!((said[0].0, told(&said)), (OTHER, dated.clone()));
    for (query, expected) in [(with_time, stamped), (with_date, dated)] {
        let report: ReportTime = answer(&rig.hear(CLIENT, &query));
        assert_eq!(report, expected);
    }
}

#[test]
fn a_time_that_the_application_has_set_is_kept() {
    let mut rig = rig(Handlers::new(time::LATEST).publishes::<QueryTime>());
    let report = ReportTime {
        time_stamp: Some(TimeStamp(7)),
        ..ReportTime::default()
    };
    publish(&mut rig, report.clone()).unwrap();
    let told: ReportTime = answer(&rig.hear(CLIENT, &QueryTime::all()));
    assert_eq!(told, report);
}

#[test]
fn before_the_first_report_the_answer_has_no_values_and_none_if_values_are_required() {
    let handlers = Handlers::new(time::LATEST)
        .publishes::<QueryTime>()
        .publishes::<QueryElementCount>();
    let mut rig = rig(handlers);
    let empty: ReportTime = answer(&rig.hear(CLIENT, &QueryTime::all()));
    assert_eq!(empty, ReportTime::default());
    assert_eq!(rig.hear(CLIENT, &QueryElementCount), []);
    let create = on_each_change(&QueryElementCount);
    let _: RejectEventRequest = answer(&rig.hear(CLIENT, &create));
    publish(&mut rig, count(5)).unwrap();
    assert_eq!(
        answer::<ReportElementCount>(&rig.hear(CLIENT, &QueryElementCount)),
        count(5)
    );
    let _: ConfirmEventRequest = answer(&rig.hear(CLIENT, &create));
}

#[test]
fn a_report_that_no_service_publishes_is_an_error_that_says_what_to_do() {
    let mut rig = rig(Handlers::new(time::LATEST).publishes::<QueryTime>());
    let error = publish(&mut rig, count(5)).unwrap_err();
    assert!(error.to_string().contains("ReportElementCount"), "{error}");
    rig.stack.withdraw(rig.now, time::URN);
    publish(&mut rig, ReportTime::default()).unwrap_err();
}

#[test]
fn a_service_publishes_from_its_handlers() {
    let handlers = Handlers::new(COUNTER)
        .publishes::<QueryElementCount>()
        .receive(|set: QueryElement, _, context| {
            context.publish(count(set.element_uid), UNIX_EPOCH);
        });
    let mut rig = rig(handlers);
    for element_uid in [7, 8] {
        rig.hear(OTHER, &QueryElement { element_uid });
        let report: ReportElementCount = answer(&rig.hear(CLIENT, &QueryElementCount));
        assert_eq!(report.element_count, element_uid);
    }
}

thread_local! {
    static ENCODED: Cell<u32> = const { Cell::new(0) };
}

/// Wraps a message in one that counts how often it is encoded.
macro_rules! counted {
    ($name:ident($message:ident)) => {
        #[derive(Debug, Clone, PartialEq)]
        struct $name($message);

        impl Message for $name {
            const CODE: u16 = $message::CODE;
            const NAME: &'static str = $message::NAME;
            const IS_COMMAND: bool = false;
            const NEEDS_CONTROL: bool = false;

            fn encoded_len(&self) -> usize {
                self.0.encoded_len()
            }

            fn write(&self, output: &mut Writer<'_>) -> Result<(), EncodeError> {
                ENCODED.set(ENCODED.get() + 1);
                self.0.write(output)
            }

            fn read(input: &mut Reader<'_>) -> Result<Self, DecodeError> {
                $message::read(input).map(Self)
            }
        }

        if_serde! {
            impl view::View for $name {
                fn view(&self) -> view::Value {
                    self.0.view()
                }

                fn from_view(value: &view::Value) -> Result<Self, view::Error> {
                    $message::from_view(value).map(Self)
                }
            }
        }
    };
}

counted!(CountedQuery(QueryElement));
counted!(CountedReport(ReportElementCount));

impl Query for CountedQuery {
    type Report = CountedReport;
}

impl Report for CountedReport {}

#[test]
fn a_report_is_encoded_once_for_all_clients_with_the_same_query() {
    let mut rig = rig(Handlers::new(COUNTER).publishes::<CountedQuery>());
    publish(&mut rig, CountedReport(count(1))).unwrap();
    let query = QueryElement::default();
    for client in 1..=100 {
        let client = JausId::new(42, 1, client);
        rig.now += Duration::from_millis(3);
        rig.hear(client, &on_each_change(&query));
        rig.hear(client, &periodic(2, 1.0, &query));
    }
    rig.run(SECOND);
    ENCODED.set(0);
    let on_change = publish(&mut rig, CountedReport(count(2))).unwrap();
    let periodic = rig.run(SECOND);
    let queried: ReportElementCount = answer(&rig.hear(CLIENT, &query));
    assert_eq!(
        (on_change.len(), periodic.len(), queried),
        (100, 100, count(2))
    );
    assert_eq!(ENCODED.get(), 1);
    // Another query requests other fields.
    rig.hear(CLIENT, &QueryElement { element_uid: 1 });
    assert_eq!(ENCODED.get(), 2);
}
