//! Reads the system file (TOML), and reports all its mistakes at once, each with line and remedy.

use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use jaus_cli::failure::Failure;
use jaus_cli::settings::{self, Mistake};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::programs::{Programs, home};

/// Parts of this machine, in the order of the file.
#[derive(Debug)]
pub(super) struct System {
    pub(super) parts: Vec<Part>,
}

/// A program to run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Part {
    pub(super) name: String,
    /// The program: a name, which is looked up in the directory of `jaus` and in `PATH`, or a path
    /// relative to the file. The default is `jaus-` and the part's name.
    pub(super) program: PathBuf,
    /// Arguments before the flags, passed unchanged.
    pub(super) arguments: Vec<String>,
    pub(super) environment: Vec<(String, String)>,
    /// Working directory; created if missing.
    pub(super) directory: Option<PathBuf>,
    pub(super) restart: Restart,
    /// The first line of the part in the file.
    pub(super) line: usize,
}

/// Whether a part restarts after it has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Restart {
    /// Whatever its exit status; the default.
    #[default]
    Always,
    /// Unless its exit status is 0.
    OnFailure,
    /// Never.
    Never,
}

/// Keys of the file …
const SECTIONS: [&str; 2] = ["all", "parts"];
/// … of a part …
const PART: [&str; 6] = [
    "program",
    "arguments",
    "flags",
    "environment",
    "directory",
    "restart",
];
/// … and of the defaults of all parts.
const ALL: [&str; 4] = ["flags", "environment", "directory", "restart"];
/// Maximum number of parts on one machine.
const MOST_PARTS: usize = 256;
/// Console name of `jaus up` itself.
pub(super) const OURSELVES: &str = "up";

impl System {
    /// Reads a file and finds the programs.
    ///
    /// # Errors
    /// All mistakes in the file.
    pub(super) fn read(path: &Path, programs: &Programs) -> Result<Self, Failure> {
        let text = fs::read_to_string(path).map_err(|error| Failure::file(path, &error))?;
        let base = path.parent().unwrap_or(Path::new(""));
        let base = std::path::absolute(base).unwrap_or_else(|_| base.to_owned());
        Self::parse(&text, &base, programs).map_err(|mistakes| {
            let told = mistakes
                .iter()
                .map(|mistake| format!("{}:{mistake}", path.display()));
            Failure::new(told.collect::<Vec<_>>().join("\njaus: "))
        })
    }

    /// Parses a text; relative paths start at `base`.
    fn parse(text: &str, base: &Path, programs: &Programs) -> Result<Self, Vec<Mistake>> {
        let table = DeTable::parse(text).map_err(|error| vec![Mistake::of(&error, text)])?;
        let mut reader = Reader {
            text,
            base,
            programs,
            mistakes: Vec::new(),
        };
        let parts = reader.system(table.get_ref());
        match reader.mistakes.is_empty() {
            true => Ok(Self { parts }),
            false => Err(reader.mistakes),
        }
    }

    /// Selects the parts with these names.
    ///
    /// # Errors
    /// A name without a part.
    pub(super) fn only(mut self, names: &[String]) -> Result<Self, Failure> {
        for name in names {
            if self.parts.iter().any(|part| part.name == *name) {
                continue;
            }
            let all = self.parts.iter().map(|part| part.name.as_str());
            let remedy = match settings::nearest(name, all.clone()) {
                Some(nearest) => format!("did you mean `{nearest}`?"),
                None => format!("there are {}", all.collect::<Vec<_>>().join(", ")),
            };
            return Err(Failure::new(format!(
                "--only {name}: there is no part `{name}`; {remedy}"
            )));
        }
        self.parts
            .retain(|part| names.is_empty() || names.contains(&part.name));
        Ok(self)
    }
}

/// Settings of `[all]` and of a part.
#[derive(Debug, Clone, Default)]
struct Common {
    /// Flags by their long names. `true` sets a flag without a value, `false` removes one of `[all]`,
    /// a list sets a flag several times. A flag of a part replaces that of `[all]`.
    flags: BTreeMap<String, Vec<String>>,
    /// Environment variables, in addition to those of `jaus up`.
    environment: BTreeMap<String, String>,
    /// The working directory, relative to the file; `~` is the home directory. It is created if
    /// it is missing. The default is that of `jaus up`.
    directory: Option<PathBuf>,
    /// Whether a part restarts after it has ended. The delay grows with each failure, up to 30 s.
    /// After exit status 2, which reports wrong flags, a part never restarts.
    restart: Restart,
}

/// Reads a file and collects mistakes.
struct Reader<'t> {
    text: &'t str,
    base: &'t Path,
    programs: &'t Programs,
    mistakes: Vec<Mistake>,
}

type Value<'i> = Spanned<DeValue<'i>>;

