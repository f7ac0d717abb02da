//! The convex hull of points in a plane.

/// Returns the corners of the hull of `points`, counterclockwise.
pub(crate) fn hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let mut corners = chain(points.iter());
    corners.pop();
    let mut upper = chain(points.iter().rev());
    upper.pop();
    corners.append(&mut upper);
    corners
}

/// Returns the corners on one side, from the first point to the last.
fn chain<'p>(points: impl Iterator<Item = &'p [f64; 2]>) -> Vec<[f64; 2]> {
    let mut corners: Vec<[f64; 2]> = Vec::new();
    for point in points {
        while let [.., before, last] = corners[..] {
            let turns_left = (last[0] - before[0]) * (point[1] - before[1])
                > (last[1] - before[1]) * (point[0] - before[0]);
            if turns_left {
                break;
            }
            corners.pop();
        }
        corners.push(*point);
    }
    corners
}
