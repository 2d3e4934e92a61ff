//! Damaged MCAP files: what is readable is read, and the rest is an error.

use std::sync::LazyLock;

use jaus_viewers::{Recording, RecordingError};
use proptest::prelude::*;

use crate::scene::recording;

/// The number of frames, and the last error.
fn read(file: &[u8]) -> (usize, Option<RecordingError>) {
    let mut recording = match Recording::new(file) {
        Ok(recording) => recording,
        Err(error) => return (0, Some(error)),
    };
    let (mut count, mut last) = (0, None);
    while let Some(frame) = recording.next_frame() {
        match frame {
            Ok(_) => count += 1,
            Err(error) => last = Some(error),
        }
    }
    (count, last)
}

#[test]
fn a_file_that_ends_early_gives_the_frames_before_and_says_where_it_ends() {
    // Several chunks.
    let file = recording(3000);
    assert_eq!(read(&file).0, 3000);
    let (count, error) = read(&file[..file.len() / 2]);
    assert!(count > 1000, "{count}");
    assert!(
        matches!(error, Some(RecordingError::CutShort { .. })),
        "{error:?}"
    );
}

#[test]
fn an_mcap_file_of_another_program_has_no_frames() {
    let mut file = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::Writer::new(&mut file).unwrap();
    writer.finish().unwrap();
    drop(writer);
    let (count, error) = read(file.get_ref());
    assert_eq!(count, 0);
    let words = error.unwrap().to_string();
    assert!(words.contains("/jaus/frames"), "{words}");
}

/// Made once, because that takes longer than reading it.
static FEW_FRAMES: LazyLock<Vec<u8>> = LazyLock::new(|| recording(20));

proptest! {
    #[test]
    fn no_damage_makes_the_reader_panic_or_run_on(
        at in any::<prop::sample::Index>(),
        octets in prop::collection::vec(any::<u8>(), 1..9),
        cut in any::<prop::sample::Index>(),
    ) {
        let mut file = FEW_FRAMES.clone();
        let at = at.index(file.len());
        for (place, octet) in file[at..].iter_mut().zip(octets) {
            *place = octet;
        }
        read(&file);
        read(&file[..cut.index(file.len())]);
    }
}
