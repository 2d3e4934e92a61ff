//! Evaluates the status of the next driver: continue, re-engage after a restart, or stand down
//! after an intentional stop.

use crate::ground::StageReport;
use jaus::address::JausId;
use jaus::component::State;

/// Status of the next driver, as it reports it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::parts) struct DriverStatus {
    /// The status code of Report Status.
    pub(in crate::parts) status: u8,
    /// The client in control.
    pub(in crate::parts) controller: Option<JausId>,
    /// The reported stage.
    pub(in crate::parts) stage: StageReport,
}

/// Consequence for the commanding driver.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::parts) enum Verdict {
    /// Everything is in order.
    GoOn,
    /// Control or resume must be repeated: the driver was restarted, or has failed because its
    /// sensors were silent, which ends when they report again.
    Anew,
    /// The driver was stopped or taken over on purpose. Nothing must move again on its own.
    StandDown(String),
}

/// Evaluates the status of `peer`, which `own` commands.
pub(in crate::parts) fn judge(own: JausId, peer: JausId, told: &DriverStatus) -> Verdict {
    let ready = State::Ready as u8;
    let standby = State::Standby as u8;
    match told.controller {
        _ if told.status == State::Emergency as u8 => {
            Verdict::StandDown(format!("{peer} is stopped by an emergency"))
        }
        Some(other) if other != own => {
            Verdict::StandDown(format!("{peer} is controlled by {other}"))
        }
        _ if told.stage.stands_down() => {
            Verdict::StandDown(format!("{peer}: {}", told.stage.reason))
        }
        _ if told.status == State::Failure as u8 => Verdict::Anew,
        Some(_) if told.status == ready => Verdict::GoOn,
        None if told.status == ready || told.status == standby => Verdict::Anew,
        Some(_) if told.status == standby => Verdict::Anew,
        _ => Verdict::StandDown(format!(
            "{peer} is not operational: its status is {}",
            told.status
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::StageState;

    const OWN: JausId = JausId::new(101, 3, 44);
    const PEER: JausId = JausId::new(101, 2, 33);
    const OPERATOR: JausId = JausId::new(42, 1, 1);

    fn judged(state: State, controller: Option<JausId>, stage: StageReport) -> Verdict {
        let told = DriverStatus {
            status: state as u8,
            controller,
            stage,
        };
        judge(OWN, PEER, &told)
    }

    fn blocked(next: Option<JausId>) -> StageReport {
        StageReport {
            state: StageState::Blocked,
            next,
            reason: "why".to_owned(),
            ..StageReport::default()
        }
    }

    #[test]
    fn it_goes_on_while_it_is_obeyed_even_if_the_other_has_to_wait() {
        let idle = StageReport::default();
        assert_eq!(judged(State::Ready, Some(OWN), idle), Verdict::GoOn);
        let waits = blocked(Some(PEER));
        assert_eq!(judged(State::Ready, Some(OWN), waits), Verdict::GoOn);
    }

    #[test]
    fn who_was_started_again_is_engaged_anew() {
        let idle = StageReport::default;
        assert_eq!(judged(State::Standby, None, idle()), Verdict::Anew);
        assert_eq!(judged(State::Standby, Some(OWN), idle()), Verdict::Anew);
        assert_eq!(judged(State::Ready, None, idle()), Verdict::Anew);
    }

    #[test]
    fn a_failure_of_sensors_is_waited_for_and_one_of_motors_ends_it() {
        // A driver whose sensors have failed still names the driver it commands.
        let sensors = judged(State::Failure, None, blocked(Some(PEER)));
        assert_eq!(sensors, Verdict::Anew);
        let motors = judged(State::Failure, None, blocked(None));
        assert_eq!(motors, Verdict::StandDown("101.2.33: why".to_owned()));
    }

    #[test]
    fn after_an_emergency_or_a_take_over_it_stands_down() {
        for (state, controller, stage, reason) in [
            (
                State::Emergency,
                Some(OWN),
                StageReport::default(),
                "101.2.33 is stopped by an emergency",
            ),
            (State::Standby, Some(OWN), blocked(None), "101.2.33: why"),
            (State::Ready, Some(OWN), blocked(None), "101.2.33: why"),
            (
                State::Ready,
                Some(OPERATOR),
                StageReport::default(),
                "101.2.33 is controlled by 42.1.1",
            ),
            (
                State::Shutdown,
                None,
                StageReport::default(),
                "101.2.33 is not operational: its status is 3",
            ),
        ] {
            let verdict = judged(state, controller, stage);
            assert_eq!(verdict, Verdict::StandDown(reason.to_owned()));
        }
    }
}
