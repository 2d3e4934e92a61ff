//! What decoding allocates, and what it needs of the stack.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::alloc::System;
use std::sync::Mutex;
use std::thread;

use jaus_codec::{Bytes, DecodeErrorKind, LargeArray, Reader};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// The allocator counts for all threads: one test at a time.
static ALONE: Mutex<()> = Mutex::new(());

/// Much more memory than the octet that it takes at least.
type Large = [u64; 512];

#[test]
fn a_list_allocates_no_more_in_advance_than_the_message_has_octets() {
    let _alone = ALONE.lock();
    let octets = Bytes::from([&60_000_u16.to_le_bytes()[..], &[0; 60_000]].concat());
    let region = Region::new(ALLOCATOR);
    let mut reader = Reader::new(&octets);
    let list = reader.list::<u16, Large>(0, 60_000, 1, |input| {
        input.require(60_001)?;
        Ok([0; 512])
    });
    let allocated = region.change().bytes_allocated;
    let error = list.unwrap_err();
    assert!(matches!(error.kind(), DecodeErrorKind::Short { .. }));
    assert!(allocated < 70_000, "{allocated}");

    let mut reader = Reader::new(&octets);
    let whole = reader.list::<u16, Large>(0, 60_000, 1, |input| {
        input.fixed::<u8>()?;
        Ok([7; 512])
    });
    assert!(whole.unwrap().iter().all(|element| *element == [7; 512]));
}

#[test]
fn a_large_array_is_never_on_the_stack() {
    let _alone = ALONE.lock();
    let small_stack = thread::Builder::new().stack_size(256 << 10);
    let run = || {
        let mut array = LargeArray::<f64, 131_072>::default();
        array[131_071] = 2.5;
        let copy = array.clone();
        assert_eq!(array, copy);
        let octets = Bytes::from(vec![0; 8 * 131_072]);
        let mut reader = Reader::new(&octets);
        let read = LargeArray::<f64, 131_072>::try_from_fn(|_| reader.fixed());
        assert_eq!(read.unwrap(), LargeArray::default());
    };
    small_stack.spawn(run).unwrap().join().unwrap();
}
