//! The command from outside, in one program: each file is about one command or one kind of output.
//! What lines of the shell can say is in `scripts/`.
#![cfg(unix)] // Shells, signals and terminals as Unix has them.

mod advise;
mod exercise;
mod export_web;
mod files;
mod gate;
mod grade;
mod help;
mod like;
mod outputs;
mod picture;
#[cfg(unix)]
mod programs;
mod recordings;
mod robots;
mod run;
mod schema;
#[path = "../support/mod.rs"]
mod support;
mod sweep;
mod terminal;
mod trace;
mod viewer;

/// Makes a test of each script.
macro_rules! scripts {
    ($($name:ident),*) => {
        $(
            #[test]
            fn $name() {
                let text = include_str!(concat!("scripts/", stringify!($name), ".txt"));
                play(text, shell);
            }
        )*

        #[test]
        fn every_script_is_played() {
            let played = [$(concat!(stringify!($name), ".txt")),*];
            let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/command/scripts");
            assert_eq!(names(folder), played);
        }
    };
}

mod scripts {
    use crate::support::{names, script::play, shell};

    scripts!(
        advise,
        check,
        exercise,
        exercise_check,
        export_web,
        grade,
        help,
        hunt,
        installed,
        like,
        look,
        outputs,
        own_system,
        picture,
        recordings,
        replay,
        run,
        sweep,
        table,
        trace,
        verify
    );
}

#[test]
fn a_row_of_a_script_that_is_untrue_is_named() {
    let folder = support::Folder::new();
    for (row, untrue) in [
        (
            "printf 'a one\\ntwo b\\n' => one => ^two => one$ => !three",
            false,
        ),
        ("echo one => two", true),
        ("echo one => !one", true),
        ("echo a one => ^one", true),
        ("echo one b => one$", true),
        ("echo one; false => one", true),
        ("echo one >&2", true),
        ("2 echo one >&2; exit 2 => one", false),
        ("2 echo one >&2; exit 1 => one", true),
        ("2 echo one >&2; echo two; exit 2 => one", true),
        ("1 echo one >&2; echo two; exit 1 => one => !two", false),
        ("1 echo one >&2; echo two >&2; exit 1 => one", true),
        ("1 exit 1", true),
    ] {
        let faults = support::script::faults(row, |line| support::shell(&folder.path(""), line));
        assert_eq!(!faults.is_empty(), untrue, "{row}: {faults:?}");
    }
}
