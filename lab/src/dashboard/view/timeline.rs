//! The timeline: a lane per node and topic, with the chain behind one push highlighted.

use ratatui::{
    buffer::Buffer,
    layout::Rect,
    style::{Modifier, Style},
    text::Span,
};
use ratelab::Time;

use super::pane::{self, border, broken, clip, plain, put, row, width};
use crate::{
    dashboard::timeline::{Mark, MarkKind, Timeline},
    theme::Theme,
};

/// The meaning of the glyphs in lanes.
pub(super) const LEGEND: [(MarkKind, &str); 8] = [
    (MarkKind::Tick, "tick"),
    (MarkKind::Late, "late"),
    (MarkKind::Waiting, "waiting for"),
    (MarkKind::Aside, "set aside for"),
    (MarkKind::Overrun, "overrun"),
    (MarkKind::Read, "read"),
    (MarkKind::Unread, "unread"),
    (MarkKind::Lost, "lost"),
];

/// Its keys.
const KEYS: [&str; 2] = ["( ) select", "v V zoom"];

/// Maximum number of rows of the sentence.
const SENTENCE_ROWS: usize = 2;

/// Draws `timeline`, or the reason for an empty one.
pub fn render(
    timeline: Option<&Timeline>,
    theme: &Theme,
    focused: bool,
    area: Rect,
    buf: &mut Buffer,
) {
    let about = timeline.map_or_else(String::new, |timeline| {
        let from = timeline.from.as_secs_f64();
        let to = timeline.to.as_secs_f64();
        let which = if timeline.newest {
            "newest push"
        } else {
            "selected push"
        };
        let more = match timeline.lanes.len() - fitting(timeline, area) {
            0 => String::new(),
            hidden => format!(", +{hidden} more"),
        };
        format!(" {which}, {from:.3} to {to:.3} s{more} ")
    });
    let about = Span::styled(about, theme.faint());
    let inner = border("6 timeline", about, theme, focused, area, buf);
    let room = usize::from(inner.width).saturating_sub(1);
    let Some(timeline) = timeline else {
        let text = "nothing was applied yet, or its chain is not known";
        put(
            &clip(text, room, theme),
            theme.faint(),
            1,
            row(inner, 0),
            buf,
        );
        return;
    };
    let names = timeline.lanes.iter().map(|lane| width(&lane.name));
    let margin = names.max().unwrap_or(0) + 2;
    let height = usize::from(inner.height);
    let lanes = fitting(timeline, area);
    for (number, lane) in timeline.lanes.iter().take(lanes).enumerate() {
        let place = row(inner, number);
        put(&clip(&lane.name, room, theme), Style::new(), 1, place, buf);
        let columns = LaneColumns {
            timeline,
            margin,
            count: usize::from(inner.width).saturating_sub(margin + 1),
            place,
        };
        // Highlighted marks are in front of the others.
        let mut marks: Vec<&Mark> = lane.marks.iter().collect();
        marks.sort_by_key(|mark| mark.bright);
        marks.iter().for_each(|mark| columns.draw(mark, theme, buf));
    }
    below(timeline, theme, pane::rows(inner, lanes, height), buf);
}

/// The number of lanes that fit into `area`, with its border and a row for the sentence.
fn fitting(timeline: &Timeline, area: Rect) -> usize {
    let rows = usize::from(area.height).saturating_sub(3);
    timeline.lanes.len().min(rows)
}

/// The sentence about the push, and as much of the legend of the glyphs as fits.
fn below(timeline: &Timeline, theme: &Theme, area: Rect, buf: &mut Buffer) {
    let room = usize::from(area.width).saturating_sub(1);
    let height = usize::from(area.height);
    let lines = |text: &str| broken(&plain(text, theme), room);
    // One row at least is for the legend.
    let most = height.saturating_sub(1).clamp(1, SENTENCE_ROWS);
    let sentence = timeline.sentence.fitting(|text| lines(text).len() <= most);
    let sentence = lines(sentence);
    // Those of executors only where there are some.
    let marks = || timeline.lanes.iter().flat_map(|lane| &lane.marks);
    let of_executors = |kind| matches!(kind, MarkKind::Waiting | MarkKind::Aside);
    let shown = |kind| !of_executors(kind) || marks().any(|mark| mark.kind == kind);
    let entries = LEGEND.into_iter().filter(|(kind, _)| shown(*kind));
    let entries = entries.map(|(kind, word)| format!("{} {word}", glyph(kind, theme)));
    let entries = entries.chain(KEYS.map(str::to_owned));
    let mut legend = vec![String::new()];
    for entry in entries {
        let line = legend.last_mut().filter(|line| !line.is_empty());
        match line.filter(|line| width(line) + 2 + width(&entry) <= room) {
            Some(line) => *line += &format!("  {entry}"),
            None => legend.push(entry),
        }
    }
    for (number, line) in sentence.iter().take(most).enumerate() {
        let text = clip(line, room, theme);
        put(&text, theme.strong(), 1, row(area, number), buf);
    }
    for (number, line) in legend.iter().skip(1).enumerate() {
        let place = row(area, sentence.len().min(most) + number);
        put(&clip(line, room, theme), theme.faint(), 1, place, buf);
    }
}

/// The columns of a lane.
struct LaneColumns<'a> {
    timeline: &'a Timeline,
    margin: usize,
    count: usize,
    place: Rect,
}

