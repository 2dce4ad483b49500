//! Unfolds triangles of a scan that noise has turned over.
//!
//! Noise goes along the camera's rays and is taken out along the surface's normal: what is left shifts points along the
//! surface, past their neighbours where these are near.

use crate::mesh::{Mesh, Point, Vector};

/// Rounds, at most: 50,000 of 190,000 triangles turned over by noise of twice their edges are 3,000 after four, and hardly
/// fewer after thirty.
const ROUNDS: usize = 8;

/// Draws the corners of triangles that face against the surface along it to the middle of their neighbours; `facing` are
/// the surface's unit normals at the points.
pub fn unfold(scan: &mut Mesh, facing: &[Vector]) {
    for _ in 0..ROUNDS {
        let turned = turned(scan, facing);
        if !turned.contains(&true) {
            return;
        }
        let middles = middles(scan, &turned);
        for (v, middle) in middles.into_iter().enumerate() {
            if let Some(middle) = middle {
                let motion = middle - scan.points[v];
                scan.points[v] += motion - facing[v] * motion.dot(&facing[v]);
            }
        }
    }
}

/// Marks the corners of triangles that face against the surface at two of them or more.
fn turned(scan: &Mesh, facing: &[Vector]) -> Vec<bool> {
    let mut turned = vec![false; scan.points.len()];
    for (t, corners) in scan.triangles.iter().enumerate() {
        let [a, b, c] = scan.corners(t);
        let normal = (b - a).cross(&(c - a));
        let against = corners.iter().filter(|&&v| normal.dot(&facing[v as usize]) < 0.0).count();
        if against > 1 {
            corners.iter().for_each(|&v| turned[v as usize] = true);
        }
    }
    turned
}

/// The middle of the neighbours of the marked points.
fn middles(scan: &Mesh, marked: &[bool]) -> Vec<Option<Point>> {
    let mut sums = vec![(Vector::zeros(), 0.0); marked.len()];
    for &[a, b, c] in &scan.triangles {
        for (to, from) in [(a, b), (a, c), (b, a), (b, c), (c, a), (c, b)] {
            if marked[to as usize] {
                let (sum, count) = &mut sums[to as usize];
                (*sum, *count) = (*sum + scan.points[from as usize].coords, *count + 1.0);
            }
        }
    }
    sums.into_iter().map(|(sum, count)| (count > 0.0).then(|| Point::from(sum / count))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::shapes::sheet;

    #[test]
    fn a_point_beyond_its_neighbour_is_drawn_back_along_the_surface() {
        let flat = sheet(8);
        let facing = vec![Vector::z(); flat.points.len()];
        let mut untouched = flat.clone();
        unfold(&mut untouched, &facing);
        assert_eq!(untouched, flat);
        let mut folded = flat.clone();
        folded.points[27].x += 1.5;
        folded.points[27].z += 0.1;
        let area = folded.area();
        unfold(&mut folded, &facing);
        assert!(!turned(&folded, &facing).contains(&true) && folded.area() < area);
        assert_eq!(folded.points[27].z, flat.points[27].z + 0.1, "its height is the scan's");
        assert_eq!(folded.points[0], flat.points[0]);
    }
}
