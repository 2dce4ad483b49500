//! Open meshes that face inwards as a whole. Closed ones are turned round; of these one can only say how they look.

use crate::mesh::{Mesh, Point, Vector, twice_area_vector};

/// Meshes below this are doubted. Faces are at 0.64 or more, a raw head is at 0.30, scans of one view are at -0.08
/// to 0.46, whole and nearly whole ones at 0.59 and more.
const INWARDS: f64 = -0.3;

/// A sentence about a mesh that seems to be inside out.
pub(super) fn advice(mesh: &Mesh) -> Option<String> {
    (outwardness(mesh)? < INWARDS).then(|| {
        "it seems to face inwards: if it is not the inside of something hollow, turn its triangles round"
            .into()
    })
}

/// How far triangles face away from the middle of their mesh, from -1 to 1: the mean of the cosines between the normals
/// and the directions away from the area's centroid, weighted with area and distance. None for a mesh without area.
pub fn outwardness(mesh: &Mesh) -> Option<f64> {
    outwardness_of((0..mesh.triangles.len()).map(|t| mesh.corners(t)))
}

/// The same of triangles.
pub(super) fn outwardness_of(triangles: impl Iterator<Item = [Point; 3]>) -> Option<f64> {
    let parts: Vec<(Point, Vector)> = triangles.map(part).collect();
    let area: f64 = parts.iter().map(|(_, normal)| normal.norm()).sum();
    let sum: Vector = parts.iter().map(|(centre, normal)| centre.coords * normal.norm()).sum();
    if area == 0.0 {
        return None;
    }
    let middle = Point::from(sum / area);
    let outwards: f64 = parts.iter().map(|(centre, normal)| (centre - middle).dot(normal)).sum();
    let all: f64 = parts.iter().map(|(centre, normal)| (centre - middle).norm() * normal.norm()).sum();
    (all > 0.0).then(|| outwards / all)
}

/// Centroid of a triangle, and its normal with twice its area as length.
fn part(corners: [Point; 3]) -> (Point, Vector) {
    let [a, b, c] = corners;
    (Point::from((a.coords + b.coords + c.coords) / 3.0), twice_area_vector(&corners))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::alternatives::Alternative;
    use crate::surface::shapes::{ball, sheet};
    use crate::synth::Head;

    #[test]
    fn open_meshes_that_face_inwards_are_told() {
        let head = Head::sample(1, 0).mesh();
        let mut dome = ball(12, 4.0);
        let kept = (0..dome.triangles.len()).filter(|&t| dome.corners(t).iter().all(|p| p.z > 0.0));
        dome.triangles = kept.map(|t| dome.triangles[t]).collect();
        for mesh in [head, dome] {
            assert_eq!(advice(&mesh), None);
            assert!(
                advice(&Alternative::Flipped.of(&mesh)).is_some_and(|text| text.contains("face inwards"))
            );
        }
    }

    #[test]
    fn surfaces_that_face_neither_way_are_not_doubted() {
        assert_eq!(advice(&sheet(5)), None);
        assert_eq!(advice(&Alternative::Flipped.of(&sheet(5))), None);
        assert_eq!(advice(&Mesh::default()), None);
    }
}