impl Reader<'_> {
    fn wrong(&mut self, place: Range<usize>, problem: impl Into<String>) {
        let mistake = Mistake::at(Some(place), self.text, problem.into());
        self.mistakes.push(mistake);
    }

    fn system(&mut self, file: &DeTable<'_>) -> Vec<Part> {
        self.check_keys(file, &SECTIONS, "");
        let mut common = Common::default();
        if let Some(all) = file.get("all").and_then(|all| self.table(all, "[all]")) {
            self.check_keys(all, &ALL, "all.");
            self.common(all, &mut common);
        }
        let section = "[parts.NAME] for each part";
        let parts = file.get("parts").and_then(|it| self.table(it, section));
        let mut entries: Vec<_> = parts.into_iter().flatten().collect();
        entries.sort_by_key(|(name, _)| name.span().start);
        if entries.is_empty() && self.mistakes.is_empty() {
            self.wrong(
                0..0,
                "there are no parts: write a section [parts.NAME] for each",
            );
        }
        if let Some((name, _)) = entries.get(MOST_PARTS) {
            self.wrong(name.span(), format!("more than {MOST_PARTS} parts"));
        }
        let mut ids = BTreeMap::new();
        let mut found = Vec::new();
        for (name, entry) in entries {
            let place = name.span();
            let name = name.get_ref();
            self.check_name(place.clone(), name);
            if let Some(entry) = self.table(entry, "a section [parts.NAME]") {
                found.extend(self.part(place.clone(), name, entry, &common));
                self.check_id(name, entry, &mut ids);
            }
        }
        found
    }

    fn part(
        &mut self,
        place: Range<usize>,
        name: &str,
        entry: &DeTable<'_>,
        all: &Common,
    ) -> Option<Part> {
        self.check_keys(entry, &PART, &format!("parts.{name}."));
        let before = self.text.get(..place.start).unwrap_or_default();
        let line = before.matches('\n').count() + 1;
        let mut common = all.clone();
        self.common(entry, &mut common);
        let mut arguments = Vec::new();
        if let Some(value) = entry.get("arguments") {
            arguments = self.texts(value);
        }
        arguments.extend(common.flags.into_values().flatten());
        // The program defaults to the part's name with our prefix.
        let (place, program) = match entry.get("program") {
            Some(value) => (value.span(), self.string(value)?),
            None => (place, format!("jaus-{name}")),
        };
        let program = match self.programs.find(&program, self.base) {
            Ok(program) => program,
            Err(problem) => {
                self.wrong(place, problem);
                return None;
            }
        };
        Some(Part {
            name: name.to_owned(),
            program,
            arguments,
            environment: common.environment.into_iter().collect(),
            directory: common.directory,
            restart: common.restart,
            line,
        })
    }

    fn common(&mut self, entry: &DeTable<'_>, common: &mut Common) {
        let flags = entry.get("flags").and_then(|it| {
            self.table(it, "a table such as { loopback = true, id = \"101.2.33\" }")
        });
        for (name, value) in flags.into_iter().flatten() {
            match settings::flag(name.get_ref(), value) {
                Ok(given) => {
                    common.flags.insert(name.get_ref().to_string(), given);
                }
                Err((place, problem)) => self.wrong(place, problem),
            }
            self.check_flag(name.span(), name.get_ref());
        }
        let environment = entry
            .get("environment")
            .and_then(|it| self.table(it, "a table such as { JAUS_LOG = \"debug\" }"));
        for (name, value) in environment.into_iter().flatten() {
            if let Some(value) = self.string(value) {
                common.environment.insert(name.get_ref().to_string(), value);
            }
        }
        if let Some(directory) = entry.get("directory").and_then(|it| self.string(it)) {
            common.directory = Some(self.base.join(home(&directory)));
        }
        if let Some(value) = entry.get("restart") {
            match value.get_ref().as_str() {
                Some("always") => common.restart = Restart::Always,
                Some("on-failure") => common.restart = Restart::OnFailure,
                Some("never") => common.restart = Restart::Never,
                _ => self.wrong(
                    value.span(),
                    "write \"always\", \"on-failure\" or \"never\"",
                ),
            }
        }
    }

    fn table<'v, 'i>(&mut self, value: &'v Value<'i>, wanted: &str) -> Option<&'v DeTable<'i>> {
        let table = value.get_ref().as_table();
        if table.is_none() {
            self.wrong(value.span(), format!("write {wanted}"));
        }
        table
    }

    fn string(&mut self, value: &Value<'_>) -> Option<String> {
        match value.get_ref().as_str() {
            // The operating system does not accept NUL.
            Some(text) if !text.contains('\0') => Some(text.to_owned()),
            _ => {
                self.wrong(value.span(), "write a string in double quotes");
                None
            }
        }
    }

    fn texts(&mut self, value: &Value<'_>) -> Vec<String> {
        let Some(values) = value.get_ref().as_array() else {
            self.wrong(
                value.span(),
                "write a list in brackets, such as [\"…\", \"…\"]",
            );
            return Vec::new();
        };
        values.iter().filter_map(|it| self.string(it)).collect()
    }

    fn check_keys(&mut self, table: &DeTable<'_>, known: &[&str], section: &str) {
        for (key, _) in table {
            let name = key.get_ref().as_ref();
            if !known.contains(&name) {
                let words = settings::unknown_words(name, section, known.iter().copied());
                self.wrong(key.span(), words);
            }
        }
    }

    fn check_name(&mut self, place: Range<usize>, name: &str) {
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if name.is_empty() || name.len() > 32 || !name.chars().all(plain) {
            self.wrong(
                place,
                "a part's name has up to 32 letters, digits, `-` and `_`",
            );
        } else if name == OURSELVES {
            self.wrong(
                place,
                "the name `up` is reserved for `jaus up` itself: choose another",
            );
        }
    }

    fn check_flag(&mut self, place: Range<usize>, name: &str) {
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if name.starts_with('-') || name.is_empty() || !name.chars().all(plain) {
            self.wrong(
                place,
                "write a flag's long name without dashes: loopback = true",
            );
        }
    }

    /// Two parts with one id would collide on the network.
    fn check_id(&mut self, name: &str, entry: &DeTable<'_>, ids: &mut BTreeMap<String, String>) {
        let flags = entry.get("flags").and_then(|it| it.get_ref().as_table());
        let Some(id) = flags.and_then(|flags| flags.get("id")) else {
            return;
        };
        let Some(text) = id.get_ref().as_str() else {
            return;
        };
        if let Some(other) = ids.insert(text.to_owned(), name.to_owned()) {
            self.wrong(id.span(), format!("`{other}` has the id {text} already"));
        }
    }
}

#[cfg(test)]
#[path = "system_tests.rs"]
mod tests;
