//! Unfolds triangles of a scan that noise has turned over.
//!
//! Noise goes along the camera's rays and is taken out along the surface's normal: what is left shifts points along the
//! surface, past their neighbours where these are near.

use crate::mesh::{Mesh, Point, Vector, twice_area_vector};

/// Rounds, at most: 50,000 of 190,000 triangles turned over by noise of twice their edges are 3,000 after four, and hardly
/// fewer after thirty.
const ROUNDS: usize = 8;

/// Draws the corners of triangles that face against the surface along it to the middle of their neighbours; `facing` are
/// the surface's unit normals at the points, and `first` the first of the points at each point's place.
pub fn unfold(scan: &mut Mesh, facing: &[Vector], first: &[usize]) {
    for _ in 0..ROUNDS {
        let turned = turned(scan, facing, first);
        if !turned.contains(&true) {
            return;
        }
        let middles = middles(scan, &turned, first);
        for (v, middle) in middles.into_iter().enumerate() {
            if let Some(middle) = middle {
                let motion = middle - scan.points[v];
                scan.points[v] += motion - facing[v] * motion.dot(&facing[v]);
            }
        }
        for (v, &first) in first.iter().enumerate() {
            scan.points[v] = scan.points[first];
        }
    }
}

/// Marks the places of the corners of triangles that face against the surface at two of them or more.
fn turned(scan: &Mesh, facing: &[Vector], first: &[usize]) -> Vec<bool> {
    let mut turned = vec![false; scan.points.len()];
    for (t, corners) in scan.triangles.iter().enumerate() {
        let normal = twice_area_vector(&scan.corners(t));
        let against = corners.iter().filter(|&&v| normal.dot(&facing[v as usize]) < 0.0).count();
        if against > 1 {
            corners.iter().for_each(|&v| turned[first[v as usize]] = true);
        }
    }
    turned
}

/// The middle of the neighbours of the marked places.
fn middles(scan: &Mesh, marked: &[bool], first: &[usize]) -> Vec<Option<Point>> {
    let mut sums = vec![(Vector::zeros(), 0.0); marked.len()];
    for corners in &scan.triangles {
        let [a, b, c] = corners.map(|v| first[v as usize]);
        // In the order of the corners: in that of `corner_pairs` the sums, and with them points, would be rounded otherwise.
        for (to, from) in [(a, b), (a, c), (b, a), (b, c), (c, a), (c, b)] {
            if marked[to] {
                let (sum, count) = &mut sums[to];
                (*sum, *count) = (*sum + scan.points[from].coords, *count + 1.0);
            }
        }
    }
    sums.into_iter().map(|(sum, count)| (count > 0.0).then(|| Point::from(sum / count))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::shapes::sheet;

    /// Each triangle with vertices of its own, and the first of the copies of each.
    fn with_copies(mesh: &Mesh) -> (Mesh, Vec<usize>) {
        let corners = mesh.triangles.as_flattened();
        let points = corners.iter().map(|&v| mesh.points[v as usize]).collect();
        let triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let first = |v: &u32| corners.iter().position(|of| of == v).expect("a corner");
        (Mesh { points, triangles, ..Mesh::default() }, corners.iter().map(first).collect())
    }

    #[test]
    fn a_point_beyond_its_neighbour_is_drawn_back_along_the_surface() {
        let flat = sheet(8);
        let facing = vec![Vector::z(); flat.points.len()];
        let first: Vec<usize> = (0..flat.points.len()).collect();
        let mut untouched = flat.clone();
        unfold(&mut untouched, &facing, &first);
        assert_eq!(untouched, flat);
        let mut folded = flat.clone();
        folded.points[27].x += 1.5;
        folded.points[27].z += 0.1;
        let area = folded.area();
        let loose = with_copies(&folded);
        unfold(&mut folded, &facing, &first);
        assert!(!turned(&folded, &facing, &first).contains(&true) && folded.area() < area);
        assert_eq!(folded.points[27].z, flat.points[27].z + 0.1, "its height is the scan's");
        assert_eq!(folded.points[0], flat.points[0]);
        let (mut loose, copies) = loose;
        unfold(&mut loose, &vec![Vector::z(); copies.len()], &copies);
        assert_eq!(loose, with_copies(&folded).0, "triangles that share no vertices stay together");
    }
}
