//! Part B, steps 1, 2 and 11: identification and services.

use jaus::messages::core::query_identification::QueryType;
use jaus::messages::core::query_services::{ComponentId, ComponentRec, NodeId, NodeRec, NodeSeq};
use jaus::messages::core::{
    QueryConfiguration, QueryHeartbeatPulse, QueryIdentification, QueryServices,
    QuerySubsystemList, ReportConfiguration, ReportHeartbeatPulse, ReportIdentification,
    ReportSubsystemList, query_configuration,
};

use super::super::memory::Memory;
use super::super::step::{
    Act, Check, Exchange, Part, Reach, Speaker::Main, Step, equal, present, step,
};
use super::challenge::{identifies_a_subsystem, is_named, lists_services};
use super::{DISCOVERY, LIVENESS};

/// Steps 1 and 2.
pub(super) fn first() -> Vec<Step> {
    vec![
        step(Part::B, 1, "Query Identification by broadcast")
            .needs(&[DISCOVERY])
            .act(to_everybody(identify(
                QueryType::COMPONENT_IDENTIFICATION,
                |report, _| {
                    equal("the query type", report.query_type.0, 4)?;
                    is_named(report)
                },
            )))
            .act(to_everybody(identify(
                QueryType::SUBSYSTEM_IDENTIFICATION,
                identifies_a_subsystem,
            ))),
        step(Part::B, 2, "Query Services of all components")
            .needs(&[DISCOVERY])
            .act(to_everybody(query_services())),
    ]
}

/// Step 11.
pub(super) fn again() -> Vec<Step> {
    let pulse =
        Exchange::new(Main, QueryHeartbeatPulse)
            .expect(Main, "", |_: &ReportHeartbeatPulse, _| Ok(()));
    let list = Exchange::new(Main, QuerySubsystemList).expect(
        Main,
        "a list",
        |_: &ReportSubsystemList, _| Ok(()),
    );
    vec![
        step(
            Part::B,
            11,
            "Heartbeat, identification, configuration and services",
        )
        .needs(&[DISCOVERY, LIVENESS])
        .act(pulse.into())
        .act(query_services().into())
        .act(
            identify(QueryType::SYSTEM_IDENTIFICATION, |report, _| {
                equal("the query type", report.query_type.0, 1)?;
                is_named(report)
            })
            .into(),
        )
        .act(identify(QueryType::SUBSYSTEM_IDENTIFICATION, identifies_a_subsystem).into())
        .act(
            identify(QueryType::NODE_IDENTIFICATION, |report, _| {
                equal("the query type", report.query_type.0, 3)?;
                is_named(report)
            })
            .into(),
        )
        .act(
            identify(QueryType::COMPONENT_IDENTIFICATION, |report, _| {
                equal("the query type", report.query_type.0, 4)?;
                is_named(report)
            })
            .into(),
        )
        .act(query_configuration(query_configuration::QueryType::SUBSYSTEM_IDENTIFICATION).into())
        .act(query_configuration(query_configuration::QueryType::NODE_IDENTIFICATION).into())
        .act(list.into()),
    ]
}

fn to_everybody(exchange: Exchange) -> Act {
    exchange.to(Reach::Everyone).into()
}

fn identify(
    query_type: QueryType,
    check: fn(&ReportIdentification, &mut Memory) -> Check,
) -> Exchange {
    Exchange::new(Main, QueryIdentification { query_type }).expect(
        Main,
        "the same query type, a type and a name",
        check,
    )
}

/// Addresses all components of all nodes.
fn query_services() -> Exchange {
    let everything = NodeSeq {
        node_rec: NodeRec {
            node_id: NodeId::ALL_NODES_IN_THE_SUBSYSTEM,
        },
        component_list: vec![ComponentRec {
            component_id: ComponentId::ALL_COMPONENTS_IN_THE_SUBSYSTEM,
        }],
    };
    let query = QueryServices {
        node_list: vec![everything],
    };
    Exchange::new(Main, query)
        .expect(Main, "every service of the component", lists_services)
        .in_parts()
}

fn query_configuration(query_type: query_configuration::QueryType) -> Exchange {
    Exchange::new(Main, QueryConfiguration { query_type }).expect(
        Main,
        "including the subject's component",
        |report: &ReportConfiguration, memory| {
            let subject = memory.subject;
            let nodes = report.node_list.iter();
            let nodes = nodes.filter(|node| node.node_rec.node_id == subject.node());
            let component = nodes
                .flat_map(|node| &node.component_list)
                .find(|component| component.component_id == subject.component());
            present(&format!("component {subject}"), component).map(drop)
        },
    )
}
