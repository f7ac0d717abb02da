//! The timeline: a lane per node and topic, with the chain behind one push highlighted.

use ratatui::{
    style::{Modifier, Style},
    text::Span,
};
use ratelab::Time;

use super::{
    sheet::Sheet,
    text::{broken, width},
};
use crate::{
    theme::Theme,
    timeline::{Mark, MarkKind, Timeline},
};

/// Title of the pane.
const TITLE: &str = "6 timeline";

/// The glyphs in lanes, and what they mean.
pub(super) const LEGEND: [(MarkKind, &str, &str); 10] = [
    (MarkKind::Tick, "█", "tick"),
    (MarkKind::Late, "▒", "late"),
    (MarkKind::Waiting, "░", "waiting for"),
    (MarkKind::Aside, "▁", "set aside for"),
    (MarkKind::Overrun, "◆", "overrun"),
    (MarkKind::Read, "•", "read"),
    (MarkKind::Unread, "·", "unread"),
    (MarkKind::Lost, "◌", "lost"),
    (MarkKind::Played, "▓", "played"),
    (MarkKind::Planned, "╌", "planned"),
];

/// Its keys.
const KEYS: [&str; 2] = ["( ) push", "v V span"];

/// Maximum number of rows of the sentence.
const SENTENCE_ROWS: usize = 2;

/// Draws `timeline`, or the reason for an empty one.
pub fn render(timeline: Option<&Timeline>, sheet: Sheet<'_>) {
    let theme = sheet.theme;
    let Some(timeline) = timeline else {
        let mut pane = sheet.boxed(TITLE, Span::default());
        let text = "nothing was applied yet, or its chain is not known";
        pane.put(1, 0, text, theme.faint());
        return;
    };
    // A row below the lanes is for the sentence.
    let rows = sheet.height().saturating_sub(3);
    let shown = timeline.lanes.len().min(rows);
    let about = Span::styled(about(timeline, shown), theme.faint());
    let mut pane = sheet.boxed(TITLE, about);
    let margin = timeline
        .lanes
        .iter()
        .map(|lane| width(&lane.name))
        .max()
        .unwrap_or(0)
        + 2;
    let room = pane.width().saturating_sub(margin + 1);
    for (row, lane) in timeline.lanes[..shown].iter().enumerate() {
        pane.put(1, row, &lane.name, Style::new());
        // Highlighted marks are in front of the others.
        let mut marks: Vec<&Mark> = lane.marks.iter().collect();
        marks.sort_by_key(|mark| mark.bright);
        let mut axis = pane.cells(margin, row, room);
        marks
            .iter()
            .for_each(|mark| draw(mark, timeline, &mut axis));
    }
    below(timeline, pane.rows(shown, usize::MAX));
}

/// Returns the selected push, the visible run time, and the number of lanes that are not shown.
fn about(timeline: &Timeline, shown: usize) -> String {
    let [from, to] = [timeline.from, timeline.to].map(Time::as_secs_f64);
    let which = if timeline.newest {
        "newest"
    } else {
        "selected"
    };
    let more = match timeline.lanes.len() - shown {
        0 => String::new(),
        hidden => format!(", +{hidden} more"),
    };
    format!(" {which} push, {from:.3} to {to:.3} s{more} ")
}

/// The sentence about the push, and as much of the legend of the glyphs as fits.
fn below(timeline: &Timeline, mut sheet: Sheet<'_>) {
    let (theme, room) = (sheet.theme, sheet.width().saturating_sub(1));
    // One row at least is for the legend.
    let most = sheet.height().saturating_sub(1).clamp(1, SENTENCE_ROWS);
    let lines = |text: &str| broken(text, room, theme);
    let sentence = timeline.sentence.fitting(|text| lines(text).len() <= most);
    let sentence = lines(sentence)
        .into_iter()
        .take(most)
        .map(|line| (line, theme.strong()));
    let legend = legend(timeline, room)
        .into_iter()
        .map(|line| (line, theme.faint()));
    for (row, (line, style)) in sentence.chain(legend).enumerate() {
        sheet.put(1, row, &line, style);
    }
}

/// Returns the glyphs and the keys in lines of `room` columns.
fn legend(timeline: &Timeline, room: usize) -> Vec<String> {
    // Marks of executors and plans only where there are some.
    let marks = || timeline.lanes.iter().flat_map(|lane| &lane.marks);
    let usual = |kind| {
        use MarkKind::{Aside, Planned, Played, Waiting};
        !matches!(kind, Waiting | Aside | Played | Planned)
    };
    let shown = |kind| usual(kind) || marks().any(|mark| mark.kind == kind);
    let entries = LEGEND
        .into_iter()
        .filter(|(kind, ..)| shown(*kind))
        .map(|(_, glyph, word)| format!("{glyph} {word}"));
    let mut lines: Vec<String> = Vec::new();
    for entry in entries.chain(KEYS.map(str::to_owned)) {
        let fits = |line: &&mut String| width(line) + 2 + width(&entry) <= room;
        match lines.last_mut().filter(fits) {
            Some(line) => *line += &format!("  {entry}"),
            None => lines.push(entry),
        }
    }
    lines
}

