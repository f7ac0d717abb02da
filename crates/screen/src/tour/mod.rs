//! The guided tour: steps over a running session. A step waits for a state of the run,
//! however it comes about, and then says what to look at.

use crossterm::event::{KeyCode, KeyEvent};
use ratelab::ClockKind;
use ratelab_experiment::Config;

use crate::{
    frame::{FrameData, Standing},
    panes::Page,
};

/// The offer at the first start.
pub const OFFER: &str = "new here? g: a tour of five minutes";

/// The start of the lab.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Guide {
    /// The lab alone.
    Nobody,
    /// The lab, with an offer of the tour.
    Offer,
    /// The tour from its beginning.
    Tour,
}

/// A position in the tour: the number of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tour(usize);

impl Tour {
    /// Shows `key` to the `tour`; returns whether it was for the tour alone. Enter always goes
    /// on, Esc ends the tour; all others go to the lab.
    pub fn take(tour: &mut Option<Self>, key: &KeyEvent) -> bool {
        let Some(Self(step)) = *tour else {
            return false;
        };
        *tour = match key.code {
            KeyCode::Enter => Some(Self(step + 1)).filter(|next| next.0 < STEPS.len()),
            KeyCode::Esc => None,
            _ => return false,
        };
        true
    }

    /// Returns the step on the screen, about the `run` as it is.
    pub fn page(self, run: &Seen) -> Page {
        let step = &STEPS[self.0];
        let is_last = self.0 + 1 == STEPS.len();
        let (text, hint) = if !(step.reached)(run) {
            ((step.ask)(run), "Enter skips this  Esc leaves")
        } else if is_last {
            ((step.look)(run), "Enter ends the tour  Esc leaves")
        } else {
            ((step.look)(run), "Enter goes on  Esc leaves")
        };
        let title = format!("tour {} of {}: {}", self.0 + 1, STEPS.len(), step.title);
        Page {
            aside: true,
            ..Page::text(title, text, hint)
        }
    }
}

/// The rate that the tour slows the policy down to, and back to, in Hz.
const SLOW: f64 = 20.0;

/// The rate at which the pole falls, in Hz.
const BROKEN: f64 = 5.0;

/// Run time without a fall that counts as staying up, in seconds.
const STANDS_S: f64 = 2.0;

/// What the tour reads from the run.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// The policy's rate in this run, in Hz.
    pub hz: f64,
    /// The policy's rate in the next run, in Hz.
    pub next_hz: f64,
    /// Whether all nodes have one rate, in Hz.
    pub common_hz: Option<f64>,
    /// Whether a message of a topic was dropped.
    pub dropped: bool,
    /// Whether the pole has fallen.
    pub fell: bool,
    /// Whether the run is over.
    pub over: bool,
    /// Whether the screen gives a reason.
    pub explained: bool,
    /// Whether the run is identical to the one before.
    pub same: bool,
    /// Whether the graph is under the wall's clock.
    pub real: bool,
    /// Run time in seconds.
    pub now_s: f64,
}

impl Seen {
    /// Reads `frame`; the next run is one of `wanted`.
    pub fn from_frame(frame: &FrameData, wanted: &Config, over: bool) -> Self {
        let policy = frame.nodes.iter().find(|node| &*node.name == "policy");
        let hz = policy.map_or(0.0, |node| node.hz.get());
        let common = frame
            .nodes
            .first()
            .map(|node| node.hz)
            .filter(|hz| frame.nodes.iter().all(|node| node.hz == *hz));
        Self {
            hz,
            next_hz: wanted.setup.rate("policy").map_or(hz, |hz| hz.get()),
            common_hz: common.map(|hz| hz.get()),
            dropped: frame.topics.iter().any(|topic| topic.dropped > 0),
            fell: frame.verdict.standing == Standing::Lost,
            over,
            explained: !frame.verdict.why.is_empty(),
            same: frame.same == Some(true),
            real: frame.status.clock == ClockKind::Real,
            now_s: frame.now.as_secs_f64(),
        }
    }
}

