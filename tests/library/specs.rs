//! Whatever is written as a knob is refused in one line, or means what it prints.

use std::sync::Arc;

use proptest::prelude::*;
use ratelab::{Knob, Time};
use ratelab_cart_pole::CartPole;
use ratelab_study::{
    experiment::{Config, Experiment},
    system::WorldKind,
};

use crate::support::specs::almost_knob;

/// So many cases, or as many as `RATELAB_CASES` asks for.
fn cases(usual: u32) -> ProptestConfig {
    let asked = std::env::var("RATELAB_CASES").ok();
    ProptestConfig::with_cases(asked.and_then(|n| n.parse().ok()).unwrap_or(usual))
}

/// The knobs in `text`, held to what is promised of any text.
fn knobs(text: &str) -> Result<Vec<Knob>, TestCaseError> {
    let knobs = match CartPole::KNOBS.parse(text) {
        Ok(knobs) => knobs,
        Err(error) => {
            let error = error.to_string();
            prop_assert_eq!(error.lines().count(), 1, "{}", error);
            prop_assert!(error.contains("expected"), "{}", error);
            return Ok(Vec::new());
        }
    };
    for knob in &knobs {
        let printed = knob.to_string();
        let parsed = printed.parse::<Knob>();
        prop_assert_eq!(parsed.as_ref(), Ok(knob), "{}", printed);
        let json = serde_json::to_string(knob).expect("JSON");
        let read: Knob = serde_json::from_str(&json).expect("a knob");
        prop_assert_eq!(&read, knob, "{}", json);
    }
    Ok(knobs)
}

proptest! {
    #![proptest_config(cases(100_000))]
    #[test]
    fn any_knob_is_refused_in_one_line_or_means_what_is_read_back(text in almost_knob()) {
        knobs(&text)?;
    }
}

proptest! {
    #![proptest_config(cases(300))]
    #[test]
    fn any_knobs_run_or_are_refused_in_one_line(
        texts in proptest::collection::vec((almost_knob(), 0..200_u64), 1..6),
        own: bool,
    ) {
        let mut config = Config {
            end: Time::from_nanos(300_000_000),
            world: if own { WorldKind::OWN } else { WorldKind::Course },
            ..Config::default()
        };
        for (text, ms) in texts {
            let at = Time::from_nanos(ms * 1_000_000);
            let knobs = knobs(&text)?.into_iter();
            match ms % 2 {
                0 => config.setup.extend(knobs),
                _ => config.knobs.extend(knobs.map(|knob| ratelab::TimedKnob { at, knob })),
            }
        }
        match Experiment::new(Arc::new(CartPole::default()), &config) {
            Ok(experiment) => drop(experiment.run().expect("no node fails")),
            Err(error) => prop_assert_eq!(error.to_string().lines().count(), 1),
        }
    }
}
