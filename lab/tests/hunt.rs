//! `ratelab hunt`: what it finds can be run again, kept and verified.

mod support;

use support::{Folder, User};

#[test]
fn what_was_found_loses_the_run_again() {
    let folder = Folder::new();
    let hunt = "hunt --lose 8 --control-hz 15 --duration-s 6 --save found.knobs";
    let found = folder.says(&format!("{hunt} --record found.rrd"));
    found
        .has("hunt      at most 8 messages of /action lost")
        .has("fault     0 lose /action 1")
        .has(
            "proven    losing messages 1 to 3 of /action is enough; \
             with each of the 6 smaller lists",
        );
    let verdict = found.lines().find(|line| line.starts_with("verdict"));
    folder
        .says("run --clock virtual --knobs found.knobs --control-hz 15 --duration-s 6")
        .has(verdict.expect("a verdict"));
    folder.says("verify found.rrd").has("identical");
    assert_eq!(folder.read("found.knobs").lines().count(), 4);
    folder.refuses(hunt).has("there is such a file");
}

#[test]
fn knobs_that_are_turned_anyway_stay_in_the_file() {
    let folder = Folder::new();
    folder.write("own.knobs", "1 control-hz 12\n");
    let graph = "--control-hz 50 --duration-s 4 --knobs own.knobs";
    let hunt = format!("hunt {graph} --hang policy=600 --save found.knobs --json");
    folder.says(&hunt).has("\"proof\": \"every_smaller\"");
    let found = folder.read("found.knobs");
    assert!(found.contains("\n1 control-hz 12\n"), "{found}");
    let run = "run --clock virtual --duration-s 4 --knobs found.knobs";
    folder.says(run).has("FELL at");
}

#[test]
fn what_makes_no_sense_is_refused() {
    Folder::new().refuses_each(
        "hunt",
        "--lose 0                | nothing may go wrong
         --lose x                | invalid value 'x'
         --lose 2 --topic /none  | expected one of /obs, /action
         --lose 2 --break        | without any fault: FELL at
         --hang policy           | expected NODE=MS
         --hang nobody=90        | there is no such node
         --delay-ms -1           | expected 0 to 60000 milliseconds
         --lose 2 --clock real   | leave --clock real out",
    );
}
