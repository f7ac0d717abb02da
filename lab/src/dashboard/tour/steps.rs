//! The steps of the tour, for the cart-pole of the course. None of them answers an
//! exercise.

/// A step: keys to press, and what to look at then.
pub struct Step {
    /// What it is about.
    pub title: &'static str,
    /// Its keys in their order; none for a step that only shows something.
    pub keys: &'static str,
    /// The text before the last key.
    pub ask: &'static str,
    /// The text after it.
    pub look: &'static str,
}

/// All steps, in their order. A text has room for six lines of 45 characters; the keys
/// take one of them.
pub const STEPS: [Step; 7] = [
    Step {
        title: "a graph, no loop",
        keys: "",
        ask: "",
        look: "Sensor, policy and actuator each tick 50 times a second and meet only in two \
               topics, /obs and /action. Nothing is dropped, and each push is based on a fresh \
               reading.",
    },
    Step {
        title: "a slower policy",
        keys: "[[[[",
        ask: "Slow the policy down to 20 decisions a second: press [ four times. The sensor \
              keeps its 50 readings. What will /obs do with the others?",
        look: "The graph counts what /obs drops: readings that the policy never sees. Actions \
               rest on older readings now: the age above. And the pole stays up: a drop alone \
               harms nobody.",
    },
    Step {
        title: "too slow",
        keys: "b",
        ask: "Now break it: b slows the policy down to 5 decisions a second. Each of them is \
              held for 200 ms, whatever the pole does.",
        look: "Wait for the fall, a few seconds at most. The lines above then name the cause: \
               how old the readings behind the last actions were.",
    },
    Step {
        title: "the same again",
        keys: "rr",
        ask: "r starts again: the same start, the same knobs. Press it, wait for the fall, and \
              press it once more. When does the pole fall?",
        look: "At the same millisecond, every time. After the fall the screen compares the two \
               runs: identical, bit for bit. Virtual time repeats everything, so two runs can \
               be compared.",
    },
    Step {
        title: "the rate, or the buffer?",
        keys: "br",
        ask: "b undoes the break, r starts again with 20 decisions a second: the drops go on, \
              and the pole?",
        look: "It stays up. At which rate does it turn? Would a deeper queue (>) have saved it? \
               The first two exercises ask for your prediction, so ask nobody yet.",
    },
    Step {
        title: "a real clock",
        keys: "c",
        ask: "So far time was virtual. c hands the running graph to the clock on the wall, \
              where every node is a thread.",
        look: "Threads jitter: drops and latency change all the time, and no run is ever the \
               same again. Same graph, other clock.",
    },
    Step {
        title: "on your own",
        keys: "",
        ask: "",
        look: "? shows all keys, i explains the pane in focus, e opens the exercises: predict, \
               then see. q leaves, and g starts this tour again.",
    },
];