/// A step: a state of the run, and what to look at then.
pub struct Step {
    /// What it is about.
    pub title: &'static str,
    /// Whether the run is in the state that the step waits for.
    pub reached: fn(&Seen) -> bool,
    /// The text before: what is missing, and the key for it.
    pub ask: fn(&Seen) -> String,
    /// The text in that state.
    pub look: fn(&Seen) -> String,
}

/// All steps, in their order. A text has room for six lines of 45 characters.
pub const STEPS: [Step; 7] = [
    Step {
        title: "a graph, no loop",
        reached: |_| true,
        ask: |_| String::new(),
        look: graph,
    },
    Step {
        title: "a slower policy",
        reached: |run| run.hz <= SLOW && !run.over,
        ask: slow_down,
        look: slowed,
    },
    Step {
        title: "too slow",
        reached: |run| run.fell,
        ask: break_it,
        look: broken,
    },
    Step {
        title: "the same again",
        reached: |run| run.fell && run.same,
        ask: repeat,
        look: |_| {
            "The pole fell at the same millisecond, and the screen says: identical, bit for bit. So \
             one thing can be changed: look back with , press B and type control-hz 50. The run \
             is the same up to there, and then goes on at 50 Hz."
                .to_owned()
        },
    },
    Step {
        title: "the rate, or the buffer?",
        reached: |run| run.hz >= SLOW && !run.fell && run.now_s >= STANDS_S,
        ask: mend,
        look: |run| {
            format!(
                "At {} Hz it stays up so far. From which rate down does it fall? Does a deeper queue \
                 (>) help? The first two exercises ask for your prediction first.",
                run.hz
            )
        },
    },
    Step {
        title: "a real clock",
        reached: |run| run.real && !run.over,
        ask: |run| {
            if run.over {
                "c gives a running graph to the wall clock, and this run is over: r starts again, \
                     then c."
                    .to_owned()
            } else {
                "This run is in virtual time. c gives the running graph to the wall clock: \
                      there every node is a thread."
                    .to_owned()
            }
        },
        look: |_| {
            "The operating system decides which thread runs first: drops and latency change all the \
             time, and no two runs are the same."
                .to_owned()
        },
    },
    Step {
        title: "on your own",
        reached: |_| true,
        ask: |_| String::new(),
        look: |_| {
            "? shows all keys, i explains the pane in focus, e opens the exercises: predict, \
             then see. q quits the lab. g opens this tour again once it is closed."
                .to_owned()
        },
    },
];

fn graph(run: &Seen) -> String {
    let rates = match run.common_hz {
        Some(hz) => format!("Three nodes tick {hz} times a second"),
        None => "Three nodes tick at rates of their own".to_owned(),
    };
    let drops = if run.dropped {
        "The graph counts what is dropped."
    } else {
        "Nothing is dropped so far."
    };
    format!(
        "{rates}. The sensor sends readings on the topic /obs, the policy answers with actions on \
         /action, the actuator pushes the cart. Push age, in line 2: how old the reading behind a \
         push is. {drops}"
    )
}

fn slow_down(run: &Seen) -> String {
    if run.over {
        return starts_again(run);
    }
    format!(
        "The policy decides {} times a second: press [ until it is {SLOW}. The sensor sends as many \
         readings as before. What happens to the readings that the policy has no time for?",
        run.hz
    )
}

fn slowed(run: &Seen) -> String {
    let drops = if run.dropped {
        "The graph counts what /obs drops: readings that the policy never sees. Each push now \
             uses an older reading: the push age above."
    } else {
        "The graph will count what /obs drops; nothing so far."
    };
    format!(
        "The policy decides {} times a second. {drops} The pole is up so far.",
        run.hz
    )
}

fn break_it(run: &Seen) -> String {
    if run.over {
        return format!("The run ended without a fall. {}", starts_again(run));
    }
    if run.next_hz > BROKEN {
        return format!(
            "Press b: from {} to {BROKEN} decisions a second at once. ([ does it step by step.) \
             Each decision is then held for 200 ms, whatever the pole does.",
            run.next_hz
        );
    }
    format!(
        "The policy decides {} times a second, whatever the pole does. Wait for the fall: a few \
         seconds.",
        run.hz
    )
}

