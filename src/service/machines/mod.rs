//! Tests of the state machines of Events, Access Control and Management: the generated ones against
//! handwritten expectations and against the dynamic ones, and this library's services against the
//! generated ones.

mod control;
mod events;
mod random;
mod recorder;
mod table;
