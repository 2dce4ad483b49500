//! Which pieces of a mesh or a cloud are specks.

use super::components::sizes;

/// Pieces of fewer triangles (of a cloud, points) than this share of the largest one may be specks; below the smaller share
/// they always are.
const SHARES: [f64; 2] = [0.0005, 0.002];
/// Pieces in between are specks up to this many triangles: stray pixels come in small groups, however fine the scan is,
/// and pieces of an ear seen from the front do not.
const GROUP: f64 = 40.0;

/// For each piece whether it is a speck; `pieces` has the number of each triangle's, or of each point's.
pub fn specks(pieces: &[u32]) -> Vec<bool> {
    let sizes = sizes(pieces);
    let most = limit(sizes.iter().max().copied().unwrap_or(0));
    sizes.into_iter().map(|size| size <= most).collect()
}

/// Pieces of at most so many triangles are specks beside one of `largest`.
fn limit(largest: usize) -> usize {
    let [always, maybe] = SHARES.map(|share| largest as f64 * share);
    GROUP.clamp(always, maybe) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarse_scans_lose_small_groups_and_fine_ones_keep_pieces_of_ears() {
        assert_eq!([0, 1000, 8000, 50_000, 100_000].map(limit), [0, 2, 16, 40, 50]);
    }

    #[test]
    fn a_small_piece_beside_a_large_one_is_a_speck() {
        let pieces = [vec![0; 3], vec![1; 2000], vec![2; 5]].concat();
        assert_eq!(specks(&pieces), [true, false, false]);
        assert_eq!(specks(&[0, 0, 1]), [false, false]);
        assert!(specks(&[]).is_empty());
    }
}
