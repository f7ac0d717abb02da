//! Where the cliff is, in words.

use super::summary::RateSummary;
use crate::report::line;

/// What there is to say of the rows of one group.
pub fn lines(rows: &[RateSummary]) -> Vec<String> {
    let mut rows: Vec<&RateSummary> = rows.iter().filter(|row| row.runs > 0).collect();
    rows.sort_by_key(|row| row.cell.control_hz);
    if rows.len() < 2 {
        return Vec::new();
    }
    let mut lines = vec![line("cliff", &edges(&rows))];
    lines.extend(dip(&rows).map(|text| line("uneven", &text)));
    lines
}

/// Up to where nothing stands and from where on everything does.
fn edges(rows: &[&RateSummary]) -> String {
    let down = rows.iter().take_while(|row| row.balanced == 0);
    let up = rows.iter().rev();
    let up = up.take_while(|row| row.balanced == row.runs);
    match (down.last(), up.last()) {
        (Some(down), _) if down.cell == rows[rows.len() - 1].cell => {
            "none balanced at any of these rates".to_owned()
        }
        (_, Some(up)) if up.cell == rows[0].cell => {
            "all balanced at each of these rates".to_owned()
        }
        (Some(down), Some(up)) => format!(
            "none balanced up to {}, all from {} on",
            down.cell.control_hz, up.cell.control_hz
        ),
        (Some(down), None) => format!(
            "none balanced up to {}, not all at any higher rate to the end",
            down.cell.control_hz
        ),
        (None, Some(up)) => format!("all balanced from {} on", up.cell.control_hz),
        (None, None) => "some balanced at the lowest rate, not all at the highest".to_owned(),
    }
}

/// The rate at which most is lost by going *up* to the next one.
fn dip(rows: &[&RateSummary]) -> Option<String> {
    let drops = rows.windows(2).filter_map(|pair| {
        let drop = pair[0].share()? - pair[1].share()?;
        (drop > 0.0).then_some((drop, pair))
    });
    let (_, pair) = drops.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
    let [slow, fast] = [pair[0], pair[1]].map(|row| {
        format!(
            "{} of {} at {}",
            row.balanced, row.runs, row.cell.control_hz
        )
    });
    Some(format!("{slow}, then {fast}: faster, yet worse"))
}
