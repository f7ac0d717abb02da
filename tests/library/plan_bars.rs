//! Plans as bars over run time: what of each was played, in lanes that keep them apart.

use std::collections::BTreeMap;

use crate::support::*;

const PERIOD: Duration = Duration::from_millis(20);

/// Bars of plans of four actions that begin at these times (ms), played as in `steps`: run
/// time (ms), newest plan, and whether there was an action.
fn bars(begins: &[u64], steps: &[(u64, u64, bool)]) -> String {
    let mut bars = PlanBars::default();
    for (number, begins) in (0..).zip(begins) {
        let plan = ActionPlan {
            kind: "rollout",
            made: at_ms(*begins),
            expected: PERIOD,
            begins: at_ms(*begins),
            period: PERIOD,
            actions: [0.0; 4].into(),
        };
        bars.plan(number, &plan);
    }
    for (at, newest, plays) in steps {
        let step = PlayStep {
            newest: *newest,
            took: false,
            stalls: !plays,
            period: PERIOD,
            predicted: plays.then_some(Duration::ZERO),
        };
        bars.step(at_ms(*at), &step);
    }
    let part = |part: &BarPart| {
        let sign = if part.played { '=' } else { '-' };
        format!("{sign}{}", part.to.as_nanos() / 1_000_000)
    };
    let drawn = |(lane, bar): (usize, &PlanBar)| {
        let parts: String = bar.parts.iter().map(part).collect();
        let from = bar.parts[0].from.as_nanos() / 1_000_000;
        (bar.number, format!("{lane}:{from}{parts}"))
    };
    let lanes = bars.lanes();
    let lanes = lanes.iter().enumerate();
    let bars = lanes.flat_map(|(lane, bars)| bars.iter().map(move |bar| (lane, bar)));
    let by_number: BTreeMap<u64, String> = bars.map(drawn).collect();
    by_number.into_values().collect::<Vec<_>>().join(" ")
}

#[test]
fn a_bar_has_what_was_played_and_shares_its_lane_with_none_that_touches_it() {
    for (begins, steps, drawn) in [
        (&[0][..], &[][..], "0:0-80"),
        // Taken after a while, until the next one was taken.
        (
            &[0, 40],
            &[(20, 0, true), (40, 0, true), (60, 1, true), (80, 1, true)],
            "0:0-20=60-80 1:40-60=100-120",
        ),
        // A late tick is no gap, a stall is one.
        (
            &[0],
            &[(0, 0, true), (25, 0, true), (45, 0, false), (65, 0, true)],
            "0:0=45-65=85",
        ),
        // The next one is taken within the action, and what is free at last is a lane again.
        (
            &[0, 60, 80, 90],
            &[(0, 0, true), (10, 1, true), (80, 2, true)],
            "0:0=10-80 1:60-140 2:80=100-160 0:90-170",
        ),
        // Played for longer than meant: the lane is free after that.
        (
            &[0, 80],
            &[(40, 0, true), (60, 0, true), (80, 0, true), (100, 1, true)],
            "0:0-40=100 1:80-100=120-160",
        ),
    ] {
        assert_eq!(bars(begins, steps), drawn);
    }
}
