//! Tests of the state machines of Events, Access Control and Management: the generated ones against
//! expectations written by hand and against the dynamic ones, and the services of this library
//! against the generated ones.

mod control;
mod events;
mod random;
mod recorder;
mod table;