fn broken(run: &Seen) -> String {
    let why = if run.explained {
        " The lines above say why."
    } else {
        ""
    };
    format!("The pole has fallen.{why}")
}

fn repeat(run: &Seen) -> String {
    match (run.over, run.real) {
        (true, true) => {
            "On the wall clock no two runs are the same: r starts again, then c changes \
                         to virtual time."
                .to_owned()
        }
        (false, true) => {
            "On the wall clock no two runs are the same: c changes to virtual time.".to_owned()
        }
        (true, false) => "r starts again: the same start, the same knobs. Press it, wait for the \
                          fall, and press it once more. When does the pole fall?"
            .to_owned(),
        (false, false) if run.hz > BROKEN => format!(
            "The policy decides {} times a second: b or [ breaks it. Then r, and r again after \
             the fall: when does the pole fall?",
            run.hz
        ),
        (false, false) => "Wait for the fall, then r once more, until two whole runs can be \
                           compared. When does the pole fall?"
            .to_owned(),
    }
}

fn mend(run: &Seen) -> String {
    if run.next_hz < SLOW {
        return format!(
            "The policy is set to {} Hz: b undoes the break, ] goes up step by step, to {SLOW}. Then \
             r starts again. And the pole?",
            run.next_hz
        );
    }
    if run.over {
        return starts_again(run);
    }
    format!(
        "The policy decides {} times a second. And the pole? Watch it for {STANDS_S} seconds.",
        run.hz
    )
}

/// Returns what r does after the end of a run.
fn starts_again(run: &Seen) -> String {
    format!(
        "This run is over: r starts again, with the policy at {} Hz.",
        run.next_hz
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::{render_page, testing::*};
    use crossterm::event::KeyModifiers;

    fn key(code: KeyCode) -> KeyEvent {
        KeyEvent::new(code, KeyModifiers::NONE)
    }

    #[test]
    fn enter_goes_on_through_every_step_and_other_keys_are_for_the_lab() {
        let after = |mut tour, code| (Tour::take(&mut tour, &key(code)), tour);
        for number in 0..STEPS.len() {
            let tour = Some(Tour(number));
            let next = Some(Tour(number + 1)).filter(|_| number + 1 < STEPS.len());
            assert_eq!(after(tour, KeyCode::Char('b')), (false, tour));
            assert_eq!(after(tour, KeyCode::Esc), (true, None));
            assert_eq!(after(tour, KeyCode::Enter), (true, next));
        }
        assert_eq!(after(None, KeyCode::Enter), (false, None));
    }

    /// The place for a step on a screen of 80x24.
    const PLACE: (u16, u16) = (50, 10);

    /// Runs in all combinations of what the steps distinguish.
    fn runs() -> impl Iterator<Item = Seen> {
        (0..256).map(|bits: u32| {
            let is = |bit: u32| bits & 1 << bit != 0;
            Seen {
                hz: if is(0) { 12.5 } else { 50.0 },
                next_hz: if is(1) { 5.0 } else { 50.0 },
                common_hz: is(2).then_some(50.0),
                dropped: is(2),
                fell: is(3),
                over: is(3) || is(4),
                explained: is(5),
                same: is(6),
                real: is(7),
                now_s: 3.0,
            }
        })
    }

    #[test]
    fn every_text_fits_on_a_screen_of_80_by_24() {
        for (number, run) in (0..STEPS.len()).flat_map(|n| runs().map(move |run| (n, run))) {
            let page = Tour(number).page(&run);
            let drawn = drawn(PLACE, &RICH, |sheet| render_page(&page, sheet));
            let last = page.text.split_whitespace().next_back().expect("a word");
            assert!(drawn.contains(last), "{last:?} is cut off:\n{drawn}");
            assert!(drawn.contains("Esc leaves"), "{drawn}");
        }
    }
}
