//! What the screen tells a learner before the first prediction: not one answer.

use exercises::{framework::Brief, questions};
use ratelab_experiment::millis::number;
use ratelab_system::{Setup, System};

use super::*;
use crate::{course::PanelAction, frame::Health};

/// The measured answers for the number 0. The tests of the manual keep this page true.
const ANSWERS: &str = include_str!("../../../../docs/answers.md");

/// Sizes of a terminal.
const SIZES: [(u16, u16); 2] = [(80, 24), (120, 35)];

/// Texts before the first prediction with the figures of an answer that are none: the question, a
/// part of the text, and why it may stand there.
const INCIDENTAL: &[(&str, &str, &str)] = &[
    ("6a", "comes after 90 ms", "a hint of 8a"),
    ("6a", "up to 80 ms old", "the median latency at 5 Hz"),
    ("6b", "up to 80 ms old", "the median latency at 5 Hz"),
    (
        "6b",
        "by 70 ms on average",
        "8a: a mean delay that is given",
    ),
    ("6b", "exactly 70 ms", "8a: the same"),
    ("6b", "comes after 70 ms", "a hint of 8a"),
    ("10", "/obs queues, /action", "the choices of the question"),
    (
        "13b",
        "from arrival, committed",
        "the choices of the question",
    ),
    (
        "13b",
        "robot is committed until",
        "the repairs are described",
    ),
];

/// A lab of a learner who has not predicted anything, after a run of `config`.
fn lab(config: &Config, hides_limits: bool) -> App {
    let setup = SessionSetup {
        hides_limits,
        ..setup()
    };
    let mut app = opened(setup, config);
    end(&mut app);
    until(&mut app, |app| !frame(app).awaits_limits);
    app
}

/// Everything that the screen shows of a run: all panes, also alone, with their explanations.
fn panes(app: &mut App) -> String {
    let mut all = String::new();
    for pane in "123456".chars() {
        for keys in ["", "z", "i"] {
            press(app, &format!("{pane}{keys}"));
            sample(app);
            for (width, height) in SIZES {
                all += &screen(app, width, height);
            }
            all += &page(app);
            press(app, if keys == "i" { "\u{1b}" } else { keys });
        }
    }
    all
}

/// The whole text of the page over the panes, if there is one.
fn page(app: &App) -> String {
    let page = app
        .screen()
        .and_then(|screen| screen.page)
        .unwrap_or_default();
    let rows = page
        .rows
        .iter()
        .map(|(key, text)| format!("{key} {text}\n"));
    rows.fold(page.text + "\n", |all, row| all + &row)
}

/// The pages of keys and words, and all questions with their titles and hints.
fn pages(app: &mut App) -> String {
    let mut all = String::new();
    for key in ["?", "G"] {
        press(app, key);
        sample(app);
        all += &page(app);
        press(app, "\u{1b}");
    }
    let briefs = questions().map(|question| question.brief());
    briefs.fold(all, |all, brief| {
        let (title, objective, hint) = (&brief.title, &brief.objective, &brief.hint);
        all + &format!("{title}\n{objective}\n{}\n{hint}\n", brief.asked())
    })
}

/// The figures that answer a question, as they would be written.
fn figures(brief: &Brief) -> Vec<String> {
    let asked = format!("ratelab exercise {} ", brief.label());
    let mut lines = ANSWERS.lines().skip_while(|line| !line.contains(&asked));
    let measured = lines
        .nth(1)
        .and_then(|line| line.strip_prefix("Measured: "))
        .unwrap_or_else(|| panic!("no answer to {}", brief.label()));
    let (measured, _) = measured.split_once(". ").expect("a sentence");
    let measured = measured.trim_start_matches("between ").split(" and ");
    let of = brief.range.most;
    let figure = |number: &str| match number.parse::<u32>() {
        Ok(count) => format!("{count} of {of}"),
        Err(_) => number.to_owned(),
    };
    measured.map(figure).collect()
}

/// Whether `text` has `figure`, and not as a part of a longer number or word.
fn has(text: &str, figure: &str) -> bool {
    let is_part = |c: char| c.is_alphanumeric() || c == '.';
    text.match_indices(figure).any(|(at, _)| {
        let before = text[..at].chars().next_back();
        let after = text[at + figure.len()..].chars().next();
        !before.is_some_and(is_part) && !after.is_some_and(char::is_alphanumeric)
    })
}

