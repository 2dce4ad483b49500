//! A triangle as points that stand for its parts.

use crate::mesh::{Point, Vector, twice_area_vector};

/// Parts along the longest side of a triangle, at most.
const MOST_PARTS: f64 = 1000.0;
/// A triangle that is more than so many times as long as it is high is a needle, if it is long.
const NEEDLE: f64 = 8.0;
/// A needle of more parts than this is cut into slices: equal triangles would be as many as the square of its length asks
/// for, whatever its area.
const LONG: f64 = 32.0;

/// Calls `add` with the centroids of parts of a triangle, none longer than `spacing`, and their normal and area.
pub fn sample(triangle: &[Point; 3], spacing: f64, add: &mut impl FnMut(Vector, Vector, f64)) {
    let [a, b, c] = *triangle;
    let cross = twice_area_vector(triangle);
    let Some(normal) = cross.try_normalize(0.0) else { return };
    let sides = [(a, b, c), (b, c, a), (c, a, b)].map(|side| ((side.1 - side.0).norm(), side));
    let longer = |x: &(f64, _), y: &(f64, _)| x.0.total_cmp(&y.0);
    let Some((longest, side)) = sides.into_iter().max_by(longer) else { return };
    let parts = |length: f64| (length / spacing).ceil().clamp(1.0, MOST_PARTS);
    let (double, height) = (cross.norm(), cross.norm() / longest);
    if longest > NEEDLE * height && longest > LONG * spacing {
        let add = &mut |at: Vector, area: f64| add(at, normal, area);
        sample_slices(side, [parts(longest), parts(height)], double / 2.0, add);
    } else {
        let n = parts(longest);
        let area = double / 2.0 / (n * n);
        sample_evenly(triangle, n, &mut |at: Vector| add(at, normal, area));
    }
}

/// Calls `add` with the centroids of equal parts of a triangle, `n` along each side.
fn sample_evenly([a, b, c]: &[Point; 3], n: f64, add: &mut impl FnMut(Vector)) {
    let (u, v) = (b - a, c - a);
    for i in 0..n as usize {
        for j in 0..n as usize - i {
            let at = |x: f64, y: f64| a.coords + u * ((i as f64 + x) / n) + v * ((j as f64 + y) / n);
            add(at(1.0 / 3.0, 1.0 / 3.0));
            if i + j + 1 < n as usize {
                add(at(2.0 / 3.0, 2.0 / 3.0));
            }
        }
    }
}

/// Calls `add` with the middles of parts of slices across the longest side of a triangle, and their areas: so many slices,
/// so many parts of each.
fn sample_slices(
    (from, to, tip): (Point, Point, Point),
    [slices, parts]: [f64; 2],
    area: f64,
    add: &mut impl FnMut(Vector, f64),
) {
    let along = to - from;
    let foot = (tip - from).dot(&along) / along.norm_squared();
    let rise = tip - from - along * foot;
    // The middle of a slice, and its height there as a share of the triangle's.
    let slice = |i: usize| {
        let x = (i as f64 + 0.5) / slices;
        (x, if x < foot { x / foot } else { (1.0 - x) / (1.0 - foot) })
    };
    let heights: f64 = (0..slices as usize).map(|i| slice(i).1).sum();
    for (x, height) in (0..slices as usize).map(slice) {
        for j in 0..parts as usize {
            let at = along * x + rise * (height * (j as f64 + 0.5) / parts);
            add(from.coords + at, area * height / (heights * parts));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_needle_gives_as_many_samples_as_it_is_long_and_high_and_all_of_its_area() {
        for (height, most) in [(0.0, 0), (1e-9, 400), (0.1, 400), (1.0, 400), (3.5, 1600)] {
            let needle = [[0., 0.], [390., height], [400., 0.]].map(|[x, y]| Point::new(x, y, 0.5));
            let (mut samples, mut area, mut moment) = (0, 0.0, Vector::zeros());
            sample(&needle, 1.0, &mut |at, normal, part| {
                assert!((normal + Vector::z()).norm() < 1e-12);
                samples += 1;
                area += part;
                moment += at * part;
            });
            assert!(samples <= most && samples >= most * 9 / 10, "{samples}");
            assert!((area - 200.0 * height).abs() <= 1e-9 * area, "{area}");
            let centroid = Vector::new(790.0 / 3.0, height / 3.0, 0.5);
            assert!(samples == 0 || (moment / area - centroid).norm() < 0.2 * (1.0 + height), "{moment}");
        }
    }
}