/// Draws `mark` on its lane.
fn draw(mark: &Mark, timeline: &Timeline, axis: &mut Sheet<'_>) {
    let Some(end) = axis.width().checked_sub(1) else {
        return;
    };
    let span = timeline.to.since(timeline.from).as_secs_f64().max(1e-9);
    let column = |at: Time| {
        let share = at.since(timeline.from).as_secs_f64() / span;
        ((share * (end + 1) as f64) as usize).min(end)
    };
    let first = column(mark.at);
    let last = column(mark.until).max(first);
    let style = style(mark, axis.theme);
    let glyph = glyph(mark.kind);
    let before = match mark.kind {
        MarkKind::Read | MarkKind::Unread => "─",
        _ => glyph,
    };
    axis.put(first, 0, &before.repeat(last - first), style);
    axis.put(last, 0, glyph, style);
    let name = mark.by.as_deref().unwrap_or_default();
    if width(name) + 2 <= last + 1 - first {
        axis.put(first + 1, 0, name, style);
    }
}

fn glyph(kind: MarkKind) -> &'static str {
    let entry = LEGEND.iter().find(|(known, ..)| *known == kind);
    entry.map_or("", |(_, glyph, _)| glyph)
}

fn style(mark: &Mark, theme: &Theme) -> Style {
    match (mark.bright, mark.kind) {
        (true, _) => theme.active(),
        (false, MarkKind::Lost | MarkKind::Overrun) => {
            theme.alarm_line().remove_modifier(Modifier::BOLD)
        }
        (false, _) => theme.faint(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{age::PushSentence, timeline::Lane, view::testing::*};

    fn mark(at: u64, until: u64, kind: MarkKind, bright: bool) -> Mark {
        Mark {
            at: sample::ms(at),
            until: sample::ms(until),
            kind,
            bright,
            by: None,
        }
    }

    fn sample() -> Timeline {
        let lane = |name: &str, marks: [Mark; 3]| Lane {
            name: name.to_owned(),
            marks: marks.into(),
        };
        use MarkKind::{Late, Lost, Overrun, Read, Tick, Unread};
        let sensor = [0, 50, 100].map(|at| mark(at, at, Tick, at == 0));
        let obs = [
            mark(0, 20, Read, true),
            mark(50, 50, Unread, false),
            mark(100, 100, Lost, false),
        ];
        let policy = [
            mark(20, 30, Late, true),
            mark(30, 110, Tick, true),
            mark(110, 110, Overrun, false),
        ];
        Timeline {
            from: sample::ms(0),
            to: sample::ms(200),
            lanes: vec![
                lane("sensor", sensor),
                lane("/obs", obs),
                lane("policy", policy),
            ],
            sentence: PushSentence(vec![
                "this push is 110 ms old: 30 waiting for the policy + 80 thinking".to_owned(),
            ]),
            newest: true,
        }
    }

    #[test]
    fn lanes_have_a_time_axis_in_common_and_the_chain_is_bright() {
        let shown = |theme| drawn((80, 7), theme, |sheet| render(Some(&sample()), sheet));
        insta::assert_snapshot!(shown(&RICH));
        assert!(shown(&POOR).is_ascii());
        let buf = screen((80, 7), &RICH, |sheet| render(Some(&sample()), sheet));
        let bright = styled(&buf, RICH.active());
        assert!(bright.contains('█') && !bright.contains('✖'), "{bright}");
    }

    #[test]
    fn lanes_without_room_are_counted() {
        for (height, more) in [(6, None), (5, Some("+1 more")), (4, Some("+2 more"))] {
            let shown = drawn((80, height), &RICH, |sheet| render(Some(&sample()), sheet));
            let title = shown.lines().next().unwrap_or_default();
            assert_eq!(title.contains("more"), more.is_some(), "{title}");
            assert!(more.is_none_or(|more| title.contains(more)), "{title}");
        }
    }

    #[test]
    fn a_wait_for_the_executor_and_a_tick_set_aside_name_the_other_node() {
        let mut timeline = sample();
        let waits = [(120, 160, MarkKind::Waiting), (170, 173, MarkKind::Aside)];
        timeline.lanes[2]
            .marks
            .extend(waits.map(|(at, until, kind)| Mark {
                by: Some("planner".to_owned()),
                ..mark(at, until, kind, false)
            }));
        let shown = drawn((80, 7), &RICH, |sheet| render(Some(&timeline), sheet));
        shows(&shown, &["░planner░", "░ waiting for  ▁ set aside for"]);
        let usual = drawn((80, 7), &RICH, |sheet| render(Some(&sample()), sheet));
        assert!(!usual.contains("waiting for  "), "{usual}");
    }

    #[test]
    fn any_size_will_do() {
        torture(|sheet| render(Some(&sample()), sheet));
        torture(|sheet| render(None, sheet));
    }
}
