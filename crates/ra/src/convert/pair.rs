//! A message pair and the conversion of its payloads.

use bytes::{BufMut, Bytes, BytesMut};

use super::carry::Counterpart;
use super::{Context, Refusal};
use crate::forgiving::forgiving;
use crate::ids::RaComponent;
use jaus::codec::Message;

/// Octets of the message code before the content.
const CODE_LEN: usize = 2;

/// An RA message and its counterpart among ours.
#[derive(Clone, Debug)]
pub struct Pair {
    /// The code of the RA message.
    pub ra: u16,
    /// The name of the RA message.
    pub ra_name: &'static str,
    /// The code of ours.
    pub jaus: u16,
    /// The name of ours.
    pub jaus_name: &'static str,
    when: When,
    to_jaus: Convert,
    to_ra: Convert,
}

type Convert = fn(&Bytes, Context<'_>) -> Result<Bytes, Refusal>;

/// Selects between several counterparts of a code.
#[derive(Clone, Copy, Debug)]
enum When {
    /// Unconditional.
    Always,
    /// For RA components of these types.
    Part(&'static [RaComponent]),
    /// For this minor version of our service; 1 also stands for later and unknown versions.
    Minor(u8),
}

impl Pair {
    /// A pair of two types that convert into each other.
    pub(super) const fn of<Ra, Jaus>() -> Self
    where
        Ra: Message + Counterpart<Jaus>,
        Jaus: Message + Counterpart<Ra>,
    {
        Self {
            ra: Ra::CODE,
            ra_name: Ra::NAME,
            jaus: Jaus::CODE,
            jaus_name: Jaus::NAME,
            when: When::Always,
            to_jaus: |payload, context| {
                convert::<Ra, Jaus>(forgiving(payload, Ra::decode)?, context)
            },
            to_ra: |payload, context| convert::<Jaus, Ra>(Jaus::decode(payload)?, context),
        }
    }

    /// A pair of types with identical layout, code and meaning.
    pub(super) const fn same_octets<Ra: Message, Jaus: Message>() -> Self {
        Self {
            ra: Ra::CODE,
            ra_name: Ra::NAME,
            jaus: Jaus::CODE,
            jaus_name: Jaus::NAME,
            when: When::Always,
            to_jaus: |payload, _| {
                read_by_both(forgiving(payload, Ra::decode)?.encode()?, Jaus::decode)
            },
            to_ra: |payload, _| read_by_both(Jaus::decode(payload)?.encode()?, Ra::decode),
        }
    }

    /// Restricts the pair to components of these types.
    pub(super) const fn for_parts(mut self, parts: &'static [RaComponent]) -> Self {
        self.when = When::Part(parts);
        self
    }

    /// Restricts the pair to services of this minor version.
    pub(super) const fn for_minor(mut self, minor: u8) -> Self {
        self.when = When::Minor(minor);
        self
    }

    /// Whether the pair applies in this context.
    pub(super) fn is_meant(&self, context: Context<'_>) -> bool {
        match self.when {
            When::Always => true,
            When::Part(parts) => context.part.is_some_and(|part| parts.contains(&part)),
            When::Minor(minor) => context.minor.map_or(1, |known| known.min(1)) == minor,
        }
    }

    /// Converts the data of the RA message to our payload.
    pub(super) fn to_jaus(&self, data: &[u8], context: Context<'_>) -> Result<Bytes, Refusal> {
        let mut payload = BytesMut::with_capacity(CODE_LEN + data.len());
        payload.put_u16_le(self.ra);
        payload.put_slice(data);
        (self.to_jaus)(&payload.freeze(), context)
    }

    /// Converts our payload to the data of the RA message.
    pub(super) fn to_ra(&self, payload: &Bytes, context: Context<'_>) -> Result<Bytes, Refusal> {
        Ok((self.to_ra)(payload, context)?.slice(CODE_LEN..))
    }
}

fn convert<From, To>(message: From, context: Context<'_>) -> Result<Bytes, Refusal>
where
    From: Counterpart<To>,
    To: Message,
{
    Ok(message.counterpart(context)?.encode()?)
}

/// The octets, if the other definition decodes them too.
fn read_by_both<M>(
    payload: Bytes,
    decode: fn(&Bytes) -> Result<M, jaus::codec::DecodeError>,
) -> Result<Bytes, Refusal> {
    decode(&payload)?;
    Ok(payload)
}
