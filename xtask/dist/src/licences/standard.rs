//! Standard texts for crates that name a licence without including it.

use spdx::{Expression, LicenseItem, ParseMode};

/// Returns the texts of all licences in `expression`, including alternatives; `None` if one of them
/// is unknown.
#[must_use]
pub fn standard(expression: &str) -> Option<Vec<&'static str>> {
    let parsed = Expression::parse_mode(expression, ParseMode::LAX).ok()?;
    let mut texts = Vec::new();
    for requirement in parsed.requirements() {
        let LicenseItem::Spdx { id, .. } = &requirement.req.license else {
            return None;
        };
        texts.push(id.text());
        if let Some(addition) = &requirement.req.addition {
            texts.push(addition.id()?.text());
        }
    }
    Some(texts)
}
