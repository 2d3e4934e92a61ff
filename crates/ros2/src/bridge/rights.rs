//! What ROS may do to the vehicle: the messages that the bridge sends for it are checked as those of any other
//! client, by the one table of rights.

use jaus::address::JausId;
use jaus::codec::Message;
use jaus::messages::core::{ClearEmergency, RequestControl, Resume, SetEmergency};
use jaus::messages::mobility::{
    SetLocalWaypoint, SetTravelSpeed, SetVelocityCommand, SetWrenchEffort,
};
use jaus::rights::{Refusal, Rules, Table};
use jaus::wire::Frame;
use jaus_vehicle::messages::ground::{SetDestination, StopMission};

use super::jobs::EMERGENCY;
use super::lease::Target;
use super::vehicle::Role;

/// The rights of ROS.
#[derive(Debug)]
pub(super) struct Rights {
    rules: Rules,
    table: Table,
    /// The bridge.
    from: JausId,
    /// All components of the vehicle, for messages whose component is not known yet.
    vehicle: JausId,
}

impl Rights {
    pub(super) fn new(rules: Rules, from: JausId, subsystem: u16) -> Self {
        Self {
            rules,
            table: Table::default(),
            from,
            vehicle: JausId::new(subsystem, JausId::ANY_NODE, JausId::ANY_COMPONENT),
        }
    }

    /// The authority with which control is requested; `None` if it is not.
    pub(super) const fn authority(&self) -> Option<u8> {
        self.rules.control
    }

    /// Whether ROS may drive, by this component.
    pub(super) fn check_drive(&self, target: Option<Target>) -> Result<(), Refusal> {
        let codes: &[u16] = match target {
            None => &[],
            Some((_, Role::VelocityDriver)) => &[SetVelocityCommand::CODE],
            Some(_) => &[SetWrenchEffort::CODE],
        };
        self.check_controlled(target, codes)
    }

    /// Whether ROS may set goals, to this component.
    pub(super) fn check_goal(&self, target: Option<Target>) -> Result<(), Refusal> {
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
    ) -> Result<(), Refusal> {
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
    pub(super) fn check_emergency_of(&self, on: bool, part: JausId) -> Result<(), Refusal> {
        let code = if on {
            SetEmergency::CODE
        } else {
            ClearEmergency::CODE
        };
        self.check(code, &EMERGENCY.to_le_bytes(), part)
    }

    /// Whether ROS may make a component ready.
    pub(super) fn may_resume(&self, component: JausId) -> bool {
        self.check(Resume::CODE, &[], component).is_ok()
    }

    fn check_controlled(&self, target: Option<Target>, codes: &[u16]) -> Result<(), Refusal> {
        let to = target.map_or(self.vehicle, |(id, _)| id);
        let authority = self.rules.control.unwrap_or_default();
        self.check(RequestControl::CODE, &[authority], to)?;
        codes.iter().try_for_each(|code| self.check(*code, &[], to))
    }

    /// Checks a message by its code and the fields that matter.
    fn check(&self, code: u16, fields: &[u8], to: JausId) -> Result<(), Refusal> {
        let message = [code.to_le_bytes().as_slice(), fields].concat();
        let frame = Frame::new(self.from, to, message.into());
        // A stop goes to the components one by one: to those that may be reached.
        self.rules.admit(&frame, &self.table).map(drop)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRIVER: JausId = JausId::new(101, 1, 33);
    const PRIMITIVE: Option<Target> = Some((DRIVER, Role::PrimitiveDriver));

    fn rights(rules: Rules) -> Rights {
        Rights::new(rules, JausId::new(253, 1, 1), 101)
    }

    fn allowed(words: &str) -> Rights {
        rights(words.parse().unwrap())
    }

    #[test]
    fn without_words_ros_watches() {
        let rights = rights(Rules::watch());
        for target in [None, PRIMITIVE] {
            assert_eq!(rights.check_drive(target), Err(Refusal::Control));
            assert_eq!(rights.check_goal(target), Err(Refusal::Control));
        }
        for parts in [&[][..], &[DRIVER]] {
            let parts = || parts.iter().copied();
            let refused = rights.check_emergency(true, parts());
            assert_eq!(refused, Err(Refusal::Excluded));
            let refused = rights.check_emergency(false, parts());
            assert_eq!(refused, Err(Refusal::ClearEmergency));
        }
        assert!(!rights.may_resume(DRIVER));
    }

    #[test]
    fn each_word_of_the_table_allows_what_it_says() {
        assert_eq!(allowed("observe").check_emergency(true, [DRIVER]), Ok(()));
        let commands = allowed("command").check_drive(PRIMITIVE);
        assert_eq!(commands, Err(Refusal::Control), "driving takes control");
        let drives = allowed("control=127");
        assert_eq!(drives.check_drive(PRIMITIVE), Ok(()));
        assert_eq!(drives.check_goal(Some((DRIVER, Role::Planner))), Ok(()));
        assert_eq!(drives.authority(), Some(127));
        assert!(drives.may_resume(DRIVER));
        let cleared = drives.check_emergency(false, [DRIVER]);
        assert_eq!(cleared, Err(Refusal::ClearEmergency));
        let clears = allowed("clear-emergency");
        assert_eq!(clears.check_emergency(false, [DRIVER]), Ok(()));
    }

    #[test]
    fn selections_and_ids_count_for_ros_as_for_other_clients() {
        let no_goals = allowed("control=127 except=SetDestination");
        let goal = no_goals.check_goal(Some((DRIVER, Role::Planner)));
        assert_eq!(goal, Err(Refusal::Excluded));
        assert_eq!(no_goals.check_drive(PRIMITIVE), Ok(()));
        let drives = allowed("control=127 only=PrimitiveDriver");
        assert_eq!(drives.check_drive(PRIMITIVE), Ok(()));
        assert!(!drives.may_resume(DRIVER));
        let other = JausId::new(101, 1, 44);
        let one = allowed("control=127 with=101.1.44 clear-emergency");
        assert_eq!(one.check_drive(PRIMITIVE), Err(Refusal::Elsewhere));
        let elsewhere = one.check_emergency(false, [DRIVER]);
        assert_eq!(elsewhere, Err(Refusal::Elsewhere));
        assert_eq!(one.check_emergency(false, [DRIVER, other]), Ok(()));
    }
}
