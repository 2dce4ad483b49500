//! Cuts narrow strips off an open surface: where the stored voxels end obliquely to the surface, tongues of it hang
//! on by one end.

use super::{boundary_edges, keep_triangles, largest_component, path_lengths};
use crate::mesh::Mesh;

/// By how much more than it was taken in the rim is put back, widths: paths along edges are longer than straight.
const SLACK: f64 = 1.25;
/// Times vertices that the rim runs through twice are cut out.
const CUTS: usize = 8;

/// The morphological opening of a surface from its rim: without everything that is not within reach of a vertex at
/// least `width` away from the rim, along edges and in the mesh's unit. Strips narrower than twice that vanish, slits
/// stay. A mesh that is narrow everywhere, or closed, comes back as it is.
pub fn open_rim(mesh: &Mesh, width: f64) -> Mesh {
    let rim = boundary_edges(mesh);
    let inward = path_lengths(mesh, rim.as_flattened());
    let core: Vec<u32> = (0..inward.len() as u32).filter(|&v| inward[v as usize] >= width).collect();
    if rim.is_empty() || core.is_empty() {
        return mesh.clone();
    }
    let outward = path_lengths(mesh, &core);
    let reach = width * (1.0 + SLACK);
    let kept = keep_triangles(mesh, |t| mesh.triangles[t].iter().all(|&v| outward[v as usize] <= reach));
    without_crossings(largest_component(&kept))
}

/// The mesh without the triangles at vertices that its rim runs through twice, which cutting leaves.
fn without_crossings(mut mesh: Mesh) -> Mesh {
    for _ in 0..CUTS {
        let mut ends = vec![0u32; mesh.points.len()];
        boundary_edges(&mesh).as_flattened().iter().for_each(|&v| ends[v as usize] += 1);
        if ends.iter().all(|&ends| ends <= 2) {
            break;
        }
        let simple = |t: usize| mesh.triangles[t].iter().all(|&v| ends[v as usize] <= 2);
        mesh = largest_component(&keep_triangles(&mesh, simple));
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{ball, sheet};
    use super::super::{is_manifold, open_curves};
    use super::*;

    #[test]
    fn a_strip_behind_a_slit_is_cut_off_and_the_sheet_stays() {
        let whole = sheet(12);
        // A slit along the second last row, all but its end: the last row hangs on by one square.
        let slit = |t: usize| {
            let square = t / 2;
            square / 11 == 9 && square % 11 < 10
        };
        let mesh = keep_triangles(&whole, |t| !slit(t));
        let opened = open_rim(&mesh, 1.0);
        let highest = opened.points.iter().map(|p| p.y).fold(0.0, f64::max);
        assert!(highest <= 10.0, "{highest}");
        assert!(opened.triangles.len() >= 2 * 11 * 9 - 8, "{}", opened.triangles.len());
        assert!(is_manifold(&opened) && open_curves(&opened).len() == 1);
    }

    #[test]
    fn narrow_and_closed_meshes_stay() {
        let narrow = sheet(3);
        assert_eq!(open_rim(&narrow, 2.0), narrow);
        let closed = ball(12, 4.0);
        assert_eq!(open_rim(&closed, 1.0), closed);
        assert_eq!(open_rim(&Mesh::default(), 1.0), Mesh::default());
    }
}
