//! The newest plan as a strip of its actions.

use super::{sheet::Sheet, text::signed};
use crate::frame::PlanData;

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
pub fn render(plan: &PlanData, mut sheet: Sheet<'_>) {
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
    let needed = plan
        .actions
        .iter()
        .chain(plan.around.iter().flatten())
        .fold(0.0, |most: f64, action| most.max(action.abs()));
    (0..=DOUBLINGS)
        .map(|times| plan.most / 2_f64.powi(times))
        .rfind(|scale| *scale >= needed)
        .unwrap_or(plan.most)
}

/// Returns the sign for `share` of the greatest action, −1 to 1.
fn level(share: f64, ascii: bool) -> char {
    let levels = if ascii { ASCII_LEVELS } else { LEVELS };
    let place = (share + 1.0) / 2.0 * levels.len() as f64;
    levels[(place as usize).min(levels.len() - 1)]
}
