//! Messages on the command line: the name, and the fields as JSON or by their names.

use bytes::Bytes;
use clap::Args;
use jaus_cli::failure::Failure;
use jaus_view::{Dictionary, EncodedQuery, Request, Unreadable};
use serde_json::Value as Json;

/// The choice of a report's fields.
#[derive(Args)]
pub(crate) struct Fields {
    /// Request only these optional fields of the report, by name [default: all]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    fields: Vec<String>,
}

/// A message's name with its body, if one is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Named<'a> {
    pub(crate) message: &'a str,
    pub(crate) json: Option<&'a str>,
}

impl<'a> Named<'a> {
    /// Splits arguments such as `QueryA '{"X":1}' QueryB` into messages.
    pub(crate) fn all(arguments: &'a [String]) -> Result<Vec<Self>, Failure> {
        let mut all: Vec<Self> = Vec::new();
        for argument in arguments {
            match all.last_mut() {
                Some(it) if argument.starts_with('{') && it.json.is_none() => {
                    it.json = Some(argument);
                }
                _ if argument.starts_with('{') => {
                    return Err(Failure::new(format!(
                        "{argument} follows no message: write its name first"
                    )));
                }
                _ => all.push(Self {
                    message: argument,
                    json: None,
                }),
            }
        }
        Ok(all)
    }

    pub(crate) fn request(self) -> Result<Request, Failure> {
        let json = self.json.unwrap_or("{}");
        let body: Json = serde_json::from_str(json).map_err(|error| {
            Failure::new(format!(
                "the fields of {} are not JSON: {error}: {json}. Write names and texts in double \
                 quotes, and the whole in single quotes, as in '{{\"QueryType\":2}}'",
                self.message
            ))
        })?;
        Ok(Request::new(self.message, body))
    }

    /// Explains why the message was not encoded.
    pub(crate) fn failure(self, dictionary: &Dictionary, error: &Unreadable) -> Failure {
        let is_empty = self.json.is_none() && dictionary.defines(self.message);
        let is_about_fields = error.problem.starts_with(&format!("{}: ", self.message))
            || error.problem.starts_with(&format!("{}.", self.message));
        if is_empty && is_about_fields {
            return Failure::new(format!(
                "{error}. Give the fields as JSON after the name, as in QueryIdentification \
                 '{{\"QueryType\":2}}'; `jaus list fields {}` shows them",
                self.message
            ));
        }
        Failure::of(error.clone())
    }
}

impl Fields {
    /// Encodes queries, which request the chosen fields: each of those that it knows, or all if it
    /// knows none.
    pub(crate) fn encode(
        &self,
        dictionary: &Dictionary,
        queries: &[Named<'_>],
    ) -> Result<Vec<EncodedQuery>, Failure> {
        let mut known: Vec<Vec<String>> = Vec::new();
        for query in queries {
            let fields = dictionary.requestable_fields(&query.request()?);
            known.push(fields.map_err(|error| query.failure(dictionary, &error))?);
        }
        let encode = |(query, known): (&Named<'_>, &Vec<String>)| {
            // With one query, an unknown field is an error of that query.
            let is_known = |field: &&String| queries.len() == 1 || has(known, field);
            let fields: Vec<_> = self.fields.iter().filter(is_known).cloned().collect();
            let encoded = dictionary.query(&query.request()?, &fields);
            encoded.map_err(|error| query.failure(dictionary, &error))
        };
        let encoded = queries.iter().zip(&known).map(encode).collect();
        let unknown = |field: &&String| !known.iter().any(|known| has(known, field));
        match self.fields.iter().find(unknown) {
            Some(field) if queries.len() > 1 => Err(Failure::new(format!(
                "none of the queries has a field {field}: choose from {}",
                known.concat().join(", ")
            ))),
            _ => encoded,
        }
    }
}

/// A report for people: its name, and its fields with units and names of values.
pub(crate) fn in_words(dictionary: &Dictionary, octets: &Bytes) -> String {
    let line = dictionary.line(octets);
    let name = line.message.unwrap_or("unknown report");
    let fields: String = match dictionary.fields_in_words(octets) {
        Ok(fields) => fields
            .iter()
            .map(|it| format!("  {} {}", it.field, it.value))
            .collect(),
        Err(unreadable) => format!("  {unreadable}"),
    };
    format!("{name}{fields}")
}

fn has(known: &[String], field: &str) -> bool {
    known.iter().any(|it| jaus_view::is_same_name(it, field))
}
