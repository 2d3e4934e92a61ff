//! End of a run: the exit status, and the sentence that a failure prints.

use std::error::Error;
use std::fmt;
use std::io;
use std::path::Path;
use std::process::ExitCode;

use jaus::node::StartError;

/// Result of a completed run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Exit status 0.
    Done,
    /// Some input was unreadable or unanswered: exit status 1.
    Incomplete,
}

impl Outcome {
    /// [`Incomplete`](Self::Incomplete) if anything is missing.
    pub fn complete_if(complete: bool) -> Self {
        if complete {
            Self::Done
        } else {
            Self::Incomplete
        }
    }
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Done => Self::SUCCESS,
            Outcome::Incomplete => Self::from(1),
        }
    }
}

/// Reason why a run has ended early.
#[derive(Debug)]
pub enum Failure {
    /// Standard output is closed; no message is printed. Exit status 0.
    OutputClosed,
    /// The run was not possible: the mistake and its remedy. Exit status 2, after which services are not started
    /// again.
    Message(String),
    /// The result is negative, such as control that is not granted, or a port that another program has at
    /// present. Exit status 1.
    Negative(String),
}

impl Failure {
    /// A sentence for the user.
    pub fn new(message: impl Into<String>) -> Self {
        Self::Message(message.into())
    }

    /// A sentence about a negative result.
    pub fn negative(message: impl fmt::Display) -> Self {
        Self::Negative(message.to_string())
    }

    /// The exit status of the program.
    pub fn status(&self) -> ExitCode {
        match self {
            Self::OutputClosed => ExitCode::SUCCESS,
            Self::Negative(_) => ExitCode::from(1),
            Self::Message(_) => ExitCode::from(2),
        }
    }

    /// An error of the library, with its causes. Its messages are written for users, and many name
    /// their cause themselves, which is not repeated then.
    pub fn of(error: impl Error + 'static) -> Self {
        let mut message = error.to_string();
        let mut source = error.source();
        while let Some(cause) = source {
            let words = cause.to_string();
            if !message.contains(&words) {
                message = format!("{message}: {words}");
            }
            source = cause.source();
        }
        Self::about(&error, message)
    }

    /// A sentence about an error, and the exit status that the error has.
    pub fn about(error: &(dyn Error + 'static), message: String) -> Self {
        match is_taken(error) {
            true => Self::Negative(message),
            false => Self::Message(message),
        }
    }

    /// A file that cannot be opened or read.
    pub fn file(path: &Path, error: &io::Error) -> Self {
        Self::Message(format!("{}: {error}", path.display()))
    }
}

/// Whether another program has what is needed, such as a port. That passes, unlike a wrong setting.
fn is_taken(error: &(dyn Error + 'static)) -> bool {
    let io = error.downcast_ref::<io::Error>();
    io.is_some_and(|it| it.kind() == io::ErrorKind::AddrInUse)
        || error.downcast_ref().is_some_and(StartError::is_taken)
        || error.source().is_some_and(is_taken)
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutputClosed => f.write_str("standard output was closed"),
            Self::Message(message) | Self::Negative(message) => f.write_str(message),
        }
    }
}

impl Error for Failure {}

#[cfg(test)]
mod tests {
    use jaus::link;

    use super::*;

    #[test]
    fn a_cause_that_the_error_names_itself_is_printed_once() {
        let refused = link::Error::GroupRefused {
            group: ([239, 255, 0, 1], 3794).into(),
            interface: link::Interface {
                name: "lo".into(),
                index: 1,
                address: [127, 0, 0, 1].into(),
                prefix: 8,
                up: true,
                multicast: true,
                broadcast: None,
            },
            source: io::Error::from_raw_os_error(92),
        };
        let told = Failure::of(StartError::from(refused)).to_string();
        assert_eq!(told.matches("os error 92").count(), 1, "{told}");
        assert!(told.contains("--group off --peer"), "{told}");
    }

    #[test]
    fn a_port_that_another_program_has_is_no_mistake_of_the_settings() {
        let address = ([127, 0, 0, 1], 3794).into();
        let taken = StartError::from(link::Error::ListenerTaken(address));
        let in_use = io::Error::from(io::ErrorKind::AddrInUse);
        for passing in [Failure::of(taken), Failure::of(in_use)] {
            assert!(matches!(passing, Failure::Negative(_)), "{passing:?}");
        }
        let gone = StartError::from(link::Error::AddressGone([192, 0, 2, 1].into()));
        assert!(matches!(Failure::of(gone), Failure::Message(_)));
    }

    #[test]
    fn a_cause_that_the_error_does_not_name_is_added() {
        #[derive(Debug)]
        struct Unread(io::Error);
        impl fmt::Display for Unread {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the map cannot be read")
            }
        }
        impl Error for Unread {
            fn source(&self) -> Option<&(dyn Error + 'static)> {
                Some(&self.0)
            }
        }
        let told = Failure::of(Unread(io::Error::other("bad sector"))).to_string();
        assert_eq!(told, "the map cannot be read: bad sector");
    }
}
