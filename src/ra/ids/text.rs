//! [`RaId`] as text, `20.1.33.1`: how people write it in settings and how errors print it.

use std::str::FromStr;

use super::RaId;
use crate::as_text::serde_as_text;

/// Not an id of the Reference Architecture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is not an RA id: write subsystem.node.component.instance, each from 0 to 255, for \
     instance 20.1.33.1"
)]
pub struct InvalidRaId(String);

impl FromStr for RaId {
    type Err = InvalidRaId;

    fn from_str(text: &str) -> Result<Self, InvalidRaId> {
        const LONGEST: usize = 32;
        let wrong = || InvalidRaId(text.chars().take(LONGEST).collect());
        let mut parts = text.split('.').map(|part| {
            let plain = part.bytes().all(|octet| octet.is_ascii_digit());
            part.parse::<u8>().ok().filter(|_| plain)
        });
        let mut next = || parts.next().flatten().ok_or_else(wrong);
        let id = Self {
            subsystem: next()?,
            node: next()?,
            component: next()?,
            instance: next()?,
        };
        match parts.next() {
            None => Ok(id),
            Some(_) => Err(wrong()),
        }
    }
}

serde_as_text!(RaId);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_is_written_with_dots_and_read_back() {
        let id: RaId = "20.1.33.2".parse().unwrap();
        assert_eq!(
            (id.subsystem, id.node, id.component, id.instance),
            (20, 1, 33, 2)
        );
        assert_eq!(id.to_string(), "20.1.33.2");
    }

    #[test]
    fn what_is_no_id_is_told_what_one_looks_like() {
        for wrong in [
            "",
            "20.1.33",
            "20.1.33.1.1",
            "256.1.1.1",
            "+1.1.1.1",
            "a.b.c.d",
            "1.1..1",
        ] {
            let error = wrong.parse::<RaId>().expect_err(wrong).to_string();
            assert!(error.contains("for instance 20.1.33.1"), "{error}");
        }
    }
}
