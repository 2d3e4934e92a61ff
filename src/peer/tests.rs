//! Who is recognised by what, and that the table tells the truth.

mod recognising;
mod table;
