//! Texts that are specs of links, costs and other knobs, or close to some.

use proptest::prelude::*;

/// Parts of specs, right and wrong; `#` is a number, `~` noise.
const PARTS: &str = "delay:#|delay:#..#|delay:lognormal:#,#|in-order|loss:#|loss:0.#|burst:0.#,#|\
    burst:#,#|reliable:#|none|~|~:#~";
const NUMBERS: &str = "0|1|3|12|40|99|250.5|0.25|1e3|1e400|-1|-0|NaN|inf||+7";
const NOISE: &str = "| |,|:|..|delay|loss:|é";

/// One of the parts of `list`, which `|` separates.
fn choose(list: &'static str, by: u8) -> &'static str {
    let parts: Vec<_> = list.split('|').collect();
    parts[usize::from(by) % parts.len()]
}

/// Something close to the spec of a link, or one.
pub fn almost_link() -> impl Strategy<Value = String> {
    let part = any::<[u8; 4]>().prop_map(|[part, first, second, noise]| {
        let part = choose(PARTS, part)
            .replacen('#', choose(NUMBERS, first), 1)
            .replacen('#', choose(NUMBERS, second), 1);
        part.replace('~', choose(NOISE, noise))
    });
    proptest::collection::vec(part, 1..4).prop_map(|parts| parts.join(","))
}

/// First words of knobs of every kind with targets, and other words.
pub const HEADS: &str = "rate policy|depth /obs|send actuator|send policy|takes policy|takes policy busy|\
    set policy horizon|offset sensor|wakes actuator|late policy|link /action|read /obs|lose /action|postpone /obs #|\
    crash policy|restart sensor|hang actuator|clock sensor #|stamp_clock sensor #|on-stale|control-hz|\
    queue-depth|~ /obs";

/// Values that some knob takes.
const VALUES: &str = "#|#..#|lognormal:#,#|recorded:a.rrd|file:a.csv|drawn:a.csv|none|newest|oldest|hold|zero:#|zero:#..#|lqr||\
    ~|# #";

/// Something close to a knob of the cart-pole, or one.
pub fn almost_knob() -> impl Strategy<Value = String> {
    let other = any::<[u8; 5]>().prop_map(|[head, value, first, second, noise]| {
        let text = format!("{} {}", choose(HEADS, head), choose(VALUES, value))
            .replacen('#', choose(NUMBERS, first), 1)
            .replacen('#', choose(NUMBERS, second), 2);
        text.replace('~', choose(NOISE, noise))
    });
    let link = (any::<bool>(), almost_link())
        .prop_map(|(obs, spec)| format!("link {} {spec}", ["/action", "/obs"][usize::from(obs)]));
    prop_oneof![2 => other, 1 => link]
}