/// The questions whose answers are in `text`, each with the figure.
fn given_away(text: &str) -> Vec<String> {
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let briefs = questions().map(|question| question.brief());
    let found = briefs.flat_map(|brief| {
        let label = brief.label();
        let incidental = INCIDENTAL.iter().filter(|(of, ..)| *of == label);
        let text = incidental.fold(text.clone(), |text, (_, part, _)| text.replace(part, ""));
        let figures = figures(brief)
            .into_iter()
            .filter(move |figure| has(&text, figure));
        figures.map(move |figure| format!("{label}: {figure}"))
    });
    found.collect()
}

/// The limits of the push age at 50 Hz, of which 6a to 6d and 7b follow.
fn limits() -> Vec<String> {
    let limits = CartPole::default().judge().age_limits(&Setup::default());
    let limits = [limits.may_fall, limits.falls].into_iter().flatten();
    limits.map(number).collect()
}

#[test]
fn no_answer_is_on_the_screen_before_the_first_prediction() {
    for run in [
        "",
        "control-hz 20",
        "control-hz 5",
        "control-hz 5; queue-depth 100",
    ] {
        let mut app = lab(&config(run), true);
        let shown = panes(&mut app);
        assert!(has(&shown, "limit ?"), "{run}");
        for limit in limits() {
            for text in [
                format!("of {limit}"),
                format!("{limit} ms"),
                format!("{limit}–"),
            ] {
                assert!(!shown.contains(&text), "{run}: {text:?}");
            }
        }
        assert!(!shown.contains('┊'), "{run}");
        let all = shown + &pages(&mut app);
        assert_eq!(given_away(&all), Vec::<String>::new(), "{run}");
    }
}

#[test]
fn what_may_stand_there_does_and_an_answer_would_be_found() {
    let mut app = lab(&config(""), false);
    let shown = panes(&mut app);
    let of = limits().join("–");
    assert!(
        shown.contains(&format!("of {of}")) && shown.contains('┊'),
        "{of}"
    );
    let mut broken = lab(&config("control-hz 5"), true);
    let pages = pages(&mut app) + &panes(&mut broken);
    let pages = pages.split_whitespace().collect::<Vec<_>>().join(" ");
    for (label, part, why) in INCIDENTAL {
        assert!(pages.contains(part), "{label}: {part:?} ({why})");
    }
    let all = figures(exercises::named("6a")[0].brief());
    assert_eq!(all, ["80 ms", "90 ms"]);
    assert_eq!(given_away("it falls at 90 ms."), ["6a: 90 ms"]);
    assert_eq!(
        given_away("290 ms, 90 mst and 8.80 ms"),
        Vec::<String>::new()
    );
}

#[test]
fn the_limits_are_shown_once_they_are_predicted_or_asked_for() {
    let mut app = lab(&config("control-hz 5"), true);
    then(&mut app, "", &["limit ?"]);
    then(
        &mut app,
        "a",
        &["limit ?", "exercises 6 and 7 ask for these limits"],
    );
    then(&mut app, "i\u{1b}a", &["limit ?", "a: show them"]);
    then(&mut app, "a", &["of 74–90"]);
    then(&mut app, "a", &["limit ?"]);
    then(&mut app, "e", &["limit ?", "the exercises"]);
    // The test's panel takes Enter as the last prediction.
    press(&mut app, "\n\u{1b}");
    then(&mut app, "", &["of 74–90"]);
}

#[test]
fn what_the_screen_knows_of_a_fault_is_covered_until_the_exercise_is_answered() {
    let exercise = exercises::find(10).expect("an exercise");
    for seed in 0..12 {
        let scene = exercise.scene(seed).expect("settings").expect("a scene");
        let mut app = running();
        app.follow_panel(PanelAction::Watch(Box::new(scene)));
        press(&mut app, "0+++++");
        end(&mut app);
        until(&mut app, |app| !frame(app).awaits_limits);
        let shown = panes(&mut app);
        shows(
            &shown,
            &["the cause is covered", "the parts of the age are covered"],
        );
        // The same moment without the cover.
        let (known, _) = app.shown.frame();
        let crashed = known
            .nodes
            .iter()
            .any(|node| node.health == Health::Crashed);
        let push = known.push.expect("a push").sentence;
        let (_, parts) = push.whole().split_once(": ").expect("parts");
        let parts = parts.split(" + ").map(str::to_owned);
        let words = parts
            .chain(known.verdict.why)
            .chain(crashed.then(|| "crash".to_owned()));
        for words in words {
            assert!(!shown.contains(&words), "{seed}: {words:?}");
        }
        assert!(left(app).covered, "the summary names it, too");
    }
}
