//! The picture of a completion, after the paper's figure 3: scan, global fit, local fit, completed, and
//! completed with the inferred part highlighted; from the front and from the side that was inferred most.

use super::Completion;
use super::clutter::CLUTTER;
use super::merge::MEASURED;
use crate::mesh::{Mesh, Vector, twice_area_vector};
use crate::register::Placed;
use crate::render::{CLAY, Camera, Image, Panel, picture};

/// A shape is slender if it is this much longer than wide.
const SLENDER: f64 = 2.0;

/// Colour of the inferred part.
pub const INFERRED_COLOUR: [u8; 3] = [240, 146, 40];
/// Colour of what is not part of the class.
pub const CLUTTER_COLOUR: [u8; 3] = [118, 150, 190];

/// Colours of a mesh by its labels.
pub fn colours(labels: &[u8]) -> Vec<[u8; 3]> {
    let colour = |&label: &u8| match label {
        MEASURED => CLAY,
        CLUTTER => CLUTTER_COLOUR,
        _ => INFERRED_COLOUR,
    };
    labels.iter().map(colour).collect()
}

/// What the columns show, from left to right.
pub const TITLES: [&str; 5] = ["scan", "global fit", "local fit", "completed", "inferred part in orange"];

/// Draws a completion; each panel is `width` × `height` pixels.
pub fn draw(completion: &Completion, width: usize, height: usize) -> Image {
    Image::stack(&drawn(completion, TITLES, width, height))
}

/// The two rows without captions: from the front, and from the side that was inferred most.
pub fn rows(completion: &Completion, width: usize, height: usize) -> [Image; 2] {
    drawn(completion, [""; 5], width, height)
}

fn drawn(completion: &Completion, titles: [&str; 5], width: usize, height: usize) -> [Image; 2] {
    let turned = |mesh: &Mesh| in_model(mesh, &completion.placed);
    let (scan, global) = (turned(&completion.scan), turned(&completion.global));
    let (local, merged) = (turned(&completion.local), turned(&completion.merged.mesh));
    let colours = colours(&completion.merged.labels);
    let mut panels =
        [&scan, &global, &local, &merged, &merged].map(|mesh| Panel { mesh, colours: None, title: "" });
    panels[4].colours = Some(&colours);
    let labels = &completion.merged.labels;
    let (front, up) = directions(&merged, labels);
    let right = up.cross(&front).normalize();
    let side = if lean(&merged, labels, false, &right) >= 0.0 { right } else { -right };
    let first = picture(&panels, &Camera::new(-front, up), width, height);
    panels.iter_mut().zip(titles).for_each(|(panel, title)| panel.title = title);
    let second = picture(&panels, &Camera::new(-(front * 0.5 + side), up), width, height);
    [first, second]
}

/// Where the surface faces on the whole, and what is up in pictures of it. A closed one is seen from the side that was
/// measured, if `labels` tell; a slender one stands, whatever axis of the frame it lies along.
pub(crate) fn directions(mesh: &Mesh, labels: &[u8]) -> (Vector, Vector) {
    let [shortest, middle, longest] = by_extent(mesh);
    let slender = longest.1 > SLENDER * middle.1;
    let front = view_direction(mesh).unwrap_or_else(|| {
        let side = Vector::ith(if slender && longest.0 == 2 { shortest.0 } else { 2 }, 1.0);
        if lean(mesh, labels, true, &side) < 0.0 { -side } else { side }
    });
    let usual = if front.y.abs() < 0.9 { Vector::y() } else { Vector::z() };
    let stands = slender && front[longest.0].abs() < 0.9;
    (front, if stands { Vector::ith(longest.0, 1.0) } else { usual })
}

/// The axes of the frame with the shape's extents along them, in order of these.
fn by_extent(mesh: &Mesh) -> [(usize, f64); 3] {
    let size = mesh.bounds().map_or_else(Vector::zeros, |(low, high)| high - low);
    let mut axes = [0, 1, 2].map(|axis| (axis, size[axis]));
    axes.sort_by(|a, b| a.1.total_cmp(&b.1));
    axes
}

