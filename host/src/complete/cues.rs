//! What is known at each vertex of a completed mesh about how far it may be off.

use super::merge::{MEASURED, Merged};
use crate::mesh::{Mesh, Point};
use crate::register::Placed;
use crate::surface::path_lengths;
use crate::uncertainty::Cue;
use crate::uncertainty::factors::Factors;
use crate::uncertainty::posterior::Posterior;

/// Rings over which a vertex beyond the stored voxels takes the deviations of its neighbours.
const RINGS: usize = 60;

/// The cues of a completed mesh; `hidden` is what its scan is off at a place without showing it, voxels. Vertices count as measured up
/// to `sideways` of the scan, in its unit: those behind them are so much farther from it.
pub fn cues(
    posterior: &Posterior<'_>,
    placed: &Placed,
    merged: &Merged,
    hidden: &dyn Fn(&Point) -> f32,
    sideways: f32,
) -> Vec<Cue> {
    let places: Vec<[f32; 3]> = merged.mesh.points.iter().map(|p| placed.to_voxels(p)).collect();
    let deviations = filled(&merged.mesh, posterior.at_all(&places));
    let measured = |&v: &u32| merged.labels[v as usize] == MEASURED;
    let sources: Vec<u32> = (0..merged.labels.len() as u32).filter(measured).collect();
    let ways = path_lengths(&merged.mesh, &sources);
    let factors = Factors::of(posterior.model());
    let scale = placed.pose.scale;
    let cue = |v: usize| {
        let (way, straight) = (ways[v] as f32, merged.distances[v]);
        Cue {
            measured: merged.labels[v] == MEASURED,
            posterior: deviations[v],
            away: scale * away(way, straight, sideways),
            height: scale * merged.heights[v],
            hidden: hidden(&merged.mesh.points[v]),
            factor: factors.at(places[v]),
        }
    };
    (0..places.len()).map(cue).collect()
}

/// How far a vertex is from what was measured: along the surface, or straight to the scan where no way leads to it.
fn away(way: f32, straight: f32, sideways: f32) -> f32 {
    if way.is_finite() { straight.max(way + sideways) } else { straight }
}

/// Beyond the stored voxels the mean of the neighbours', ring by ring; the largest of all where there are none.
fn filled(mesh: &Mesh, mut found: Vec<Option<f32>>) -> Vec<f32> {
    for _ in 0..RINGS {
        let mut sums = vec![(0.0f32, 0.0f32); found.len()];
        for &[a, b, c] in &mesh.triangles {
            // Each corner's next one first: in the order of `corner_pairs` the sums, and with them expected errors, would be
            // rounded otherwise.
            for (to, from) in [(a, b), (a, c), (b, c), (b, a), (c, a), (c, b)] {
                if let (None, Some(deviation)) = (found[to as usize], found[from as usize]) {
                    let (sum, count) = &mut sums[to as usize];
                    (*sum, *count) = (*sum + deviation, *count + 1.0);
                }
            }
        }
        if sums.iter().all(|&(_, count)| count == 0.0) {
            break;
        }
        for (found, (sum, count)) in found.iter_mut().zip(sums) {
            *found = found.or_else(|| (count > 0.0).then(|| sum / count));
        }
    }
    let worst = found.iter().flatten().copied().fold(0.0, f32::max);
    found.into_iter().map(|deviation| deviation.unwrap_or(worst)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::shapes::sheet;

    #[test]
    fn behind_a_cloud_whose_border_is_stretched_it_is_as_far_as_behind_a_mesh() {
        assert_eq!([away(0.5, 1.9, 1.5), away(2.0, 1.9, 0.0)], [2.0; 2]);
        assert_eq!(away(4.0, 5.0, 0.0), 5.0, "round a corner");
        assert_eq!(away(f32::INFINITY, 7.0, 1.5), 7.0, "a piece by itself");
    }

    #[test]
    fn what_is_unknown_is_taken_from_the_neighbours() {
        let mesh = sheet(8);
        let known = |v: usize| match v % 8 {
            0 => Some(1.0),
            7 => Some(3.0),
            _ => None,
        };
        let found = filled(&mesh, (0..64).map(known).collect());
        let row = &found[32..40];
        assert_eq!((row[0], row[7]), (1.0, 3.0));
        assert!(row.is_sorted() && row[1] == 1.0 && row[6] == 3.0, "{row:?}");
        let mut far = mesh.clone();
        far.points.push(far.points[0]);
        assert_eq!(filled(&far, (0..64).map(known).chain([None]).collect())[64], 3.0);
        assert_eq!(filled(&mesh, vec![None; 64]), vec![0.0; 64]);
    }
}
