//! A single bit error on the disk: the store is refused or repaired, or the bit was unused. A store
//! that opens has exactly the written content.

use std::panic::catch_unwind;

use jaus_vehicle::world::World;

use crate::store::torn::Disk;
use crate::store::{chance, cuts, ledger};

/// Number of steps before the store is closed.
const LAST: u32 = 3;
const PAGE: usize = 4096;
/// Octets of the header including its two commit slots.
const HEADER: usize = 320;

/// Result of opening a store with a flipped bit.
#[derive(Debug, PartialEq)]
enum Outcome {
    Refused,
    Unharmed,
    /// It opened with other content than was written.
    Changed,
}

#[test]
fn a_closed_store_with_a_flipped_bit_is_refused_or_unharmed() {
    flip_bits("closed", &image(true));
}

#[test]
fn a_store_of_a_killed_process_with_a_flipped_bit_is_refused_or_unharmed() {
    flip_bits("killed", &image(false));
}

/// Flips each bit of the header, and some bits of every used page.
fn flip_bits(test: &str, image: &[u8]) {
    let mut chance = chance(test);
    let mut bits: Vec<usize> = (0..HEADER * 8).collect();
    for (page, octets) in image.chunks(PAGE).enumerate() {
        if octets.iter().any(|&octet| octet != 0) {
            let any_bit = || (page * PAGE) * 8 + chance.below(PAGE * 8);
            bits.extend(std::iter::repeat_with(any_bit).take(cuts(60) as usize));
        }
    }
    let (mut refused, mut unharmed, mut changed) = (0, 0, Vec::new());
    for bit in bits {
        match flip(image, bit) {
            Outcome::Refused => refused += 1,
            Outcome::Unharmed => unharmed += 1,
            Outcome::Changed => changed.push((bit / 8, bit % 8)),
        }
    }
    println!("{test}: {refused} refused, {unharmed} unharmed, changed: {changed:?}");
    assert!(changed.is_empty() && refused.min(unharmed) > 100);
}

fn flip(image: &[u8], bit: usize) -> Outcome {
    let mut damaged = image.to_vec();
    damaged[bit / 8] ^= 1 << (bit % 8);
    let opened = catch_unwind(|| {
        let world = World::on(Disk::new(damaged, u64::MAX)).ok()?;
        Some(ledger::last_step(&world))
    });
    match opened {
        Ok(None) => Outcome::Refused,
        Ok(Some(LAST)) => Outcome::Unharmed,
        Ok(Some(_)) | Err(_) => Outcome::Changed,
    }
}

/// A store with [`LAST`] steps, properly closed or not.
fn image(is_closed: bool) -> Vec<u8> {
    let disk = Disk::new(Vec::new(), u64::MAX);
    let mut world = World::on(disk.clone()).unwrap();
    ledger::begin(&mut world);
    for n in 1..=LAST {
        assert!(ledger::step(&mut world, n));
    }
    let open = disk.seen();
    drop(world);
    if is_closed { disk.seen() } else { open }
}
