//! Ticks that overlap: a column for each node, and a row for each operation.

use ratatui::{
    buffer::Buffer,
    layout::Rect,
    style::{Modifier, Style},
    text::Span,
};

use super::pane::{border, clip, put, row};
use crate::{dashboard::overlap::Overlap, theme::Theme};

/// The least width of a column; narrower ones are lines with the name of the node.
const COLUMN: usize = 20;

/// Draws the operations of `overlap` around the last one that is done.
pub fn render(overlap: &Overlap, theme: &Theme, focused: bool, area: Rect, buf: &mut Buffer) {
    let (done, all) = (overlap.done, overlap.operations.len());
    let about = format!(" ticks that overlap, operation {done} of {all} ");
    let about = Span::styled(about, theme.faint());
    let inner = border("6 timeline", about, theme, focused, area, buf);
    let room = usize::from(inner.width).saturating_sub(3);
    let column = room / overlap.lanes.len().max(1);
    let columns = column >= COLUMN;
    if columns {
        for (lane, name) in overlap.lanes.iter().enumerate() {
            let name = clip(name, column - 1, theme);
            put(&name, theme.strong(), 3 + lane * column, row(inner, 0), buf);
        }
    }
    let head = usize::from(columns);
    let rows = usize::from(inner.height).saturating_sub(head);
    let first = done
        .saturating_sub(rows.div_ceil(2))
        .min(all.saturating_sub(rows));
    let shown = overlap.operations.iter().enumerate().skip(first).take(rows);
    for (number, (lane, what)) in shown {
        let place = row(inner, head + number - first);
        let last = number + 1 == done;
        let style = match number < done {
            _ if last => theme.active().add_modifier(Modifier::BOLD),
            true => Style::new(),
            false => theme.faint(),
        };
        if last {
            put(theme.glyph("▶", ">"), style, 1, place, buf);
        }
        match columns {
            true => {
                let what = clip(what, column - 1, theme);
                put(&what, style, 3 + lane * column, place, buf);
            }
            false => {
                let what = format!("{} {what}", overlap.lanes[*lane]);
                put(&clip(&what, room, theme), style, 3, place, buf);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dashboard::view::pane::testing::{POOR, RICH, screen, text, torture};
    use ratelab::Time;

    fn sample(lanes: &[&str]) -> Overlap {
        Overlap {
            from: Time::from_nanos(1_234_567_000),
            lanes: lanes.iter().map(|lane| (*lane).to_owned()).collect(),
            operations: (0..12)
                .map(|turn| (turn % lanes.len(), format!("/obs, turn {turn}")))
                .collect(),
            done: 7,
        }
    }

    #[test]
    fn the_last_operation_is_marked_in_the_column_of_its_node() {
        let overlap = sample(&["sensor", "policy"]);
        let drawn = text(&screen(60, 9, |area, buf| {
            render(&overlap, &RICH, true, area, buf);
        }));
        let lines: Vec<&str> = drawn.lines().collect();
        assert!(lines[0].contains("operation 7 of 12"), "{drawn}");
        assert!(lines[1].contains("sensor") && lines[1].contains("policy"));
        let marked = lines
            .iter()
            .position(|line| line.contains('▶'))
            .expect("a mark");
        assert!(lines[marked].contains("▶ /obs, turn 6"), "{drawn}");
        let column = |line: &str, of: &str| line.find(of).map(|at| line[..at].chars().count());
        let policy = column(lines[1], "policy");
        assert_eq!(column(lines[marked - 1], "/obs, turn 5"), policy, "{drawn}");
        assert_eq!(column(lines[marked + 1], "/obs, turn 7"), policy, "{drawn}");
    }

    #[test]
    fn many_nodes_are_named_in_each_line() {
        let many: Vec<String> = (0..9).map(|node| format!("node {node}")).collect();
        let many: Vec<&str> = many.iter().map(String::as_str).collect();
        let overlap = sample(&many);
        let drawn = text(&screen(60, 9, |area, buf| {
            render(&overlap, &POOR, false, area, buf);
        }));
        assert!(drawn.contains("> node 6 /obs, turn 6"), "{drawn}");
    }

    #[test]
    fn any_size_draws() {
        let overlap = sample(&["sensor", "policy"]);
        torture(|theme, area, buf| render(&overlap, theme, true, area, buf));
    }
}