impl LaneColumns<'_> {
    fn draw(&self, mark: &Mark, theme: &Theme, buf: &mut Buffer) {
        if self.count == 0 {
            return;
        }
        let (first, last) = (self.column(mark.at), self.column(mark.until));
        let style = style(mark, theme);
        let travels = matches!(mark.kind, MarkKind::Read | MarkKind::Unread);
        for column in first..=last.max(first) {
            let on_the_way = travels && column < last;
            let glyph = match on_the_way {
                true => theme.glyph("─", "-"),
                false => glyph(mark.kind, theme),
            };
            put(glyph, style, self.margin + column, self.place, buf);
        }
        let name = mark.by.as_deref().map(|by| plain(by, theme));
        let room = (last + 1).saturating_sub(first);
        if let Some(name) = name.filter(|name| width(name) + 2 <= room) {
            put(&name, style, self.margin + first + 1, self.place, buf);
        }
    }

    /// The column of a run time, limited to the first and the last.
    fn column(&self, at: Time) -> usize {
        let Timeline { from, to, .. } = self.timeline;
        let span = to.since(*from).as_secs_f64().max(1e-9);
        let share = at.since(*from).as_secs_f64() / span;
        ((share * self.count as f64) as usize).min(self.count - 1)
    }
}

fn glyph(kind: MarkKind, theme: &Theme) -> &'static str {
    match kind {
        MarkKind::Tick => theme.glyph("█", "#"),
        MarkKind::Late => theme.glyph("▒", "~"),
        MarkKind::Waiting => theme.glyph("░", "="),
        MarkKind::Aside => theme.glyph("▁", "_"),
        MarkKind::Overrun => theme.glyph("×", "x"),
        MarkKind::Read => theme.glyph("•", "o"),
        MarkKind::Unread => theme.glyph("·", "."),
        MarkKind::Lost => theme.glyph("✖", "X"),
    }
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
    use crate::dashboard::{
        frame::PushSentence,
        timeline::Lane,
        view::pane::testing::{POOR, RICH, screen, styled, text, torture},
    };

    fn ms(ms: u64) -> Time {
        Time::from_nanos(ms * 1_000_000)
    }

    fn sample() -> Timeline {
        let lane = |name: &str, marks: &[(u64, u64, MarkKind, bool)]| Lane {
            name: name.to_owned(),
            marks: marks
                .iter()
                .map(|&(at, until, kind, bright)| Mark {
                    at: ms(at),
                    until: ms(until),
                    kind,
                    bright,
                    by: None,
                })
                .collect(),
        };
        use MarkKind::{Late, Lost, Overrun, Read, Tick, Unread};
        Timeline {
            from: ms(0),
            to: ms(200),
            lanes: vec![
                lane(
                    "sensor",
                    &[
                        (0, 0, Tick, true),
                        (50, 50, Tick, false),
                        (100, 100, Tick, false),
                    ],
                ),
                lane(
                    "/obs",
                    &[
                        (0, 20, Read, true),
                        (50, 50, Unread, false),
                        (100, 100, Lost, false),
                    ],
                ),
                lane(
                    "policy",
                    &[
                        (20, 30, Late, true),
                        (30, 110, Tick, true),
                        (110, 110, Overrun, false),
                    ],
                ),
            ],
            sentence: PushSentence(vec![
                "this push is 110 ms old: 30 waiting for the policy + 80 thinking".to_owned(),
            ]),
            newest: true,
        }
    }

    #[test]
    fn lanes_have_a_time_axis_in_common_and_the_chain_is_bright() {
        let drawn = |theme| {
            screen(80, 7, |area, buf| {
                render(Some(&sample()), theme, true, area, buf)
            })
        };
        insta::assert_snapshot!(text(&drawn(&RICH)));
        assert!(text(&drawn(&POOR)).is_ascii());
        let bright = styled(&drawn(&RICH), RICH.active());
        assert!(bright.contains('█') && !bright.contains('✖'), "{bright}");
    }

    #[test]
    fn lanes_without_room_are_counted() {
        for (height, more) in [(6, None), (5, Some("+1 more")), (4, Some("+2 more"))] {
            let drawn = screen(80, height, |area, buf| {
                render(Some(&sample()), &RICH, true, area, buf)
            });
            let title = text(&drawn);
            let title = title.lines().next().unwrap_or_default();
            assert_eq!(title.contains("more"), more.is_some(), "{title}");
            assert!(more.is_none_or(|more| title.contains(more)), "{title}");
        }
    }

    #[test]
    fn a_wait_for_the_executor_and_a_tick_set_aside_name_the_other_node() {
        let mut timeline = sample();
        let mark = |at: u64, until: u64, kind| Mark {
            at: ms(at),
            until: ms(until),
            kind,
            bright: false,
            by: Some("planner".to_owned()),
        };
        let marks = &mut timeline.lanes[2].marks;
        marks.push(mark(120, 160, MarkKind::Waiting));
        marks.push(mark(170, 173, MarkKind::Aside));
        let drawn = text(&screen(80, 7, |area, buf| {
            render(Some(&timeline), &RICH, false, area, buf);
        }));
        assert!(drawn.contains("░planner░"), "{drawn}");
        assert!(drawn.contains("░ waiting for  ▁ set aside for"), "{drawn}");
        let usual = text(&screen(80, 7, |area, buf| {
            render(Some(&sample()), &RICH, false, area, buf);
        }));
        assert!(!usual.contains("waiting for  "), "{usual}");
    }

    #[test]
    fn any_size_will_do() {
        torture(|theme, area, buf| render(Some(&sample()), theme, false, area, buf));
        torture(|theme, area, buf| render(None, theme, false, area, buf));
    }
}
