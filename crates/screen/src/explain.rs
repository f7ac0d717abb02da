//! The meaning of a pane, in three sentences with current figures.

use super::{
    age::{AgeData, Strain},
    frame::{FrameData, NodeData, TopicData},
    panes::Pane,
};
use crate::age::ms;

/// What an explanation must know besides the figures of a frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Explained<'a> {
    /// The name of the plotted signal.
    pub signal: Option<&'a str>,
    /// Whether that is the push age itself.
    pub signal_is_push_age: bool,
    /// Whether the plant can be seen from several sides.
    pub has_sides: bool,
    /// Whether there was an event so far.
    pub any_event: bool,
}

/// Returns a title and a text about `pane`, with the figures of `frame`.
pub fn explained(pane: Pane, about: Explained<'_>, frame: &FrameData) -> (&'static str, String) {
    let (title, sentences) = match pane {
        Pane::Graph => ("the graph", graph(frame)),
        Pane::Plant => ("the plant", plant(frame, about.has_sides)),
        Pane::Signal => ("over time", over_time(about, frame)),
        Pane::Figures => ("figures", figures(frame)),
        Pane::Events => ("events", events(frame, about.any_event)),
        Pane::Timeline => ("the timeline", timeline(frame)),
    };
    (title, sentences.join("\n\n"))
}

fn graph(frame: &FrameData) -> [String; 3] {
    let nodes = frame.nodes.iter().map(|node| {
        let what = node.caption.unwrap_or("ticks");
        format!("{} {what} {} times a second", node.name, hertz(node))
    });
    let is_read = |topic: &&TopicData| !topic.readers.is_empty();
    let topics = frame.topics.iter().filter(is_read).map(topic);
    let dropped = frame
        .topics
        .iter()
        .map(|topic| topic.dropped)
        .fold(0, u64::saturating_add);
    [
        format!(
            "Boxes are nodes, each {}: {}.{}",
            if frame.nodes.iter().any(|node| node.triggered) {
                "at a rate of its own or on messages"
            } else {
                "at a rate of its own"
            },
            list(nodes),
            wrong_stamps(frame)
        ),
        format!(
            "Lines are topics, and dots on them are messages: {}.",
            list(topics)
        ),
        format!(
            "A cross is a message that nobody read, as a newer one was there: {dropped} so far.{}",
            match frame.age {
                Some(age) => format!(
                    " Line 2 of the screen is the push age, how old the reading behind the push \
                     is: {} on average lately. Its bar has the parts of this age; i on pane 3 has \
                     them in words.",
                    ms(age.mean)
                ),
                None => String::new(),
            }
        ),
    ]
}

/// Returns a sentence about clocks that are wrong in the stamps, after the others.
fn wrong_stamps(frame: &FrameData) -> String {
    let nodes = frame.wrong_stamps.join(", ");
    if nodes.is_empty() {
        return nodes;
    }
    format!(" Wrong clocks stamp the messages of {nodes}: a match compares these stamps.")
}

fn hertz(node: &NodeData) -> f64 {
    (node.hz.get() * 10.0).round() / 10.0
}

fn topic(topic: &TopicData) -> String {
    let held = topic.held.map_or_else(
        || "nothing yet".to_owned(),
        |held| format!("the newest is {} old", ms(held)),
    );
    let (name, depth) = (&topic.name, topic.depth);
    format!("{name} keeps {depth}, {held}")
}

fn plant(frame: &FrameData, has_sides: bool) -> [String; 3] {
    let name = &frame.verdict.headline;
    let limits = if has_sides {
        "Below it is how much of its limit a joint has used: at 100 % the run is lost. The key s shows \
         the next side."
    } else {
        "Faint lines are the limits: beyond them the run is lost."
    };
    [
        "This is the plant as its newest step left it.".to_owned(),
        limits.to_owned(),
        format!("At {} it is: {name}.", frame.now),
    ]
}

/// Returns the age of the last second beside the limit of the loop.
fn lately(age: AgeData) -> String {
    let limit = match age.limit() {
        _ if age.hidden => {
            "The limit is for you to find in exercises 6 and 7; press a twice to see it".to_owned()
        }
        None => "The limit is unknown".to_owned(),
        Some(limit) => match (age.limits.falls, age.limits.may_fall) {
            (Some(_), Some(from)) => format!(
                "The robot survives {} if the age is steady, {} if it varies",
                ms(limit),
                ms(from)
            ),
            (Some(_), None) => format!("The robot survives {}", ms(limit)),
            (None, _) => format!(
                "From {} on small errors grow; where a run is lost is unknown",
                ms(limit)
            ),
        },
    };
    let verdict = match age.strain() {
        Strain::Unknown | Strain::Hidden | Strain::Borne => "",
        Strain::Swings => ". So it swings",
        Strain::MayFall => ". So it may fall",
        Strain::Falls => ". So it falls",
    };
    format!(
        " In the last second it was {} on average. {limit}{verdict}.",
        ms(age.mean)
    )
}

