//! Altered recordings: a verification never accepts them as identical, and any file takes
//! little time and memory.

use std::{fs, path::Path};

use rerun::{
    external::re_log_encoding::{DecoderApp, Encoder},
    log::LogMsg,
};
use tempfile::tempdir;

use crate::{
    alterations::alter,
    cases::{pick, run},
    program::does,
    real_clock::compared,
    root,
};

/// Recordings to alter.
const SHIPPED: [&str; 2] = ["recordings/fall-5hz.rrd", "recordings/rescued.rrd"];

/// The command lines of fresh ones; the first argument of some is a graph file.
const RUNS: [&str; 6] = [
    "run --clock virtual --duration-s 2 --policy lqr --queue-depth 3 --control-hz 10",
    "run --clock virtual --duration-s 1 --world own --takes policy=5..40 --speed 10",
    "graphs/robot.toml run --clock virtual --duration-s 2",
    "graphs/three-servos.toml run --clock virtual --duration-s 1",
    "graphs/camera-pole.toml run --clock virtual --duration-s 2",
    "run --duration-s 0.5 --world own --takes policy=12..30",
];

/// Name of an altered recording.
const ALTERED: &str = "altered.rrd";

/// The messages of a recording.
fn decode(file: &Path) -> Vec<LogMsg> {
    let bytes = fs::read(file).expect("a recording");
    let messages = DecoderApp::decode_eager(&*bytes).expect("a recording");
    messages
        .map(|message| message.expect("a message"))
        .collect()
}

/// Runs the command `line` in `folder`; the messages of its recording. A graph file in it is one
/// of the clone.
pub fn record(folder: &Path, line: &str) -> Vec<LogMsg> {
    let file = folder.join("recorded.rrd");
    let graphs = format!("{}/graphs/", root().display());
    let line = line.replace("graphs/", &graphs) + " --record recorded.rrd";
    // Some graphs miss their goal.
    let output = does(&line, folder);
    assert!(file.exists(), "{output:?}");
    let messages = decode(&file);
    fs::remove_file(file).expect("removed");
    messages
}

/// Encodes `messages` as a file. Files that rerun itself would not index get no index.
pub fn encode(messages: &[LogMsg]) -> Vec<u8> {
    Encoder::encode(messages.iter().map(Ok)).unwrap_or_else(|_| {
        let mut encoder = Encoder::local().expect("an encoder");
        encoder.do_not_emit_footer();
        for message in messages {
            encoder.append(message).expect("encoded");
        }
        encoder.finish().expect("finished");
        encoder.into_inner().expect("a file")
    })
}

#[test]
fn recordings() {
    let folder = tempdir().expect("a folder");
    let fresh = RUNS.iter().map(|line| record(folder.path(), line));
    let shipped = SHIPPED.iter().map(|name| decode(&root().join(name)));
    let originals: Vec<_> = shipped.chain(fresh).collect();
    let originals: Vec<&Vec<LogMsg>> = originals.iter().collect();
    let file = folder.path().join(ALTERED);
    let ask = |command: &str| does(&format!("{command} {ALTERED}"), folder.path());
    for original in &originals {
        fs::write(&file, encode(original)).expect("written");
        let output = ask("verify");
        assert!(
            output.status.success(),
            "not altered, only encoded again: {output:?}"
        );
    }
    run("recordings", 30, |random, note| {
        let original = pick(random, &originals);
        let mut messages = original.clone();
        *note = alter(&mut messages, random);
        // Less than a nanosecond of a lateness is none.
        if compared(&messages) == compared(original) {
            return;
        }
        fs::write(&file, encode(&messages)).expect("written");
        ask("info");
        assert!(!ask("verify").status.success(), "verify accepts it");
    });
}
