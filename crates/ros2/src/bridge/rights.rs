//! What ROS may do to the vehicle: the messages that the bridge sends for it are checked as those of any other
//! client, by the one table of rights.

use std::fmt;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::{EncodeError, Message};
use jaus::messages::core::confirm_control::ResponseCode;
use jaus::messages::core::{
    ClearEmergency, ConfirmControl, RejectControl, ReleaseControl, RequestControl, Resume,
    SetEmergency,
};
use jaus::messages::mobility::{
    SetLocalWaypoint, SetTravelSpeed, SetVelocityCommand, SetWrenchEffort,
};
use jaus::node::Recorder;
use jaus::rights::{
    Decision, DecisionQueue, InControl, Refusal, Rules, Table, Unaccepted, check_unrecorded,
};
use jaus::wire::Frame;
use jaus_vehicle::messages::ground::{SetDestination, StopMission};

use super::jobs::EMERGENCY;
use super::lease::Target;
use super::vehicle::Role;
use crate::graph::Gid;

/// The rights of ROS, and the record of what its publishers do with them.
#[derive(Debug)]
pub(super) struct Rights {
    rules: Rules,
    table: Table,
    /// The bridge.
    from: JausId,
    /// All components of the vehicle, for messages whose component is not known yet.
    vehicle: JausId,
    recorder: Option<Recorder<Gid>>,
    in_control: InControl,
}

/// A message that the bridge does not send.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Forbidden {
    frame: Frame,
    /// Why not.
    pub(super) why: Refusal,
}

impl fmt::Display for Forbidden {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.why {
            Refusal::Unrecorded => self.why.fmt(f),
            why => write!(f, "{why} (--rights)"),
        }
    }
}

/// What a component of the vehicle says about its control.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Said {
    Granted,
    Refused,
    Ended,
}

impl Rights {
    pub(super) fn new(
        rules: Rules,
        from: JausId,
        subsystem: u16,
        recorder: Option<Recorder<Gid>>,
    ) -> Self {
        Self {
            rules,
            table: Table::default(),
            from,
            vehicle: JausId::new(subsystem, JausId::ANY_NODE, JausId::ANY_COMPONENT),
            recorder,
            in_control: InControl::default(),
        }
    }

    /// The authority with which control is requested; `None` if it is not.
    pub(super) const fn authority(&self) -> Option<u8> {
        self.rules.control
    }

    /// Whether ROS may drive, by this component. `moves` is whether it does not just stop: a stop needs no
    /// record.
    pub(super) fn check_drive(&self, target: Option<Target>, moves: bool) -> Result<(), Forbidden> {
        let codes: &[u16] = match target {
            None => &[],
            Some((_, Role::VelocityDriver)) => &[SetVelocityCommand::CODE],
            Some(_) => &[SetWrenchEffort::CODE],
        };
        self.check_controlled(target, codes)
            .or_else(|forbidden| match forbidden.why {
                Refusal::Unrecorded if !moves => Ok(()),
                _ => Err(forbidden),
            })
    }

    /// Whether ROS may set goals, to this component.
    pub(super) fn check_goal(&self, target: Option<Target>) -> Result<(), Forbidden> {
        let codes: &[u16] = match target {
            None => &[],
            Some((_, Role::Planner)) => &[SetDestination::CODE, StopMission::CODE],
            Some(_) => &[SetTravelSpeed::CODE, SetLocalWaypoint::CODE],
        };
        self.check_controlled(target, codes)
    }

    /// Whether ROS may set an emergency, or clear its own, at any of these parts of the vehicle.
    pub(super) fn check_emergency(
        &self,
        on: bool,
        parts: impl IntoIterator<Item = JausId>,
    ) -> Result<(), Forbidden> {
        let mut refused = None;
        for part in parts {
            match self.check_emergency_of(on, part) {
                Ok(()) => return Ok(()),
                Err(refusal) => refused = Some(refusal),
            }
        }
        refused.map_or_else(|| self.check_emergency_of(on, self.vehicle), Err)
    }

    /// The same at one of them.
    pub(super) fn check_emergency_of(&self, on: bool, part: JausId) -> Result<(), Forbidden> {
        self.check(self.emergency(on, part))
    }

    fn emergency(&self, on: bool, part: JausId) -> Frame {
        let code = if on {
            SetEmergency::CODE
        } else {
            ClearEmergency::CODE
        };
        self.frame(code, &EMERGENCY.to_le_bytes(), part)
    }

    /// Whether ROS may make a component ready.
    pub(super) fn may_resume(&self, component: JausId) -> bool {
        self.check(self.frame(Resume::CODE, &[], component)).is_ok()
    }

    fn check_controlled(&self, target: Option<Target>, codes: &[u16]) -> Result<(), Forbidden> {
        let to = target.map_or(self.vehicle, |(id, _)| id);
        self.check(self.request(to))?;
        let messages = codes.iter().map(|code| self.frame(*code, &[], to));
        messages.into_iter().try_for_each(|it| self.check(it))
    }

    fn request(&self, to: JausId) -> Frame {
        let authority = self.rules.control.unwrap_or_default();
        self.frame(RequestControl::CODE, &[authority], to)
    }

    /// A message of the bridge: its code and the fields that matter.
    fn frame(&self, code: u16, fields: &[u8], to: JausId) -> Frame {
        let message = [code.to_le_bytes().as_slice(), fields].concat();
        Frame::new(self.from, to, message.into())
    }

    fn check(&self, frame: Frame) -> Result<(), Forbidden> {
        // A stop goes to the components one by one: to those that may be reached.
        let admitted = self.rules.admit(&frame, &self.table).map(drop);
        let is_refusing = self
            .recorder
            .as_ref()
            .is_some_and(Recorder::refuses_commands);
        let checked = match is_refusing {
            true => admitted.and_then(|()| check_unrecorded(&frame, &self.table)),
            false => admitted,
        };
        checked.map_err(|why| Forbidden { frame, why })
    }

