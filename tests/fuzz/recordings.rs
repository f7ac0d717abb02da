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
    program::ratelab,
    root,
};

/// Recordings of an earlier version to alter.
const EARLIER: [&str; 2] = ["recordings/fall-5hz.rrd", "recordings/rescued.rrd"];

/// The command line of a fresh recording, written to [`FRESH`].
const RUN: &str = "run --clock virtual --duration-s 2 --policy lqr --queue-depth 3 \
                   --control-hz 10 --record fresh.rrd";

const FRESH: &str = "fresh.rrd";

/// Name of an altered recording.
const ALTERED: &str = "altered.rrd";

/// The messages of a recording.
pub fn decode(file: &Path) -> Vec<LogMsg> {
    let bytes = fs::read(file).expect("a recording");
    let messages = DecoderApp::decode_eager(&*bytes).expect("a recording");
    messages
        .map(|message| message.expect("a message"))
        .collect()
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
    let run_now = RUN.split_whitespace().collect::<Vec<_>>();
    let output = ratelab(&run_now, folder.path(), folder.path());
    assert!(output.status.success(), "{output:?}");
    let [fall, rescued] = EARLIER.map(|name| decode(&root().join(name)));
    let originals = [&fall, &rescued, &decode(&folder.path().join(FRESH))];
    let file = folder.path().join(ALTERED);
    let ask = |command| ratelab(&[command, ALTERED], folder.path(), folder.path());
    for original in originals {
        fs::write(&file, encode(original)).expect("written");
        let output = ask("verify");
        assert!(
            output.status.success(),
            "not altered, only encoded again: {output:?}"
        );
    }
    run("recordings", 60, |random, note| {
        let mut messages = pick(random, &originals).clone();
        *note = alter(&mut messages, random);
        fs::write(&file, encode(&messages)).expect("written");
        ask("info");
        assert!(!ask("verify").status.success(), "verify accepts it");
    });
}
