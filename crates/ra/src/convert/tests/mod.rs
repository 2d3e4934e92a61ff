//! Tests of message conversion, and their helpers.

mod captured;
mod differences;
mod random;
mod units;

use super::*;
use jaus::codec::Message;

/// Code and data of an RA message.
fn ra<M: Message>(message: &M) -> (u16, Bytes) {
    (M::CODE, message.encode().unwrap().slice(2..))
}

/// Converts an RA message to ours.
fn into_ours<Ra: Message, Jaus: Message>(message: &Ra) -> Result<Jaus, Refusal> {
    into_ours_with(Context::default(), message)
}

fn into_ours_with<Ra: Message, Jaus: Message>(
    context: Context<'_>,
    message: &Ra,
) -> Result<Jaus, Refusal> {
    let (code, data) = ra(message);
    to_jaus_with(context, code, &data).map(|payload| Jaus::decode(&payload).unwrap())
}

/// Converts one of our messages to the Reference Architecture.
fn into_theirs<Jaus: Message, Ra: Message>(message: &Jaus) -> Result<Ra, Refusal> {
    into_theirs_with(Context::default(), message)
}

fn into_theirs_with<Jaus: Message, Ra: Message>(
    context: Context<'_>,
    message: &Jaus,
) -> Result<Ra, Refusal> {
    let (code, data) = to_ra_with(context, &message.encode().unwrap())?;
    assert_eq!(code, Ra::CODE);
    let payload = [&code.to_le_bytes(), data.as_ref()].concat();
    Ok(Ra::decode(&payload.into()).unwrap())
}

fn octets(hex: &str) -> Vec<u8> {
    let digits: Vec<u8> = hex.bytes().filter(u8::is_ascii_hexdigit).collect();
    let octet = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    digits.chunks(2).map(octet).collect()
}

#[track_caller]
fn near(value: Option<f64>, expected: f64, step: f64) {
    let value = value.expect("a value");
    assert!(
        (value - expected).abs() <= step,
        "{value} is not {expected}"
    );
}
