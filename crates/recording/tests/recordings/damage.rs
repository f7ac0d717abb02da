//! Torn, damaged and foreign files.

use std::{fs, path::Path, thread, time::Duration};

use ratelab::Time;
use ratelab_experiment::Config;
use ratelab_recording::{ReadError, Recorder, Recording, Source};
use rerun::external::re_log_encoding::{DecoderApp, Encoder, EncodingOptions};

use super::{
    Dice, assert_has, cases, experiment, file, finish, folder, ms, paced, read, recorder,
    recording, replayed, to, verify,
};

/// A file as it is while it is recorded, before its batches are put together,
/// and the recording that comes of it. Batches are made by wall time: this takes
/// 2.5 s of it.
fn as_killed(path: &Path) -> (Vec<u8>, Recording) {
    let experiment = experiment(&paced(4.0));
    let recorder = recorder(&experiment, path);
    let outcome = experiment.run();
    thread::sleep(Duration::from_millis(1_100));
    let bytes = fs::read(path).expect("read");
    finish(recorder, &outcome);
    (bytes, read(path))
}

#[test]
fn a_torn_file_is_good_up_to_its_last_batch() {
    let (_folder, path) = file("torn.rrd");
    let (whole, original) = as_killed(&path);
    let mut longest = Time::ZERO;
    for cut in (0..whole.len()).step_by(2_991).chain([whole.len()]) {
        fs::write(&path, &whole[..cut]).expect("written");
        let Ok(torn) = Recording::read(&path) else {
            assert_eq!(longest, Time::ZERO, "nothing of {cut} bytes is good");
            continue;
        };
        assert!(torn.until >= longest, "more bytes, less that is good");
        longest = torn.until;
        if torn.outcome.is_some() {
            continue; // Only what the viewer needs for speed is missing.
        }
        let defect = torn.defect().expect("it is torn");
        assert_has(&defect, &format!("good up to {}", torn.until));
        for (torn_rows, rows) in torn.topics.iter().zip(&original.topics) {
            let heads = rows.heads();
            let good = heads.partition_point(|head| head.stamp <= torn.until);
            assert_eq!(torn_rows.heads(), &heads[..good], "a gap at {cut}");
        }
        verify(&torn).expect("the part is identical");
    }
    assert!(longest > ms(8000), "{longest}");
}

/// Reads `bytes` as a file, replays and verifies what can be read.
fn use_it(path: &Path, bytes: &[u8]) -> Result<(), ReadError> {
    fs::write(path, bytes).expect("written");
    let replay = replayed(Recording::read(path)?);
    let _ = replay.summary();
    // Whatever it says: it is an answer.
    let _ = verify(replay.recording());
    Ok(())
}

/// Uses `whole` as `damage` leaves it, so many times; checks that some of this is refused, and
/// returns how much.
fn use_damaged(whole: &[u8], cases: usize, mut damage: impl FnMut(&mut Vec<u8>)) -> usize {
    let (_folder, path) = file("damaged.rrd");
    let refused = (0..cases)
        .filter(|_| {
            let mut bytes = whole.to_vec();
            damage(&mut bytes);
            use_it(&path, &bytes).is_err()
        })
        .count();
    assert!(refused >= cases / 10, "{refused} were refused");
    refused
}

/// Writes a number that may be far too large at byte `at`.
fn overwrite(bytes: &mut [u8], at: usize, dice: &mut Dice) {
    let large = u64::MAX >> dice.below(64);
    bytes[at..at + 8].copy_from_slice(&large.to_le_bytes());
}

#[test]
fn damaged_files_come_to_nothing_worse_than_a_message() {
    let (folder, mut dice) = (folder(), Dice(5));
    let whole = fs::read(recording(&folder).path).expect("read");
    let refused = use_damaged(&whole, cases(150), |bytes| match dice.below(5) {
        0 => bytes.truncate(dice.below(whole.len())),
        1 => {
            let at = dice.below(bytes.len());
            bytes[at] ^= 1 << dice.below(8);
        }
        2 => {
            for _ in 0..1 + dice.below(100) {
                let at = dice.below(bytes.len());
                bytes[at] = dice.roll() as u8;
            }
        }
        3 => {
            let (from, to) = (dice.below(bytes.len()), dice.below(bytes.len()));
            bytes.drain(from.min(to)..from.max(to));
        }
        _ => {
            let at = dice.below(bytes.len() - 8);
            overwrite(bytes, at, &mut dice);
        }
    });
    // Some damage is where nothing is read.
    assert!(refused < cases(150), "all were refused");
}

#[test]
fn what_is_no_recording_is_said_to_be_none() {
    let (_folder, path) = file("file");
    for (bytes, what) in [
        (
            &b""[..],
            "this file is empty: a recording that is killed in its first second holds",
        ),
        (b"step,time_s\n1,0.0\n", "not a rerun recording"),
        (b"RRF2", "not a rerun recording"),
        (
            b"RRF2\0\x24\x03\0\x02\x02\0\0",
            "damaged at its beginning: it ends too early; a recording that is killed",
        ),
    ] {
        let error = use_it(&path, bytes).expect_err("refused").to_string();
        assert_has(&error, what);
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

#[test]
fn lengths_within_a_message_are_not_believed() {
    let (folder, mut dice) = (folder(), Dice(6));
    let whole = fs::read(recording(&folder).path).expect("read");
    // Unpacked, what Arrow itself would read is there to be damaged.
    let messages = DecoderApp::decode_eager(&*whole).expect("whole");
    let mut unpacked = Vec::new();
    let version = rerun::build_info().version;
    let options = EncodingOptions::PROTOBUF_UNCOMPRESSED;
    let mut encoder = Encoder::new_eager(version, options, &mut unpacked).expect("encoder");
    for message in messages {
        encoder.append(&message.expect("whole")).expect("encoded");
    }
    encoder.finish().expect("finished");
    drop(encoder);
    use_damaged(&unpacked, 300, |bytes| {
        for _ in 0..1 + dice.below(200) {
            // Where lengths are: on whole words.
            let at = dice.below(bytes.len() / 8 - 1) * 8;
            overwrite(bytes, at, &mut dice);
        }
    });
}

#[test]
fn what_a_file_says_commands_no_terminal() {
    let (_folder, path) = file("run.rrd");
    let experiment = experiment(&Config::default());
    let mut source = Source::for_experiment(&experiment);
    source.origin.ratelab = "1\u{1b}[2J\nverdict".to_owned();
    let recorder = Recorder::from_the_start(&mut to(&path), &source).expect("recorder");
    drop(source);
    finish(recorder, &experiment.run());
    assert_eq!(read(&path).origin.ratelab, r"1\u{1b}[2J\nverdict");
}
