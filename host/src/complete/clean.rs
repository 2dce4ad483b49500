//! Takes specks out of a scan before it is used.

use crate::mesh::Mesh;
use crate::surface::{components, keep_triangles};

/// Pieces smaller than this share of the largest one are specks: on a scan of a face, a square of four millimetres. Pieces
/// of an ear seen from the front are not much larger.
const SPECK: f64 = 0.0005;

/// The scan without specks and zero-area triangles, and how many triangles were dropped.
pub fn clean(scan: &Mesh) -> (Mesh, usize) {
    if scan.triangles.is_empty() {
        return (scan.clone(), 0);
    }
    let pieces = components(scan);
    let mut sizes = vec![0usize; pieces.iter().max().map_or(0, |&p| p as usize + 1)];
    pieces.iter().for_each(|&piece| sizes[piece as usize] += 1);
    let least = (sizes.iter().max().copied().unwrap_or(0) as f64 * SPECK) as usize;
    let area = |t: usize| {
        let [a, b, c] = scan.corners(t);
        (b - a).cross(&(c - a)).norm()
    };
    let kept = keep_triangles(scan, |t| sizes[pieces[t] as usize] > least && area(t) > 0.0);
    let dropped = scan.triangles.len() - kept.triangles.len();
    (kept, dropped)
}