/// The mesh in voxels of the model, so that pictures of different scans look alike.
pub(crate) fn in_model(mesh: &Mesh, placed: &Placed) -> Mesh {
    let turn = |n: &Vector| Vector::from(placed.pose.rotate(n.map(|c| c as f32).into()).map(f64::from));
    Mesh {
        points: mesh.points.iter().map(|p| placed.to_model(p)).collect(),
        normals: mesh.normals.iter().map(turn).collect(),
        triangles: mesh.triangles.clone(),
    }
}

/// Where the surface faces on the whole; nowhere if it is closed.
fn view_direction(mesh: &Mesh) -> Option<Vector> {
    let (mut sum, mut total) = (Vector::zeros(), 0.0);
    for t in 0..mesh.triangles.len() {
        let cross = twice_area_vector(&mesh.corners(t));
        sum += cross;
        total += cross.norm();
    }
    // A face's mean normal tilts with its chin: it is the axis nearest to it that is "front".
    let axis = sum.iamax();
    (sum.norm() > 0.1 * total).then(|| Vector::ith(axis, sum[axis].signum()))
}

/// How much more of the measured or of the inferred part faces `side` than the other way.
fn lean(mesh: &Mesh, labels: &[u8], measured: bool, side: &Vector) -> f64 {
    let normals = mesh.vertex_normals();
    let chosen = normals.iter().zip(labels).filter(|(_, label)| (**label == MEASURED) == measured);
    chosen.map(|(normal, _)| normal.dot(side)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::complete::merge::INFERRED;
    use crate::mesh::Point;

    /// An octahedron with these extents.
    fn octahedron(size: [f64; 3]) -> Mesh {
        let sign = |i: usize| if i % 2 == 1 { 1.0 } else { -1.0 };
        let tip = |i: usize| Point::from(Vector::ith(i / 2, sign(i) * size[i / 2] / 2.0));
        let face =
            |[x, y, z]: [u32; 3]| if (x + y + z) % 2 == 1 { [x, 2 + y, 4 + z] } else { [x, 4 + z, 2 + y] };
        let signs = (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2]);
        Mesh { points: (0..6).map(tip).collect(), normals: vec![], triangles: signs.map(face).collect() }
    }

    #[test]
    fn a_slender_shape_stands_and_is_seen_from_its_broad_side() {
        let (x, y, z) = (Vector::x(), Vector::y(), Vector::z());
        assert_eq!(directions(&octahedron([1.0, 1.5, 5.0]), &[]), (x, z));
        assert_eq!(directions(&octahedron([5.0, 1.5, 1.0]), &[]), (z, x));
        assert_eq!(directions(&octahedron([1.0, 5.0, 1.0]), &[]), (z, y));
        assert_eq!(directions(&octahedron([1.0, 1.0, 1.9]), &[]), (z, y));
        assert_eq!(directions(&Mesh::default(), &[]), (z, y));
    }

    #[test]
    fn an_open_surface_is_seen_from_where_it_faces() {
        let whole = octahedron([1.0, 1.2, 1.0]);
        for axis in 0..3 {
            let half = |t: &[u32; 3]| t.contains(&(2 * axis as u32 + 1));
            let cup =
                Mesh { triangles: whole.triangles.iter().copied().filter(half).collect(), ..whole.clone() };
            let (front, up) = directions(&cup, &[]);
            assert_eq!(front, Vector::ith(axis, 1.0));
            assert_eq!(up, if axis == 1 { Vector::z() } else { Vector::y() });
        }
    }

    #[test]
    fn a_closed_surface_is_seen_from_the_measured_side() {
        let bone = octahedron([1.0, 1.5, 5.0]);
        let measured =
            |tip: usize| (0..6).map(|i| if i == tip { MEASURED } else { INFERRED }).collect::<Vec<u8>>();
        assert_eq!(directions(&bone, &measured(0)).0, -Vector::x());
        assert_eq!(directions(&bone, &measured(1)).0, Vector::x());
    }
}
