//! Takes specks and noise out of a scan before it is used.

use super::noise::{self, Noise};
use crate::mesh::Mesh;
use crate::surface::{keep, pieces};

/// Pieces of fewer triangles (of a cloud, points) than this share of the largest one may be specks; below the smaller share
/// they always are.
const SPECK: [f64; 2] = [0.0005, 0.002];
/// Pieces in between are specks up to this many triangles: stray pixels come in small groups, however fine the scan is,
/// and pieces of an ear seen from the front do not.
const GROUP: f64 = 40.0;

/// Pieces of at most so many triangles are specks beside one of `largest`.
fn limit(largest: usize) -> usize {
    let [always, maybe] = SPECK.map(|share| largest as f64 * share);
    GROUP.clamp(always, maybe) as usize
}

/// A scan without specks.
pub struct Cleaned {
    /// What is left.
    pub scan: Mesh,
    /// Its noise, where that was taken out.
    pub noise: Option<Noise>,
    /// The small pieces that were taken out.
    pub small: Mesh,
    /// The piece of each triangle (of a cloud, point) of those.
    pub pieces: Vec<u32>,
}

/// The scan without small pieces and zero-area triangles, its points moved by others within `widest`.
pub fn clean(scan: &Mesh, widest: f64) -> Cleaned {
    let all = pieces(scan);
    let mut sizes = vec![0usize; all.iter().max().map_or(0, |&p| p as usize + 1)];
    all.iter().for_each(|&piece| sizes[piece as usize] += 1);
    let least = limit(sizes.iter().max().copied().unwrap_or(0));
    let counts = |i: usize| scan.is_cloud() || scan.area_of(i) > 0.0;
    let large = |i: usize| sizes[all[i] as usize] > least;
    let taken = |i: usize| !large(i) && counts(i);
    let mut cleaned = keep(scan, |i| large(i) && counts(i));
    let noise = noise::reduce(&mut cleaned, widest);
    Cleaned {
        scan: cleaned,
        noise,
        small: keep(scan, taken),
        pieces: (0..all.len()).filter(|&i| taken(i)).map(|i| all[i]).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarse_scans_lose_small_groups_and_fine_ones_keep_pieces_of_ears() {
        assert_eq!([0, 1000, 8000, 50_000, 100_000].map(limit), [0, 2, 16, 40, 50]);
    }
}
