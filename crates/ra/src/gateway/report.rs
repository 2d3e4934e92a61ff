//! How a gateway stands, for people and (feature `serde`) for programs.

use std::fmt;

use super::{Counter, Gateway};
use jaus::address::JausId;

/// Who is seen by whom, and what was counted.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Report {
    /// RA components that JAUS sees: their id among RA systems, theirs among ours, and whether we
    /// control them.
    pub ra_components: Vec<RaComponentReport>,
    /// JAUS components that RA systems see: their ids there and among ours.
    pub jaus_components: Vec<JausComponentReport>,
    /// What was carried across and refused, where it is not zero.
    pub gateway: Vec<(String, u64)>,
    /// What happened among RA systems, where it is not zero.
    pub ra: Vec<(String, u64)>,
}

/// An RA component that JAUS sees.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct RaComponentReport {
    /// Its id.
    pub ra: String,
    /// Its id among JAUS components.
    pub jaus: JausId,
    /// Its name.
    pub name: String,
    /// Whether it is controlled by a JAUS client.
    pub controlled: bool,
}

/// A JAUS component that RA systems see.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct JausComponentReport {
    /// Its id.
    pub jaus: JausId,
    /// Its id among RA systems.
    pub ra: String,
}

impl Report {
    pub(super) fn of(gateway: &Gateway) -> Self {
        let proxies = gateway.proxies.iter();
        let ra_components = proxies.map(|(&jaus, proxy)| RaComponentReport {
            ra: proxy.ra().to_string(),
            jaus,
            name: gateway
                .listed
                .get(&jaus)
                .map_or_else(String::new, |profile| profile.component.clone()),
            controlled: proxy.is_engaged(),
        });
        let routes = gateway.routes.iter();
        let jaus_components = routes.map(|(ra, target)| JausComponentReport {
            jaus: target.id,
            ra: ra.to_string(),
        });
        let counted = gateway.counters().iter().filter(|&(_, number)| number > 0);
        let of_ra = gateway.ra.counters().iter();
        let of_ra = of_ra.filter(|&(_, number)| number > 0);
        Self {
            ra_components: ra_components.collect(),
            jaus_components: jaus_components.collect(),
            gateway: counted
                .map(|(it, number): (Counter, u64)| (it.name().to_owned(), number))
                .collect(),
            ra: of_ra
                .map(|(it, number)| (it.name().to_owned(), number))
                .collect(),
        }
    }

    /// All of it in one line.
    #[must_use]
    pub fn line(&self) -> String {
        let (ra, jaus) = (self.ra_components.len(), self.jaus_components.len());
        let controlled = self.ra_components.iter().filter(|it| it.controlled).count();
        let mut line = format!(
            "{ra} RA components seen by JAUS ({controlled} controlled), {jaus} JAUS parts seen by RA"
        );
        for (name, number) in &self.gateway {
            line.push_str(&format!("; {name} {number}"));
        }
        line
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for it in &self.ra_components {
            let controlled = if it.controlled { ", controlled" } else { "" };
            writeln!(f, "RA {} as {}: {}{controlled}", it.ra, it.jaus, it.name)?;
        }
        for it in &self.jaus_components {
            writeln!(f, "{} as RA {}", it.jaus, it.ra)?;
        }
        for (name, number) in self.gateway.iter().chain(&self.ra) {
            writeln!(f, "{number:>10}  {name}")?;
        }
        Ok(())
    }
}
