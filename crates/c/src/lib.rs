//! The C interface of the SAE JAUS node stack [`jaus`], in `include/jaus.h`; `include/jaus.hpp` wraps it
//! for C++17. The book's page "C and C++" shows how to use both.
//!
//! # Rules of the interface
//!
//! - **Handles** are numbers of objects in tables. A handle that is zero, freed or of another type is an
//!   error ([`JausStatus::InvalidHandle`]), as is a null pointer.
//! - **Errors** are codes; `jaus_last_error` has the reason in words, for each thread.
//! - **Texts** are UTF-8 and end with a 0. Lengths of messages are explicit. Arguments are copied.
//! - **Messages** cross the interface encoded, from their message code.
//! - **Threads**: every function may be called on any thread at any time, but for
//!   `jaus_component_next_event`, which one thread at a time may call for a component. Functions that
//!   wait fail in callbacks ([`JausStatus::WrongThread`]).
//! - **Panics** do not cross the interface: they become [`JausStatus::Internal`] where panics unwind, and
//!   otherwise abort.
//! - **Fork**: a child process must not use the library.
//!
//! # Threads of the library
//!
//! A node has one thread, on which its links, components, services and callbacks run. A callback that
//! blocks therefore blocks the whole node: its peers see it as dead, as they must. A second thread
//! watches: after 500 ms it calls the stop callbacks of the node's components (`src/watchdog.rs`).
//! Messages without a callback wait in a queue for a program with its own loop; a program that does not
//! fetch its commands in time hangs, too (`Attended` of the crate `jaus-binding`).
#![cfg(unix)]

mod argument;
mod callback;
mod client;
mod component;
mod control;
mod ends;
mod event;
mod log;
mod node;
mod notices;
mod runtime;
mod service;
mod sink;
mod status;
mod subscription;
mod table;
mod types;
mod watchdog;

pub use client::{
    jaus_component_clear_emergency, jaus_component_deliver, jaus_component_find,
    jaus_component_providers, jaus_component_query, jaus_component_send,
    jaus_component_set_emergency, jaus_message_free,
};
pub use component::{
    jaus_component_create, jaus_component_start, jaus_component_use_access_control,
    jaus_component_use_management,
};
pub use control::{
    jaus_component_control, jaus_control_check, jaus_control_deliver, jaus_control_free,
    jaus_control_resume, jaus_control_send, jaus_control_standby, jaus_control_watch_program,
};
pub use ends::{jaus_component_free, jaus_node_free};
pub use log::jaus_log_to_stderr;
pub use node::{
    jaus_node_add_peer, jaus_node_create, jaus_node_of_host, jaus_node_serve_host, jaus_node_start,
    jaus_node_use_group, jaus_node_use_interface, jaus_node_use_loopback, jaus_node_use_port,
};
pub use notices::{
    jaus_component_address, jaus_component_changed, jaus_component_descriptor,
    jaus_component_dropped_events, jaus_component_next_event, jaus_component_on_discovery,
    jaus_component_on_standing, jaus_component_publish, jaus_component_set_condition,
    jaus_component_standing,
};
pub use service::{
    jaus_answer_set, jaus_component_offer, jaus_service_answer, jaus_service_command,
    jaus_service_configure, jaus_service_decline, jaus_service_on_stop, jaus_service_publish,
    jaus_service_receive,
};
pub use status::{JausStatus, jaus_last_error, jaus_version};
pub use subscription::{jaus_component_subscribe, jaus_subscription_free, jaus_subscription_state};
pub use types::*;
