//! Takes specks and noise out of a scan before it is used.

use super::noise::{self, Noise};
use crate::mesh::Mesh;
use crate::surface::{keep, pieces, specks};

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

/// The scan without small pieces and triangles without area, its points moved by others within `widest`.
pub fn clean(scan: &Mesh, widest: f64) -> Cleaned {
    let all = pieces(scan);
    let specks = specks(&all);
    let counts = |i: usize| scan.is_cloud() || scan.has_area(i);
    let large = |i: usize| !specks[all[i] as usize];
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
