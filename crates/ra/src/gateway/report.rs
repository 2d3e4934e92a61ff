//! State report of a gateway, for display and (feature `serde`) for programs.

use std::fmt;

use super::{Counter, Gateway};
use jaus::address::JausId;

/// Mapped components and counters of a gateway.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Report {
    /// RA components visible to JAUS: RA id, JAUS id, and whether the gateway controls them.
    pub ra_components: Vec<RaComponentReport>,
    /// JAUS components visible to RA systems: RA id and JAUS id.
    pub jaus_components: Vec<JausComponentReport>,
    /// Nonzero counters of the gateway.
    pub gateway: Vec<(String, u64)>,
    /// Nonzero counters of the RA node.
    pub ra: Vec<(String, u64)>,
}

/// An RA component visible to JAUS.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct RaComponentReport {
    /// Its RA id.
    pub ra: String,
    /// Its JAUS id.
    pub jaus: JausId,
    /// Its name.
    pub name: String,
    /// Whether a JAUS client controls it.
    pub controlled: bool,
}

/// A JAUS component visible to RA systems.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct JausComponentReport {
    /// Its JAUS id.
    pub jaus: JausId,
    /// Its RA id.
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

    /// The report in one line.
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
            let name = jaus_text::quoted(&it.name);
            writeln!(f, "RA {} as {}: {name}{controlled}", it.ra, it.jaus)?;
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
