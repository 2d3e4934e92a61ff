//! Stage: the state of one driver of the chain, and what blocks it.

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use crate::messages::ground::{QueryStage, ReportStage, report_stage, stage};
use jaus::address::JausId;
use jaus::codec::Text;
use jaus::service::Handlers;

/// The published state of a driver of the chain. Cheap to clone; all clones share one state.
#[derive(Debug, Clone, Default)]
pub struct StageBoard(Arc<Mutex<StageReport>>);

/// State report of a driver of the chain.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StageReport {
    /// The driver's state.
    pub state: StageState,
    /// Completed part of the command, in percent.
    pub progress: u8,
    /// The component that the driver commands or tries to control.
    pub next: Option<JausId>,
    /// Why the driver is blocked, as text for the operator; empty if it is not.
    pub reason: String,
}

/// State of a driver. The numbers are those of Report Stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StageState {
    /// Nothing to do.
    #[default]
    Idle = 0,
    /// Taking control of the next driver.
    Engaging = 1,
    /// Executing the command.
    Active = 2,
    /// Unable to continue. If it commands no driver, it has stood down: it does not resume on its
    /// own and needs a new command.
    Blocked = 3,
    /// The command is complete.
    Done = 4,
    /// Stopped for a fault. The command is dropped, and a new one is needed, also when the fault is
    /// gone.
    Halted = 5,
}

impl StageState {
    /// The state of a report; `None` for a number without a meaning.
    #[must_use]
    pub const fn of(report: &ReportStage) -> Option<Self> {
        match report.state {
            report_stage::State::IDLE => Some(Self::Idle),
            report_stage::State::ENGAGING => Some(Self::Engaging),
            report_stage::State::ACTIVE => Some(Self::Active),
            report_stage::State::BLOCKED => Some(Self::Blocked),
            report_stage::State::DONE => Some(Self::Done),
            report_stage::State::HALTED => Some(Self::Halted),
            _ => None,
        }
    }

    /// Its name, for example `idle`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Idle => "idle",
            Self::Engaging => "engaging",
            Self::Active => "active",
            Self::Blocked => "blocked",
            Self::Done => "done",
            Self::Halted => "halted",
        }
    }
}

impl fmt::Display for StageState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl StageBoard {
    /// Creates the service that reports the state.
    #[must_use]
    pub fn service(&self) -> Handlers {
        let board = self.clone();
        Handlers::new(stage::LATEST).answer(move |_: QueryStage| board.report().to_message())
    }

    /// The current report.
    #[must_use]
    pub fn report(&self) -> StageReport {
        self.0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    /// Replaces the report. Returns whether it differs from the previous one.
    pub fn tell(&self, report: StageReport) -> bool {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let is_news = *known != report;
        *known = report;
        is_news
    }
}

impl StageReport {
    /// Maximum length of a reason in the message, in octets.
    const MAX_REASON: usize = 255;

    fn to_message(&self) -> ReportStage {
        let next = self
            .next
            .map_or((0, 0, 0), |id| (id.subsystem(), id.node(), id.component()));
        ReportStage {
            state: report_stage::State(self.state as u8),
            progress: self.progress.min(100),
            next_subsystem_id: next.0,
            next_node_id: next.1,
            next_component_id: next.2,
            reason: Text::prefix(&self.reason, Self::MAX_REASON).into(),
        }
    }

    /// Whether the driver has stood down and will not resume on its own.
    #[must_use]
    pub fn stands_down(&self) -> bool {
        self.state == StageState::Blocked && self.next.is_none()
    }
}

impl From<&ReportStage> for StageReport {
    fn from(message: &ReportStage) -> Self {
        let next = JausId::new(
            message.next_subsystem_id,
            message.next_node_id,
            message.next_component_id,
        );
        Self {
            state: StageState::of(message).unwrap_or_default(),
            progress: message.progress,
            next: next.is_unicast().then_some(next),
            reason: message.reason.as_str().unwrap_or_default().to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jaus::service::rig::Rig;

    #[test]
    fn what_is_told_is_what_is_reported() {
        let board = StageBoard::default();
        let mut rig = Rig::new(vec![Box::new(board.service())]);
        let report = StageReport {
            state: StageState::Blocked,
            progress: 40,
            next: Some(JausId::new(101, 2, 33)),
            reason: "the pose is 0.8 s old".to_owned(),
        };
        assert!(board.tell(report.clone()));
        assert!(!board.tell(report.clone()), "no news");
        let message: ReportStage = rig.ask(&QueryStage {}).unwrap();
        assert_eq!(StageReport::from(&message), report);
        assert!(!report.stands_down());
    }

    #[test]
    fn a_long_reason_is_told_as_far_as_it_fits() {
        let board = StageBoard::default();
        let mut rig = Rig::new(vec![Box::new(board.service())]);
        board.tell(StageReport {
            state: StageState::Blocked,
            reason: format!("x{}", "ä".repeat(200)),
            ..StageReport::default()
        });
        let message: ReportStage = rig.ask(&QueryStage {}).unwrap();
        assert_eq!(message.reason.len(), 255);
        assert!(StageReport::from(&message).stands_down());
    }
}
