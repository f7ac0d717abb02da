//! The order of names that people expect: s2 before s10.

use std::cmp::Ordering;

/// Compares numbers in names by their size, and everything else by letter.
pub fn order(one: &str, other: &str) -> Ordering {
    let (mut left, mut right) = (one, other);
    while !left.is_empty() && !right.is_empty() {
        let [a, b] = [digits(left), digits(right)];
        let order = if a.is_empty() || b.is_empty() {
            let (a, b) = (left.chars().next(), right.chars().next());
            left = &left[a.map_or(0, char::len_utf8)..];
            right = &right[b.map_or(0, char::len_utf8)..];
            a.cmp(&b)
        } else {
            (left, right) = (&left[a.len()..], &right[b.len()..]);
            let [a, b] = [a, b].map(|digits| digits.trim_start_matches('0'));
            a.len().cmp(&b.len()).then_with(|| a.cmp(b))
        };
        if order != Ordering::Equal {
            return order;
        }
    }
    // Names that differ in leading zeros only are never equal.
    left.len().cmp(&right.len()).then_with(|| one.cmp(other))
}

/// Returns the digits at the start.
fn digits(text: &str) -> &str {
    let end = text.find(|c: char| !c.is_ascii_digit());
    &text[..end.unwrap_or(text.len())]
}

#[cfg(test)]
mod tests {
    #[test]
    fn names_with_numbers_are_in_the_order_of_the_numbers() {
        let sorted = "1 02 2 10 10b anna s s1 s01x s2 s9-2 s9-10 s10 \
                      s99999999999999999999999 s100000000000000000000000 é1 é10";
        let sorted: Vec<&str> = sorted.split(' ').collect();
        let mut names = sorted.clone();
        names.reverse();
        names.sort_by(|a, b| super::order(a, b));
        assert_eq!(names, sorted);
    }
}
