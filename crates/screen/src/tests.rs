//! The dashboard as a whole: injected keys, drawn screens of every size.

mod adders;
mod again;
mod ages;
mod branch;
mod course;
mod faults;
mod files;
pub mod kit;
mod learner;
mod order;
mod pictures;
mod plans;
mod prompt;
mod rescue;
mod robots;
pub mod sample;
mod sessions;
mod stuck;
mod systems;
#[path = "../../../tests/support/table.rs"]
pub mod table;
pub mod testing;
mod tour;

use std::{path::Path, sync::Arc, thread, time::Duration};

use crossterm::event::KeyCode;
use ratelab::{ClockKind, Speed, Time};
use ratelab_cart_pole::{Action, CartPole};
use ratelab_experiment::Config;
use ratelab_system::WorldKind;

use kit::*;
use ratelab_recording::Recording;

use super::{
    app::App,
    frame::Standing,
    panes::{OverlayContent, Pane},
    session::SessionSetup,
    view,
};
use crate::theme::Theme;

#[test]
fn every_size_shows_the_same_run() {
    let app = fallen();
    insta::assert_snapshot!("full_160x50", large(&app));
    insta::assert_snapshot!("compact_80x24", small(&app));
    insta::assert_snapshot!("too_small_39x12", screen(&app, 39, 12));
}

/// Healthy runs, some that are warned of, and ways to lose the pole with long causes; each with
/// what the default terminal shows of it.
const RUNS: &str = "
    0 control-hz 50 | BALANCED; of 74–90; this push is
    0 control-hz 5 | 37 readings were dropped, each for a newer one; age  96 ms of 74–90; \
        age comes from /action: the policy decides every 200 ms. ] raises control-hz
    0 sensor-hz 5 | of 74–90; this push is; \
        age comes from the sensor: it looks 5 times a second. } raises sensor-hz
    0 link /action delay:100 | of 74–90; this push is; :link /action none fixes it
    0 sensor-hz 5; 0 control-hz 5 | FELL at; of 74–90; } raises sensor-hz; ] raises control-hz
    0 control-hz 5; 0 queue-depth 100 | FELL at
    0 link /obs delay:40,loss:0.9 | FELL at
    0 takes policy 60..110 | FELL at
    0 control-hz 45; 0 read /obs oldest; 0 depth /obs 10 | FELL at
    0.3 crash policy | FELL at
    0 policy random | FELL at
";

#[test]
fn the_default_terminal_shows_angle_age_and_cause() {
    for [knobs, parts] in rows(RUNS) {
        let drawn = format!("{knobs}\n{}", small(&ended(config(&knobs))));
        shows(&drawn, &["pole angle", "push age (ms)"]);
        shows(&drawn, &parts.split("; ").collect::<Vec<_>>());
    }
}

#[test]
fn the_events_blame_the_slow_node_alone() {
    let sensor = large(&ended(config("0 sensor-hz 5")));
    for innocent in ["control-hz", "queue"] {
        assert!(!sensor.contains(innocent), "{sensor}");
    }
}

#[test]
fn the_own_world_keeps_names_words_and_seed_in_the_default_terminal() {
    let app = ended(config("own; seed 7"));
    let parts = ["seed 7", "─/state►", " /obs ", " /action ", "0 dropped"];
    shows(&small(&app), &parts);
}

#[test]
fn the_prompt_leaves_the_panes_in_sight_and_tells_the_use_of_each_knob_that_is_typed() {
    let mut app = fallen();
    press(&mut app, ":");
    shows(&small(&app), &["control-hz", "0 s", "Tab goes through"]);
    press(&mut app, "\u{1b}");
    for kind in ratelab::KnobKind::ALL {
        press(&mut app, &format!(":{}", kind.name()));
        shows(&small(&app), &kind.usage().split(' ').collect::<Vec<_>>());
        press(&mut app, "\u{1b}");
    }
}

#[test]
fn another_policy_is_told_in_the_default_terminal() {
    let mut app = running();
    then(&mut app, "p", &["policy is now lqr"]);
    until(&mut app, |app| small(app).contains("  policy lqr"));
    leave(app);
}

#[test]
fn while_looking_back_the_footer_says_how_to_return() {
    let mut app = running();
    until(&mut app, |app| frame(app).now > seconds(0.3));
    then(&mut app, ",", &["looking back", "f live again", "? keys"]);
    then(&mut app, "f", &["[ ] rate", "r restart", "e exercises"]);
    leave(app);
}

#[test]
fn the_dashes_of_the_last_run_are_named_once_there_is_one() {
    let mut app = fallen();
    assert!(!small(&app).contains("last run"));
    press(&mut app, "r");
    end(&mut app);
    shows(&small(&app), &["push age (ms)  ╌╌ last run"]);
}

