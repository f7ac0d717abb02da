//! The guided tour over a session.

use super::*;
use crate::dashboard::tour::Guide;

fn press(app: &mut App, code: KeyCode) {
    let key = KeyEvent::new(code, KeyModifiers::NONE);
    app.key(&key).expect("no fault");
}

#[test]
fn a_step_of_the_tour_leaves_graph_plant_and_verdict_in_sight() {
    let mut app = fallen();
    app.guide(Guide::Tour);
    press(&mut app, KeyCode::Enter);
    let [small, large] = [(80, 24), (160, 50)].map(|(w, h)| screen(&app, &PLAIN, w, h));
    for drawn in [&small, &large] {
        for part in ["tour 2 of 7", "Keys: [ [ [ [", "FELL at", "policy", "plant"] {
            assert!(drawn.contains(part), "{part:?} is missing in\n{drawn}");
        }
    }
    insta::assert_snapshot!("tour_80x24", small);
    insta::assert_snapshot!("tour_160x50", large);
}

#[test]
fn keys_of_the_tour_reach_the_lab_and_esc_leaves_the_tour() {
    let mut app = running();
    app.guide(Guide::Tour);
    press(&mut app, KeyCode::Enter);
    for _ in 0..4 {
        assert!(screen(&app, &PLAIN, 80, 24).contains("waits for the key"));
        press(&mut app, KeyCode::Char('['));
    }
    let rate = app.wanted().setup.rate("policy").expect("a rate");
    assert_eq!(rate.get(), 20.0);
    assert!(screen(&app, &PLAIN, 80, 24).contains("Enter goes on"));
    press(&mut app, KeyCode::Esc);
    assert!(!screen(&app, &PLAIN, 80, 24).contains("tour"));
    app.finish().ended.expect("no fault");
}

#[test]
fn the_tour_is_offered_in_a_notice_and_begun_by_a_key() {
    let mut app = running();
    app.guide(Guide::Offer);
    assert!(screen(&app, &PLAIN, 80, 24).contains("g: a tour of five minutes"));
    press(&mut app, KeyCode::Char('g'));
    assert!(screen(&app, &PLAIN, 80, 24).contains("tour 1 of 7"));
    app.finish().ended.expect("no fault");
}
