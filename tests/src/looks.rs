//! What the eye takes offence at in a completed mesh, in numbers: crumpled inferred parts, ragged rims, and pits and teeth
//! where it was measured.

use lacuna_host::complete::merge::{INFERRED, Merged};
use lacuna_host::distance::Surface;
use lacuna_host::mesh::{Mesh, Point, Vector};
use lacuna_host::surface::{Edges, boundary_edges, open_curves, path_lengths};
use std::ops::Range;

/// The angle in degrees that 99 % of the edges between two inferred vertices do not bend by.
pub fn sharpest_bend(merged: &Merged) -> f64 {
    let mesh = &merged.mesh;
    let normals: Vec<Vector> = (0..mesh.triangles.len()).map(|t| mesh.normal_of(t)).collect();
    let inferred = |v: &u32| merged.labels[*v as usize] == INFERRED;
    let inner = Edges::of(mesh).list.into_iter().filter(|e| e.uses == 2 && e.ends.iter().all(inferred));
    let bend = |sides: [u32; 2]| {
        let [a, b] = sides.map(|side| normals[side as usize / 3]);
        a.dot(&b).clamp(-1.0, 1.0).acos().to_degrees()
    };
    let mut bends: Vec<f64> = inner.map(|edge| bend(edge.sides)).collect();
    bends.sort_by(f64::total_cmp);
    bends.get(bends.len() * 99 / 100).copied().unwrap_or(0.0)
}

/// Length of the longest rim over its length after smoothing over `width`, in the mesh's unit; 1 without a rim.
pub fn rim_roughness(mesh: &Mesh, width: f64) -> f64 {
    let Some(rim) = open_curves(mesh).into_iter().max_by_key(Vec::len) else { return 1.0 };
    let mut places: Vec<Point> = rim.iter().map(|&v| mesh.points[v as usize]).collect();
    let rough = length(&places);
    let edge = rough / places.len() as f64;
    // A round with weights 1/4, 1/2, 1/4 has a variance of half an edge squared.
    let rounds = 2.0 * (width / edge).powi(2);
    for _ in 0..rounds as usize {
        let count = places.len();
        let smooth = |i: usize| {
            let ends = [places[(i + 1) % count], places[(i + count - 1) % count]];
            nalgebra::center(&places[i], &nalgebra::center(&ends[0], &ends[1]))
        };
        places = (0..count).map(smooth).collect();
    }
    rough / length(&places)
}

/// Area of the scan at distances within `off` from the completed mesh: more than a fraction of a millimetre off, what was
/// measured has become a pit or a tooth; much farther off it is something else. What is nearest to the rim of the mesh does
/// not count, and neither does the scan's ragged border, `border` wide. In the scan's unit squared.
pub fn missed(scan: &Mesh, completed: &Mesh, off: Range<f64>, border: f64) -> f64 {
    let surface = Surface::new(completed).expect("a surface");
    let ends: Vec<u32> = boundary_edges(scan).into_flattened();
    let inside = path_lengths(scan, &ends);
    let area = |t: usize| {
        let [a, b, c] = scan.corners(t);
        let found = surface.distance(&Point::from((a.coords + b.coords + c.coords) / 3.0), off.end);
        let counts = found.is_some_and(|d| d.value.abs() >= off.start && !d.on_border);
        if counts { scan.area_of(t) } else { 0.0 }
    };
    let inner = |t: &usize| scan.triangles[*t].iter().all(|&v| inside[v as usize] > border);
    (0..scan.triangles.len()).filter(inner).map(area).sum()
}

/// Length of a closed curve.
fn length(places: &[Point]) -> f64 {
    let ends = places.iter().zip(places.iter().cycle().skip(1));
    ends.map(|(a, b)| (a - b).norm()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square sheet of 30 by 30 edges, of which every other inner vertex stands out by `height` and every other
    /// one of the lower rim by `tooth`.
    fn sheet(height: f64, tooth: f64) -> Mesh {
        let place = |i: usize| {
            let (x, y) = (i % 31, i / 31);
            let inner = (1..30).contains(&x) && (1..30).contains(&y);
            let z = if inner && (x + y) % 2 == 0 { height } else { 0.0 };
            let down = if y == 0 && x % 2 == 1 { tooth } else { 0.0 };
            Point::new(x as f64, y as f64 - down, z)
        };
        let square = |i: usize| {
            let a = (i % 30 + i / 30 * 31) as u32;
            [[a, a + 1, a + 32], [a, a + 32, a + 31]]
        };
        Mesh {
            points: (0..31 * 31).map(place).collect(),
            normals: Vec::new(),
            triangles: (0..900).flat_map(square).collect(),
        }
    }

    #[test]
    fn a_flat_sheet_is_smooth_and_a_crumpled_one_is_not() {
        let merged = |height| Merged {
            mesh: sheet(height, 0.0),
            labels: vec![INFERRED; 31 * 31],
            ..Merged::default()
        };
        assert!(sharpest_bend(&merged(0.0)) < 1e-3);
        assert!(sharpest_bend(&merged(0.5)) > 40.0);
    }

    #[test]
    fn a_pit_misses_what_was_measured_and_the_rim_does_not_count() {
        let (scan, mut pitted) = (sheet(0.0, 0.0), sheet(0.0, 0.0));
        assert_eq!(missed(&scan, &pitted, 0.0..3.0, 0.5), 28.0 * 28.0);
        assert_eq!(missed(&scan, &pitted, 0.2..3.0, 0.5), 0.0);
        pitted.points[15 * 31 + 15].z = -2.0;
        let pit = missed(&scan, &pitted, 0.2..3.0, 0.5);
        assert!((2.0..=3.0).contains(&pit), "{pit}");
        pitted.points.iter_mut().for_each(|p| p.z -= 5.0);
        assert_eq!(missed(&scan, &pitted, 0.2..3.0, 0.5), 0.0);
    }

    #[test]
    fn teeth_make_a_rim_rough() {
        let [even, teeth] = [0.0, 1.0].map(|tooth| rim_roughness(&sheet(0.0, tooth), 3.0));
        assert!(even < 1.08 && teeth > 1.14, "{even} {teeth}");
    }
}