#[test]
fn nothing_is_cut_at_the_usual_sizes() {
    for [knobs, _] in rows(RUNS) {
        for world in ["", "own"] {
            let mut app = ended(config(&format!("{world}; {knobs}")));
            for pane in Pane::ALL {
                app.shown.panes.focus = pane;
                for overlay in ["", "i", "?", "G"] {
                    press(&mut app, overlay);
                    for (width, height) in [(160, 50), (120, 35), (100, 30), (80, 24)] {
                        let drawn = screen(&app, width, height);
                        // A table counts the rows that a zoom shows.
                        let mut cut = drawn.lines().filter(|line| line.contains('…'));
                        let whole = cut.all(|line| line.contains("more") && pane == Pane::Figures);
                        assert!(whole, "{knobs} {pane:?} {overlay}:\n{drawn}");
                    }
                    press(&mut app, overlay);
                }
            }
        }
    }
}

#[test]
fn every_pane_alone_fits_the_smallest_screen() {
    let mut app = fallen();
    for pane in Pane::ALL {
        app.shown.panes.focus = pane;
        let name = format!("{pane:?}_40x12").to_lowercase();
        insta::assert_snapshot!(name, screen(&app, 40, 12));
    }
}

#[test]
fn no_size_and_no_theme_panics() {
    let mut app = fallen();
    press(&mut app, "m");
    app.shown.panes.overlay = Some((OverlayContent::Keys, 0));
    let sizes = (0..=60).chain([79, 80, 119, 120, 160, 250]);
    for (width, height) in
        sizes.flat_map(|w| [0, 1, 2, 5, 11, 12, 23, 24, 35, 36, 80].map(|h| (w, h)))
    {
        for theme in [RICH, POOR] {
            drawn(&app, &theme, width, height);
        }
    }
}

#[test]
fn ascii_is_ascii_and_no_colour_sets_none() {
    let mut app = fallen();
    for pane in Pane::ALL {
        app.shown.panes.focus = pane;
        for (width, height) in [(160, 50), (80, 24), (40, 12)] {
            for cell in drawn(&app, &POOR, width, height).buffer().content() {
                assert!(cell.symbol().is_ascii(), "{:?} in {pane:?}", cell.symbol());
                assert_eq!(cell.fg, ratatui::style::Color::Reset);
                assert_eq!(cell.bg, ratatui::style::Color::Reset);
            }
        }
    }
}

#[test]
fn the_numbers_drawn_are_those_of_the_summary() {
    let app = fallen();
    let drawn = large(&app);
    let summary = left(app).ended.expect("no fault").summary;
    shows(&drawn, &[&summary.verdict.to_string()]);
    for topic in ["/obs", "/action"].map(|name| summary.topic(name).expect("a topic")) {
        // The table's rows begin with the name, inside of the pane's border.
        let is_row = |line: &&str| {
            line.split_whitespace().nth(1) == Some(&*topic.name) && line.contains(" 100 ")
        };
        let row = drawn.lines().find(is_row).expect(&drawn);
        let words: Vec<&str> = row.split_whitespace().collect();
        for figure in [topic.published, topic.dropped()] {
            assert!(words.contains(&&*figure.to_string()), "{figure} in {row}");
        }
    }
}

/// Opens the map and waits until all of it is made.
fn with_map() -> App {
    let mut app = ended(config("control-hz 7"));
    press(&mut app, "m");
    while !screen(&app, 120, 36).contains("3000 runs of 10 s") {
        sample(&mut app);
        // To draw takes a core as long as to run.
        thread::sleep(Duration::from_millis(50));
    }
    app
}

#[test]
fn the_cliff_map_lies_over_the_panes_and_is_kept_until_its_conditions_change() {
    let mut app = with_map();
    insta::assert_snapshot!("map_120x36", screen(&app, 120, 36));
    insta::assert_snapshot!("map_80x24", small(&app));
    insta::assert_snapshot!("map_40x12", drawn(&app, &POOR, 40, 12).to_string());
    press(&mut app, "m");
    assert!(!screen(&app, 120, 36).contains("cliff map"));
    for (keys, part) in [
        ("m", "3000 runs of 10 s"),
        // It begins at the rate in force again, and gets a column for it.
        ("m]]]]m", "12 Hz, seed 0"),
        ("m]]]]]m", "40 Hz, seed 0"),
    ] {
        press(&mut app, keys);
        shows(&screen(&app, 120, 36), &[part]);
    }
    // Keys of the lab go on to work under it.
    press(&mut app, ">");
    sample(&mut app);
    shows(&screen(&app, 120, 36), &["queue-depth 2", "of 3100 runs"]);
}
