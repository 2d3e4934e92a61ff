//! Diagnostics of a load: every finding with its location and a sentence that says what to do.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt;
use std::path::Path;
use std::sync::Arc;

use crate::model::Location;
use crate::source::{Sources, Span};

/// Severity of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Usable, but the author should look at it. Published definitions have such findings.
    Warning,
    /// The definition is left out of the library. In a readable state machine: the transition or
    /// state can never take effect.
    Error,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Warning => "warning",
            Self::Error => "error",
        })
    }
}

/// Secondary location of a finding.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Note {
    /// The place.
    pub location: Location,
    /// What to see there.
    pub message: String,
}

/// One finding. Displayed as `file:line:column: error: sentence`, each note on a further line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// Error or warning.
    pub severity: Severity,
    /// Where to look first.
    pub location: Location,
    /// The mistake and its remedy.
    pub message: String,
    /// Secondary locations.
    pub notes: Vec<Note>,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}: {}", self.location, self.severity, self.message)?;
        for note in &self.notes {
            write!(f, "\n  {}: note: {}", note.location, note.message)?;
        }
        Ok(())
    }
}

/// All findings of a load, ordered by file and position.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Diagnostics {
    findings: Vec<Diagnostic>,
    /// Texts of the files with findings.
    texts: BTreeMap<Arc<Path>, Arc<str>>,
}

impl Diagnostics {
    /// Whether any definition was left out.
    pub fn has_errors(&self) -> bool {
        self.errors().next().is_some()
    }

    /// Whether there are no findings.
    pub fn is_empty(&self) -> bool {
        self.findings.is_empty()
    }

    /// Number of findings.
    pub fn len(&self) -> usize {
        self.findings.len()
    }

    /// All findings.
    pub fn iter(&self) -> std::slice::Iter<'_, Diagnostic> {
        self.findings.iter()
    }

    /// The errors.
    pub fn errors(&self) -> impl Iterator<Item = &Diagnostic> {
        self.iter().filter(|d| d.severity == Severity::Error)
    }

    /// The warnings.
    pub fn warnings(&self) -> impl Iterator<Item = &Diagnostic> {
        self.iter().filter(|d| d.severity == Severity::Warning)
    }

    /// Texts of the files with findings.
    #[cfg(feature = "excerpts")]
    pub(crate) fn texts(&self) -> &BTreeMap<Arc<Path>, Arc<str>> {
        &self.texts
    }
}

impl<'a> IntoIterator for &'a Diagnostics {
    type Item = &'a Diagnostic;
    type IntoIter = std::slice::Iter<'a, Diagnostic>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl IntoIterator for Diagnostics {
    type Item = Diagnostic;
    type IntoIter = std::vec::IntoIter<Diagnostic>;

    fn into_iter(self) -> Self::IntoIter {
        self.findings.into_iter()
    }
}

impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.iter().try_for_each(|d| writeln!(f, "{d}"))
    }
}

/// A finding with unresolved offsets.
#[derive(Debug)]
pub(crate) struct Finding {
    severity: Severity,
    span: Span,
    message: String,
    notes: Vec<(Span, String)>,
}

impl Finding {
    /// Adds a secondary location.
    pub(crate) fn note(&mut self, span: Span, message: impl Into<String>) -> &mut Self {
        self.notes.push((span, message.into()));
        self
    }
}

/// Collects findings during a load.
#[derive(Debug, Default)]
pub(crate) struct Report {
    findings: Vec<Finding>,
    errors: usize,
}

impl Report {
    /// Reports a mistake that makes a definition unusable.
    pub(crate) fn error(&mut self, span: Span, message: impl Into<String>) -> &mut Finding {
        self.errors += 1;
        self.add(Severity::Error, span, message.into())
    }

    /// Reports names that occur twice among `what`, a plural; empty ones are reported elsewhere.
    /// Returns whether there are none.
    pub(crate) fn unique<'n>(
        &mut self,
        what: &str,
        names: impl Iterator<Item = (&'n str, Span)>,
    ) -> bool {
        let mut seen = HashMap::new();
        let mut sound = true;
        for (name, span) in names.filter(|(name, _)| !name.is_empty()) {
            if let Some(first) = seen.insert(name, span) {
                let twice = format!("there are two {what} named `{name}`: rename one");
                self.error(span, twice).note(first, "the other one");
                sound = false;
            }
        }
        sound
    }

    /// Reports a questionable but permitted construct.
    pub(crate) fn warning(&mut self, span: Span, message: impl Into<String>) -> &mut Finding {
        self.add(Severity::Warning, span, message.into())
    }

    /// Number of errors so far.
    pub(crate) fn errors(&self) -> usize {
        self.errors
    }

    fn add(&mut self, severity: Severity, span: Span, message: String) -> &mut Finding {
        let index = self.findings.len();
        self.findings.push(Finding {
            severity,
            span,
            message,
            notes: Vec::new(),
        });
        &mut self.findings[index]
    }

    /// Orders the findings and turns offsets into lines and columns.
    pub(crate) fn finish(mut self, sources: &Sources) -> Diagnostics {
        self.findings.sort_by_key(|finding| finding.span);
        // The strict check repeats findings of the reader.
        let mut seen = HashSet::new();
        self.findings
            .retain(|finding| seen.insert((finding.span, finding.message.clone())));
        let spans = |finding: &Finding| {
            let notes = finding.notes.iter().map(|(span, _)| *span);
            std::iter::once(finding.span)
                .chain(notes)
                .collect::<Vec<_>>()
        };
        let texts = self.findings.iter().flat_map(spans);
        let texts = texts.map(|span| sources.text(span)).collect();
        let located = self.findings.into_iter().map(|finding| Diagnostic {
            severity: finding.severity,
            location: sources.location(finding.span),
            message: finding.message,
            notes: finding
                .notes
                .into_iter()
                .map(|(span, message)| Note {
                    location: sources.location(span),
                    message,
                })
                .collect(),
        });
        Diagnostics {
            findings: located.collect(),
            texts,
        }
    }
}
