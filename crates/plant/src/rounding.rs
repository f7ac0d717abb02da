//! Numbers with so many digits that two programs agree in all of them.

/// Returns the double nearest to the multiple of 10^`exponent` that is nearest to `number`.
pub(crate) fn rounded(number: f64, exponent: i32) -> f64 {
    let unit = power_of_ten(exponent);
    let count = (number / unit).round_ties_even();
    let text = format!("{count:.0}e{exponent}");
    let nearest: f64 = text.parse().unwrap_or(number);
    nearest + 0.0 // Not below zero.
}

/// Returns the double nearest to 10^`exponent`.
fn power_of_ten(exponent: i32) -> f64 {
    format!("1e{exponent}").parse().unwrap_or(1.0)
}

/// Returns the exponent of the digit of `number` that is `digits` behind its first.
pub(crate) fn digit(number: f64, digits: i32) -> i32 {
    (number.log10().floor() as i32).saturating_sub(digits)
}
