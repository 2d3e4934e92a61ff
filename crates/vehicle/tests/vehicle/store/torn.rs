//! A disk that loses power: it keeps some of the unflushed writes, complete or partial, in any
//! order.

use std::io;
use std::sync::{Arc, Mutex};

use jaus_test_kit::random::Random;
use jaus_vehicle::world::{StorageBackend, World};

use crate::store::{chance, cuts, ledger};

/// Unit of an atomic disk write.
const SECTOR: usize = 512;

#[test]
fn nothing_acknowledged_is_lost_when_the_power_fails() {
    let mut chance = chance("torn");
    let mut image = first_image();
    let mut last = 0;
    for cut in 0..cuts(60) {
        let disk = Disk::new(image, 1 + chance.number() % 120);
        let acknowledged = write_until_cut(&disk, last);
        image = disk.after_the_cut(&mut chance);
        let spare = Disk::new(image.clone(), u64::MAX);
        let world = World::on(spare).unwrap_or_else(|error| panic!("cut {cut}: {error}"));
        last = ledger::last_step(&world);
        let more = acknowledged..=acknowledged + 1;
        assert!(more.contains(&last), "cut {cut}: {last} of {acknowledged}");
    }
    println!("{last} steps");
}

/// A completely created store: a file gets its name only then.
fn first_image() -> Vec<u8> {
    let disk = Disk::new(Vec::new(), u64::MAX);
    let mut world = World::on(disk.clone()).unwrap();
    ledger::begin(&mut world);
    drop(world);
    disk.seen()
}

/// Writes until the power fails. Returns the last acknowledged step.
fn write_until_cut(disk: &Disk, before: u32) -> u32 {
    // The power may fail during the repair.
    let Ok(mut world) = World::on(disk.clone()) else {
        return before;
    };
    let mut last = ledger::last_step(&world);
    assert!(last >= before);
    while ledger::step(&mut world, last + 1) {
        last += 1;
    }
    last
}

/// A disk in memory.
#[derive(Debug, Clone)]
pub(crate) struct Disk(Arc<Mutex<State>>);

#[derive(Debug)]
struct State {
    /// Content seen by reads.
    seen: Vec<u8>,
    /// Content that survives a power cut.
    kept: Vec<u8>,
    /// Writes since the last flush.
    unsure: Vec<Write>,
    /// Number of writes and flushes before the power fails.
    left: u64,
}

#[derive(Debug)]
enum Write {
    Octets(u64, Vec<u8>),
    Length(u64),
}

impl Disk {
    pub(crate) fn new(image: Vec<u8>, left: u64) -> Self {
        Self(Arc::new(Mutex::new(State {
            kept: image.clone(),
            seen: image,
            unsure: Vec::new(),
            left,
        })))
    }

    /// Content seen by reads.
    pub(crate) fn seen(&self) -> Vec<u8> {
        self.0.lock().unwrap().seen.clone()
    }

    /// Content after the power cut.
    fn after_the_cut(&self, chance: &mut Random) -> Vec<u8> {
        let mut state = self.0.lock().unwrap();
        let mut image = std::mem::take(&mut state.kept);
        let mut unsure = std::mem::take(&mut state.unsure);
        // In half of the cuts the write order is arbitrary.
        if chance.below(2) == 0 {
            for i in (1..unsure.len()).rev() {
                unsure.swap(i, chance.below(i + 1));
            }
        }
        for write in unsure {
            match write {
                Write::Length(length) if chance.below(2) == 0 => {
                    image.resize(length as usize, 0);
                }
                Write::Length(_) => {}
                Write::Octets(offset, octets) => tear(&mut image, offset as usize, &octets, chance),
            }
        }
        image
    }
}

/// Writes all sectors, none, or a random selection.
fn tear(image: &mut Vec<u8>, offset: usize, octets: &[u8], chance: &mut Random) {
    let kind = chance.below(3);
    let mut at = offset;
    for part in octets.chunks(SECTOR) {
        if kind == 0 || (kind == 1 && chance.below(2) == 0) {
            let end = at + part.len();
            if image.len() < end {
                image.resize(end, 0);
            }
            image[at..end].copy_from_slice(part);
        }
        at += part.len();
    }
}

impl State {
    fn spend(&mut self) -> io::Result<()> {
        self.left = self.left.checked_sub(1).ok_or_else(cut)?;
        Ok(())
    }
}

fn cut() -> io::Error {
    io::Error::other("the power has failed")
}

impl StorageBackend for Disk {
    fn len(&self) -> io::Result<u64> {
        Ok(self.0.lock().unwrap().seen.len() as u64)
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        let state = self.0.lock().unwrap();
        let begin = offset as usize;
        let octets = state.seen.get(begin..begin + out.len());
        out.copy_from_slice(octets.ok_or(io::ErrorKind::UnexpectedEof)?);
        Ok(())
    }

    fn set_len(&self, length: u64) -> io::Result<()> {
        let mut state = self.0.lock().unwrap();
        state.spend()?;
        state.seen.resize(length as usize, 0);
        state.unsure.push(Write::Length(length));
        Ok(())
    }

    fn sync_data(&self) -> io::Result<()> {
        let mut state = self.0.lock().unwrap();
        state.spend()?;
        state.kept = state.seen.clone();
        state.unsure.clear();
        Ok(())
    }

    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        let mut state = self.0.lock().unwrap();
        let power = state.spend();
        // The write during the power failure may also be torn.
        state.unsure.push(Write::Octets(offset, data.to_vec()));
        power?;
        let begin = offset as usize;
        state.seen[begin..begin + data.len()].copy_from_slice(data);
        Ok(())
    }
}
