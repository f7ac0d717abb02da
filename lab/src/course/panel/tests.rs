//! Keys and what the panel makes of them.

use crossterm::event::KeyModifiers;

use super::*;

fn press(panel: &mut ExercisePanel, code: KeyCode) -> PanelAction {
    panel.key(&KeyEvent::new(code, KeyModifiers::NONE))
}

fn answer(panel: &mut ExercisePanel, text: &str) -> PanelAction {
    panel.paste(text);
    press(panel, KeyCode::Enter)
}

/// Returns the marked line of the list.
fn marked(panel: &ExercisePanel) -> String {
    let text = panel.page().text;
    let mut lines = text.lines();
    let line = lines.find_map(|line| line.strip_prefix("▶ "));
    line.expect("a mark").to_owned()
}

/// Returns a panel without answers, and the folder of its file.
fn new_panel() -> (ExercisePanel, tempfile::TempDir) {
    let folder = tempfile::tempdir().expect("folder");
    let file = folder.path().join("answers.toml");
    (ExercisePanel::new(file, 0), folder)
}

fn until_measured(panel: &mut ExercisePanel) {
    while !panel.poll() {
        std::thread::yield_now();
    }
}

#[test]
fn the_list_begins_at_the_first_open_question_and_goes_on_to_the_next() {
    let (mut first, folder) = new_panel();
    assert!(marked(&first).starts_with("1 "));
    press(&mut first, KeyCode::Enter);
    let reply = answer(&mut first, "30 because fewer decisions come too late");
    assert_eq!(reply, PanelAction::Stay);
    until_measured(&mut first);
    let text = first.page().text;
    assert!(text.starts_with("You predicted 30 Hz"), "{text}");
    press(&mut first, KeyCode::Enter);
    assert!(marked(&first).starts_with("2 "));
    let again = ExercisePanel::new(folder.path().join("answers.toml"), 0);
    assert!(marked(&again).starts_with("2 "));
}

#[test]
fn the_question_stays_at_the_top_after_an_answer_that_is_none() {
    let (mut panel, _folder) = new_panel();
    let first = (1..=13).filter_map(exercises::find);
    for exercise in first.filter(|exercise| !exercise.draws()) {
        (panel.page, panel.at) = (PanelPage::List, index(exercise));
        press(&mut panel, KeyCode::Enter);
        press(&mut panel, KeyCode::Enter);
        let text = panel.page().text;
        let mut paragraphs = text.split("\n\n");
        let error = paragraphs.next().expect("an error");
        assert!(error.starts_with("no prediction yet"), "{text}");
        assert_eq!(paragraphs.next(), Some(&*exercise.brief().asked()));
    }
}

#[test]
fn page_keys_move_through_the_list() {
    let (mut panel, _folder) = new_panel();
    press(&mut panel, KeyCode::PageDown);
    assert!(marked(&panel).starts_with("7b "));
    press(&mut panel, KeyCode::PageDown);
    assert!(marked(&panel).starts_with("13c "));
    press(&mut panel, KeyCode::PageUp);
    press(&mut panel, KeyCode::PageUp);
    assert!(marked(&panel).starts_with("1 "));
}

#[test]
fn an_answer_uncovers_the_cause_of_the_run_that_was_shown_for_it() {
    let (mut panel, _folder) = new_panel();
    panel.at = index(exercises::find(10).expect("an exercise"));
    press(&mut panel, KeyCode::Enter);
    let shown = press(&mut panel, KeyCode::Enter);
    assert!(matches!(shown, PanelAction::Watch(_)), "{shown:?}");
    assert_eq!(answer(&mut panel, "sensor"), PanelAction::Stay);
    press(&mut panel, KeyCode::Esc);
    press(&mut panel, KeyCode::Enter);
    let reply = answer(&mut panel, "sensor slow because it looks so");
    assert_eq!(reply, PanelAction::Answered);
}

#[test]
fn the_limits_are_found_with_the_last_of_their_predictions() {
    let (_, folder) = new_panel();
    let file = folder.path().join("answers.toml");
    // As if the others had been predicted in a shell.
    let predicted = Answers::change(&file, |answers| {
        for label in ["6a", "6b", "6c", "6d", "7a"] {
            let prediction = Prediction::new(1.0, "of it").expect("finite");
            answers.set(exercises::named(label)[0].brief(), prediction);
        }
    });
    predicted.expect("saved");
    let mut panel = ExercisePanel::new(file, 0);
    panel.at = index(exercises::named("7b")[0]);
    press(&mut panel, KeyCode::Enter);
    assert!(!panel.has_found_limits());
    answer(&mut panel, "4 because of it");
    assert!(panel.has_found_limits());
}
