//! `ratelab exercise`, as used by learners and scripts.

use crate::support::{Folder, Said};

#[test]
fn a_rescue_by_hand_is_judged_from_its_recording() {
    let folder = Folder::new();
    folder.plays(
        "cp $CLONE/recordings/*.rrd $CLONE/recordings/rescue.knobs .
         printf '1 control-hz 5\\n2.1 control-hz 50\\n' > knobs
         ratelab run --clock virtual --knobs knobs --record own.rrd => recorded
         ratelab exercise 5 --session own.rrd => ^✓ => rescued: slowed at 1.000 s for 1.10 s
         head -c \"$(($(wc -c < rescued.rrd) * 9 / 10))\" rescued.rrd > shorter.rrd
         (cat rescued.rrd; printf '\\0') > longer.rrd
         ratelab run --clock virtual --knobs rescue.knobs --record repeated.rrd => recorded
         ## Almost at the same nanoseconds, and all of it a little later.
         sed s/34574/34578/ rescue.knobs > knobs
         ratelab run --clock virtual --knobs knobs --record nearly.rrd => recorded
         sed 's/0[.]995/1.005/; s/2[.]116/2.126/' rescue.knobs > knobs
         ratelab run --clock virtual --knobs knobs --record later.rrd => recorded",
    );
    let copied = ["record your own", "not a rescue yet"];
    for (name, whys) in [
        ("longer.rrd", &copied[..]),
        ("shorter.rrd", &copied),
        ("repeated.rrd", &copied),
        ("nearly.rrd", &copied),
        ("later.rrd", &copied),
        ("balanced-50hz.rrd", &["never slowed"]),
        ("fall-5hz.rrd", &["it fell at 0.840 s"]),
        ("rescued.rrd", &["comes with ratelab, record your own"]),
    ] {
        let output = folder.does(&format!("exercise 5 --session {name}"));
        let said = Said::new(&output.stdout);
        assert_eq!(output.status.code(), Some(1), "{name}: {said:?}");
        let refused = said.starts_with('✖') && whys.iter().any(|why| said.contains(why));
        assert!(refused, "{name}: {said:?}");
    }
}

#[test]
fn each_listed_question_can_be_done_alone() {
    let folder = Folder::new();
    let list = folder.says("exercise");
    let labels = list
        .lines()
        .map_while(|line| line.split_whitespace().next());
    let labels: Vec<&str> = labels.collect();
    assert_eq!(labels.len(), 23, "{labels:?}");
    // Each is there: without a prediction only that is missing.
    for label in &labels {
        let (said, _) = folder.fails(&format!("exercise {label}"), 2);
        said.has("no prediction yet");
    }
    let all = labels.join(" => ");
    folder.plays(&format!(
        "2 ratelab exercise 6e => {all}\n2 ratelab exercise 15 => {all}"
    ));
}