fn over_time(about: Explained<'_>, frame: &FrameData) -> [String; 3] {
    let signal = about.signal.unwrap_or("signal");
    let age = frame.age.map_or_else(String::new, lately);
    let parts = frame.push.as_ref().map_or_else(String::new, |push| {
        format!(" Now {}.", push.sentence.whole())
    });
    let plan = frame.plan.as_ref().map_or_else(String::new, |plan| {
        format!(
            " The rows below have the newest plan, a sign for each action, under what was played \
             and what the plan before meant. It is {}, and marked as long as both are the same.",
            plan.kind
        )
    });
    let again = match frame.same {
        Some(true) => "it is the same, bit for bit",
        Some(false) => "it differs",
        None => "r starts the next",
    };
    let [upper, lower] = if about.signal_is_push_age {
        ["The curve", "It"]
    } else {
        ["The upper curve", "The lower one"]
    };
    [
        format!("{upper} is the {signal} in the last ten seconds; dashed lines are limits."),
        format!(
            "{lower} is the age of the present push: it grows, and jumps down when \
             a push with a newer reading is applied.{age}{parts} The moments of the ticks matter, \
             too: a rate that is changed during a run may give another age than the same rate \
             from the start.{plan}"
        ),
        format!("Faint dashes are the run before this one: {again}."),
    ]
}

fn figures(frame: &FrameData) -> [String; 3] {
    let latency = frame.latency.as_ref().map_or_else(
        || "This system measures no latency.".to_owned(),
        |latency| {
            let (p50, p99) = (latency.figures.p50, latency.figures.p99);
            format!(
                "{}: half of all pushes used readings up to {} old, all but one in a hundred up \
                 to {}.",
                latency.name,
                ms(p50),
                ms(p99)
            )
        },
    );
    let overruns = frame
        .nodes
        .iter()
        .map(|node| node.overruns)
        .fold(0, u64::saturating_add);
    [
        "These are figures of the whole run, topic by topic and node by node.".to_owned(),
        latency,
        format!("An overrun is a period that a node skipped, as it was busy: {overruns} so far."),
    ]
}

fn events(frame: &FrameData, any: bool) -> [String; 3] {
    let why = match &frame.verdict.why[..] {
        [] => "There is nothing to explain.".to_owned(),
        why => format!("Why: {}.", why.join("; ")),
    };
    [
        format!("How it stands: {}.", frame.verdict.headline),
        why,
        if any {
            "Below are the knobs that were turned and other commands, each with its run time; the \
             newest is last."
        } else {
            "Knobs that are turned and other commands are listed here, each with its run time: \
             none so far."
        }
        .to_owned(),
    ]
}

fn timeline(frame: &FrameData) -> [String; 3] {
    let push = frame
        .push
        .as_ref()
        .map_or("there was no push so far", |push| push.sentence.whole());
    [
        "A lane for each node and each topic, in the order in which a reading becomes a push: \
         a block is a tick, and its length is its duration; grey in front of it is the time \
         by which it began late, or waited for its executor; dots are messages, where they are \
         published and where they arrive. Where one rate is a multiple of the other, a reading \
         is used as it comes; with other rates it waits, and a faster sensor may make pushes \
         older."
            .to_owned(),
        "Bright is the chain behind one push, back to the reading; ( and ) select another, v and \
         V show more or less."
            .to_owned(),
        format!("At {}: {push}.", frame.now),
    ]
}

fn list(parts: impl Iterator<Item = String>) -> String {
    parts.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::sample;

    #[test]
    fn every_pane_is_explained_in_three_paragraphs_with_figures() {
        let frame = sample::broken();
        let about = Explained {
            signal: Some("pole angle"),
            ..Explained::default()
        };
        for pane in Pane::ALL {
            let (_, text) = explained(pane, about, &frame);
            assert_eq!(text.split("\n\n").count(), 3, "{text}");
            let figures = text.chars().any(|letter| letter.is_ascii_digit());
            assert!(figures, "{text}");
        }
    }

    #[test]
    fn knobs_are_below_only_where_there_are_some() {
        let frame = sample::broken();
        for any_event in [true, false] {
            let about = Explained {
                any_event,
                ..Explained::default()
            };
            let (_, text) = explained(Pane::Events, about, &frame);
            assert_eq!(text.contains("Below are"), any_event, "{text}");
        }
    }

    #[test]
    fn clocks_that_are_wrong_in_the_stamps_are_named_with_their_errors() {
        let mut frame = sample::balanced();
        let text = |frame: &FrameData| explained(Pane::Graph, Explained::default(), frame).1;
        assert!(!text(&frame).contains("clock"), "{}", text(&frame));
        frame.wrong_stamps = vec!["camera (-175 0)".to_owned()];
        let told = "Wrong clocks stamp the messages of camera (-175 0): a match compares";
        assert!(text(&frame).contains(told), "{}", text(&frame));
    }

    #[test]
    fn nodes_are_explained_by_their_captions() {
        let mut frame = sample::balanced();
        frame.nodes[0].caption = Some("reads the plant");
        let (_, text) = explained(Pane::Graph, Explained::default(), &frame);
        for part in ["sensor reads the plant 50 times", "policy ticks 50 times"] {
            assert!(text.contains(part), "{text}");
        }
    }
}
