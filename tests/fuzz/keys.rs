//! Keys in a terminal: with any keys, pastes, clicks and resizes, the lab and the replay
//! continue, quit on request and restore the terminal.

use std::{
    path::Path,
    time::{Duration, Instant},
};

use rand::Rng;
use tempfile::tempdir;
use vt100::MouseProtocolMode;

use crate::{
    cases::{RandomSource, chance, pick, pick_from, run},
    root,
    support::terminal::{Lab, PATIENCE, assert_given_back},
};

/// Keys with an effect, and text for the prompt, separated by `|`.
const KEYS: &str = "[|]|<|>|{|}|b|r|n|N|p|P|c|m|w|e|f|z|+|-|0|.|,| |?|\t|1|2|3|4|5|\r|\u{7f}|\
    \u{1b}\u{1b}|:|:control-hz 7.5\r|:control-hz 0\r|:policy lqr\r|:policy none.pt\r|:rubbish\r|\
    :queue-depth 9999999\r|8 because half\r|many\r|[[[[[[[[[[[[|]]]]]]]]]]]]";

/// Sequences that terminals send for other keys, pastes, the mouse and on their own, and
/// some that none sends, separated by `|`.
const SEQUENCES: &[u8] =
    b"\x1b[A|\x1b[B|\x1b[C|\x1b[D|\x1b[H|\x1b[F|\x1b[5~|\x1b[6~|\x1b[3~|\x1bOP|\x1b[15~|\
    \x1b[24;5~|\x1b[1;5C|\x1b[Z|\x1bx|\x1a|\x1b[97;5u|\x1b[I|\x1b[O|\x1b[10;10R|\x1b[?1;2c|\
    \x1b]0;title\x07|\x1b[<0;10;10M|\x1b[<64;999;999m|\x1b[M !!|\x1b[32;30;40M|\x1b[?997;1n|\
    \x1b[200~[[[w:r\r\x1b[201~|\x1b[200~\xff\x1b[2J\x1b[201~|\x1b[201~|\x1b[|\x1bP1$|\
    \x1b[99999999999999999999A|\x1b[;;;;;;;m|\0|\xff\xfe|\xc3|\xc3\xa9|\xf0\x9f\x98\x80|\
    \xe2\x80\xae|\x1b[?|\x1b[<|\x9b|\x1c|\x16";

/// Ends unfinished sequences of a terminal: a mouse report, an answer, a paste. Until
/// then crossterm treats every key as a part of one, even Ctrl-C.
const RESET: &[u8] = b"Mu\x1b[201~Mu";

/// Closes prompts and pages, then quits; or quits at once.
const QUIT: [&[u8]; 2] = [b"\x1b\x1b\x1b\x1b\x1b\x1bq", b"\x03"];

/// Time to wait for more output before the next input.
const PAUSE: Duration = Duration::from_millis(25);

/// Number of attempts to quit: an unfinished sequence may swallow some.
const TIMES: usize = 20;

fn piece(random: &mut RandomSource) -> Vec<u8> {
    match random.random_range(0..100) {
        0..55 => pick_from(random, KEYS).as_bytes().to_vec(),
        55..85 => {
            let sequences: Vec<_> = SEQUENCES.split(|byte| *byte == b'|').collect();
            pick(random, &sequences).to_vec()
        }
        // A key held down.
        85..95 => pick_from(random, KEYS)
            .as_bytes()
            .repeat(random.random_range(1..10)),
        _ => (0..random.random_range(1..40))
            .map(|_| random.random())
            .collect(),
    }
}

fn open(random: &mut RandomSource, folder: &Path) -> Lab {
    let line = match random.random_range(0..3) {
        0 => format!(
            "replay --terminal '{}'",
            root().join("recordings/rescued.rrd").display()
        ),
        1 => "lab --clock virtual --speed 100".to_owned(),
        _ => "lab --clock virtual --duration-s 3".to_owned(),
    };
    let ascii = if chance(random, 20) { " --ascii" } else { "" };
    Lab::open_in(folder, &(line + ascii), 24, 80)
}

#[test]
fn keys() {
    run("keys", 6, |random, note| {
        let folder = tempdir().expect("a folder");
        let mut lab = open(random, folder.path());
        wait_until_open(&mut lab);
        let pieces = random.random_range(1..40);
        for _ in 0..pieces {
            if chance(random, 10) {
                let (rows, cols) = (random.random_range(0..60), random.random_range(0..200));
                lab.tell_size(rows, cols);
            }
            let piece = piece(random);
            note.push_str(&format!("{} ", piece.escape_ascii()));
            // The input itself may quit the program.
            if lab.send(&piece).is_err() || !lab.read_more(PAUSE) {
                break;
            }
        }
        quit(&mut lab, pick(random, &QUIT));
        assert_eq!(lab.modes(), lab.first_modes, "other modes of the line");
        let (status, parser) = lab.close();
        let screen = parser.screen();
        // A Ctrl-C after the terminal is restored is a signal.
        let documented = [0, 130].contains(&status.exit_code());
        assert!(documented, "{status:?}\n{}", screen.contents());
        assert_given_back(&parser);
        assert!(
            !screen.application_cursor() && !screen.application_keypad(),
            "other keys"
        );
        assert_eq!(screen.mouse_protocol_mode(), MouseProtocolMode::None);
    });
}

/// Waits until the program controls the terminal: earlier input would not reach it.
fn wait_until_open(lab: &mut Lab) {
    let deadline = Instant::now() + PATIENCE;
    while !lab.parser.screen().alternate_screen() {
        let more = lab.read_more(PAUSE);
        assert!(more && Instant::now() < deadline, "{}", lab.screen());
    }
}

/// Sends the keys to quit until the output of `lab` ends.
fn quit(lab: &mut Lab, keys: &[u8]) {
    for _ in 0..TIMES {
        let _ = lab.send(RESET).and_then(|()| lab.send(keys)); // Fails after the program's end.
        for _ in 0..20 {
            if !lab.read_more(PAUSE) {
                return;
            }
        }
    }
    panic!("it does not quit; the screen shows\n{}", lab.screen());
}
