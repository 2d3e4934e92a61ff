//! The library's log.

use tracing::level_filters::LevelFilter;

use crate::status::{Failure, JausStatus, run};

/// Writes the library's log to standard error from now on: 1 errors, 2 also warnings, 3 also the course of
/// events, 4 also details. Once in a process. Without this call there is no log.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_log_to_stderr(level: u8) -> JausStatus {
    run(|| {
        let level = match level {
            1 => LevelFilter::ERROR,
            2 => LevelFilter::WARN,
            3 => LevelFilter::INFO,
            4 => LevelFilter::DEBUG,
            other => {
                return Err(Failure::argument(format!(
                    "log level {other}: choose 1 to 4"
                )));
            }
        };
        let log = tracing_subscriber::fmt()
            .with_max_level(level)
            .with_ansi(false)
            .with_writer(std::io::stderr);
        log.try_init()
            .map_err(|_| Failure::new(JausStatus::WrongState, "the log is written already"))
    })
}