    /// Records that a publisher was refused.
    pub(super) fn record_refusal(&mut self, by: Gid, refused: &Forbidden) {
        let checked = Err(Unaccepted::Rule(refused.why));
        self.record(by, Decision::of(&refused.frame, checked, &self.table));
    }

    /// Records that a publisher sets an emergency at the vehicle, or clears it.
    pub(super) fn record_emergency(&mut self, by: Gid, on: bool) {
        self.record_passed(by, &self.emergency(on, self.vehicle));
    }

    /// Records that control of a component is requested for a publisher.
    pub(super) fn record_request(&mut self, by: Gid, component: JausId) {
        self.record_passed(by, &self.request(component));
    }

    /// Records that a publisher ends the control of the bridge.
    pub(super) fn record_release(&mut self, by: Gid) {
        self.record_passed(by, &self.frame(ReleaseControl::CODE, &[], self.vehicle));
    }

    fn record_passed(&mut self, by: Gid, frame: &Frame) {
        let passed = self.in_control.decision(frame, Ok(()), &self.table);
        self.record(by, passed);
    }

    /// Records what a component says about the control that was requested for a publisher.
    pub(super) fn record_answer(&mut self, by: Gid, component: JausId, said: Said) {
        let message = match said {
            Said::Granted => confirm(ResponseCode::CONTROL_ACCEPTED),
            Said::Refused => confirm(ResponseCode::INSUFFICIENT_AUTHORITY),
            Said::Ended => RejectControl::default().encode(),
        };
        let Ok(message) = message else { return };
        let told = Frame::new(component, self.from, message);
        let decision = self.in_control.told(&told, &self.table);
        self.record(by, decision);
    }

    fn record(&mut self, by: Gid, decision: Option<Decision>) {
        if let (Some(recorder), Some(decision)) = (&mut self.recorder, decision) {
            let mut decisions = DecisionQueue::default();
            decisions.push(decision, by);
            recorder.record_all(decisions.pop());
        }
    }
}

fn confirm(response_code: ResponseCode) -> Result<Bytes, EncodeError> {
    ConfirmControl { response_code }.encode()
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRIVER: JausId = JausId::new(101, 1, 33);
    const PRIMITIVE: Option<Target> = Some((DRIVER, Role::PrimitiveDriver));

    fn rights(rules: Rules) -> Rights {
        Rights::new(rules, JausId::new(253, 1, 1), 101, None)
    }

    /// Why a message is not sent.
    fn why(checked: Result<(), Forbidden>) -> Result<(), Refusal> {
        checked.map_err(|it| it.why)
    }

    fn allowed(words: &str) -> Rights {
        rights(words.parse().unwrap())
    }

    #[test]
    fn without_words_ros_watches() {
        let rights = rights(Rules::watch());
        for target in [None, PRIMITIVE] {
            assert_eq!(why(rights.check_drive(target, true)), Err(Refusal::Control));
            assert_eq!(why(rights.check_goal(target)), Err(Refusal::Control));
        }
        for parts in [&[][..], &[DRIVER]] {
            let parts = || parts.iter().copied();
            let refused = why(rights.check_emergency(true, parts()));
            assert_eq!(refused, Err(Refusal::Excluded));
            let refused = why(rights.check_emergency(false, parts()));
            assert_eq!(refused, Err(Refusal::ClearEmergency));
        }
        assert!(!rights.may_resume(DRIVER));
    }

    #[test]
    fn each_word_of_the_table_allows_what_it_says() {
        assert_eq!(
            why(allowed("observe").check_emergency(true, [DRIVER])),
            Ok(())
        );
        let commands = why(allowed("command").check_drive(PRIMITIVE, true));
        assert_eq!(commands, Err(Refusal::Control), "driving takes control");
        let drives = allowed("control=127");
        assert_eq!(why(drives.check_drive(PRIMITIVE, true)), Ok(()));
        assert_eq!(
            why(drives.check_goal(Some((DRIVER, Role::Planner)))),
            Ok(())
        );
        assert_eq!(drives.authority(), Some(127));
        assert!(drives.may_resume(DRIVER));
        let cleared = why(drives.check_emergency(false, [DRIVER]));
        assert_eq!(cleared, Err(Refusal::ClearEmergency));
        let clears = allowed("clear-emergency");
        assert_eq!(why(clears.check_emergency(false, [DRIVER])), Ok(()));
    }

    #[test]
    fn selections_and_ids_count_for_ros_as_for_other_clients() {
        let no_goals = allowed("control=127 except=SetDestination");
        let goal = why(no_goals.check_goal(Some((DRIVER, Role::Planner))));
        assert_eq!(goal, Err(Refusal::Excluded));
        assert_eq!(why(no_goals.check_drive(PRIMITIVE, true)), Ok(()));
        let drives = allowed("control=127 only=PrimitiveDriver");
        assert_eq!(why(drives.check_drive(PRIMITIVE, true)), Ok(()));
        assert!(!drives.may_resume(DRIVER));
        let other = JausId::new(101, 1, 44);
        let one = allowed("control=127 with=101.1.44 clear-emergency");
        assert_eq!(
            why(one.check_drive(PRIMITIVE, true)),
            Err(Refusal::Elsewhere)
        );
        let elsewhere = why(one.check_emergency(false, [DRIVER]));
        assert_eq!(elsewhere, Err(Refusal::Elsewhere));
        assert_eq!(why(one.check_emergency(false, [DRIVER, other])), Ok(()));
    }
}
