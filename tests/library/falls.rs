//! The push ages at which policies lose the pole: what was measured and is on the page, and what
//! theory adds.

use crate::{clone::root, support::*};

/// The limits of a run whose policy is pinned, as in a graph.
fn limits(list: &str) -> AgeLimits {
    let resolved = config(list).resolved(&*cart_pole());
    cart_pole().age_limits(&resolved.expect("a config").setup)
}

/// A policy of the folder `policies/`.
fn learned(name: &str) -> String {
    let path = root().join(format!("policies/{name}.safetensors"));
    format!("policy {}", path.display())
}

/// From which mean push age on the scripted policy may fall, and from which on it does (ms).
fn band() -> [f64; 2] {
    let AgeLimits {
        may_fall, falls, ..
    } = limits("");
    [may_fall, falls].map(|age| age.expect("measured").as_secs_f64() * 1e3)
}

#[test]
fn a_band_is_that_of_the_page_and_others_have_none() {
    let page = include_str!("../../docs/age.md");
    for (setup, name) in [
        (String::new(), "scripted"),
        ("control-hz 7".to_owned(), "scripted"),
        ("policy lqr".to_owned(), "lqr"),
        (learned("prompt"), "prompt"),
        (learned("patient"), "patient"),
    ] {
        let AgeLimits {
            may_fall, falls, ..
        } = limits(&setup);
        let [from, to] = [may_fall, falls].map(|age| age.expect(&setup).as_millis());
        assert!(from <= to, "{setup}");
        let row = format!("| {name} | {from} to {to} |");
        assert!(page.contains(&row), "{setup}: {row}");
    }
    // Measured at 50 Hz.
    assert_eq!(limits("policy lqr; control-hz 25").falls, None);
    for policy in ["zero", "random"] {
        assert_eq!(limits(&format!("policy {policy}")), AgeLimits::default());
    }
    // A file is known by its content.
    for unpinned in [learned("patient"), "policy none.pt".to_owned()] {
        let limits = cart_pole().age_limits(&config(&unpinned).setup);
        assert_eq!(limits, AgeLimits::default(), "{unpinned}");
    }
}

#[test]
fn theory_has_a_limit_for_linear_feedback() {
    let grows = limits("").grows.expect("a linear feedback");
    assert!((ms(55)..ms(65)).contains(&grows), "{grows:?}");
    assert!(limits("policy lqr").grows.is_some());
}

/// With knobs, the range of the mean push age (ms), and whether it stands.
#[test]
fn in_the_band_a_constant_age_stands_and_one_that_jitters_may_fall() {
    let [from, to] = band();
    for (link, ages, stands) in [
        ("delay:80", to..=to + 0.1, true),
        ("delay:40..100", from..=to, false),
        ("delay:84", to + 0.1..=to + 20.1, false),
    ] {
        let summary = run(&own(0, &format!("link /action {link}")));
        let age = summary.push_age().expect("pushes").late_s * 1e3;
        assert!(ages.contains(&age), "{link}: {age}");
        assert_eq!(!summary.verdict.is_lost(), stands, "{link}");
    }
}
