//! Ticks that overlap, operation by operation.

use ratatui::{
    style::{Modifier, Style},
    text::Span,
};

use super::{sheet::Sheet, text::clip};
use crate::overlap::OverlapView;

/// The least width of a column; narrower ones are lines with the name of the node.
const COLUMN: usize = 20;

/// Draws the operations of `overlap` around the last one that is done.
pub fn render(overlap: &OverlapView, sheet: Sheet<'_>) {
    let (theme, done, all) = (sheet.theme, overlap.done, overlap.operations.len());
    let about = format!(" ticks that overlap, operation {done} of {all} ");
    let mut pane = sheet.boxed("6 timeline", Span::styled(about, theme.faint()));
    let column = pane.width().saturating_sub(3) / overlap.lanes.len().max(1);
    let columns = column >= COLUMN;
    let place = |lane: usize| 3 + if columns { lane * column } else { 0 };
    for (lane, name) in overlap.lanes.iter().enumerate().filter(|_| columns) {
        let name = clip(name, column - 1, theme);
        pane.put(place(lane), 0, &name, theme.strong());
    }
    let head = usize::from(columns);
    let rows = pane.height().saturating_sub(head);
    let first = done
        .saturating_sub(rows.div_ceil(2))
        .min(all.saturating_sub(rows));
    let shown = overlap.operations.iter().enumerate().skip(first).take(rows);
    for (number, (lane, what)) in shown {
        let row = head + number - first;
        let style = match number + 1 {
            next if next == done => {
                let style = theme.active().add_modifier(Modifier::BOLD);
                pane.put(1, row, "▶", style);
                style
            }
            next if next < done => Style::new(),
            _ => theme.faint(),
        };
        let what = if columns {
            clip(what, column - 1, theme)
        } else {
            format!("{} {what}", overlap.lanes[*lane])
        };
        pane.put(place(*lane), row, &what, style);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::*;
    use ratelab::Time;

    fn sample(lanes: &[&str]) -> OverlapView {
        OverlapView {
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
        let drawn = drawn((60, 9), &RICH, |sheet| render(&overlap, sheet));
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
        let drawn = drawn((60, 9), &POOR, |sheet| render(&overlap, sheet));
        assert!(drawn.contains("> node 6 /obs, turn 6"), "{drawn}");
    }

    #[test]
    fn any_size_draws() {
        let overlap = sample(&["sensor", "policy"]);
        torture(|sheet| render(&overlap, sheet));
    }
}
