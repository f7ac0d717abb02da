//! Ticks that overlap, and the newest plan as a strip of its actions.

use ratatui::{
    style::{Modifier, Style},
    text::Span,
};

use super::{
    sheet::Sheet,
    text::{clip, signed},
};
use crate::{frame::PlanData, plan::OverlapView};

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

/// Number of rows.
pub const HEIGHT: usize = 3;

/// Columns before the strip and after it.
const SIDES: [usize; 2] = [7, 14];

/// Actions from the least to the greatest: the greatest in full is the last sign.
const LEVELS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
const ASCII_LEVELS: [char; 8] = ['0', '1', '2', '3', '4', '5', '6', '7'];

/// Most doublings of the scale.
const DOUBLINGS: i32 = 4;

/// Marks of the moments at which the plan means what was played, at which it was taken, and
/// that is now.
const SAME: &str = "━";
const TAKEN: &str = "┴";
const NOW: &str = "▲";

/// Draws `plan`.
pub fn render_plan(plan: &PlanData, mut sheet: Sheet<'_>) {
    let theme = sheet.theme;
    let room = sheet.width().saturating_sub(SIDES[0] + SIDES[1]);
    let each = plan.actions.len().div_ceil(room.max(1)).max(1);
    let cells = plan.actions.len().div_ceil(each).min(room);
    for (row, name) in ["played", "plan"].into_iter().enumerate() {
        sheet.put(0, row, name, theme.faint());
    }
    let scale = scale(plan);
    for cell in 0..cells {
        let (x, first) = (SIDES[0] + cell, cell * each);
        let past = first <= plan.now;
        let (above, below) = if past {
            (theme.strong(), theme.faint())
        } else {
            (theme.faint(), theme.active())
        };
        let around = plan.around.get(first).copied().flatten();
        let glyph = |value: f64| level(value / scale, theme.ascii).to_string();
        sheet.put(x, 0, &around.map_or(" ".to_owned(), glyph), above);
        sheet.put(x, 1, &glyph(plan.actions[first]), below);
        if past && (first..first + each).all(|place| plan.is_as_played(place)) {
            sheet.put(x, 2, SAME, theme.good());
        }
    }
    let place = |at: usize| SIDES[0] + (at / each).min(cells.saturating_sub(1));
    sheet.put(place(plan.taken), 2, TAKEN, theme.strong());
    sheet.put(place(plan.now), 2, NOW, theme.active());
    let x = SIDES[0] + cells + 1;
    let scale = format!("{}={}", LEVELS[7], signed(scale, 0, 2));
    let (above, style) = match plan.stalls {
        0 => (scale, theme.faint()),
        1 => ("✖ 1 stall".to_owned(), theme.alarm_line()),
        stalls => (format!("✖ {stalls} stalls"), theme.alarm_line()),
    };
    sheet.put(x, 0, &above, style);
    sheet.put(x, 1, plan.kind, theme.faint());
    let (left, style) = if plan.left.is_zero() {
        ("✖ is over".to_owned(), theme.alarm_line())
    } else {
        (format!("{} ms left", plan.left.as_millis()), theme.strong())
    };
    sheet.put(x, 2, &left, style);
}

/// Returns the action that the last sign stands for: the greatest one, or so often half of it as
/// all actions allow.
fn scale(plan: &PlanData) -> f64 {
    let all = plan.actions.iter().chain(plan.around.iter().flatten());
    let needed = all.fold(0.0, |most: f64, action| most.max(action.abs()));
    let mut scales = (0..=DOUBLINGS).map(|times| plan.most / 2_f64.powi(times));
    scales.rfind(|scale| *scale >= needed).unwrap_or(plan.most)
}

/// Returns the sign for `share` of the greatest action, −1 to 1.
fn level(share: f64, ascii: bool) -> char {
    let levels = if ascii { ASCII_LEVELS } else { LEVELS };
    let place = (share + 1.0) / 2.0 * levels.len() as f64;
    levels[(place as usize).min(levels.len() - 1)]
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
