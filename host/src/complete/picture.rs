//! The picture of a completion, after the paper's figure 3: scan, global fit, local fit, completed, and
//! completed with the inferred part highlighted; from the front and from the side that was inferred most.

use super::Completion;
use super::clutter::CLUTTER;
use super::merge::MEASURED;
use crate::mesh::{Mesh, Vector};
use crate::register::Placed;
use crate::render::{CLAY, Camera, Image, Panel, picture};

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
    let (front, up) = directions(&merged);
    let right = up.cross(&front).normalize();
    let side = if leans(&merged, &completion.merged.labels, &right) { right } else { -right };
    let first = picture(&panels, &Camera::new(-front, up), width, height);
    panels.iter_mut().zip(titles).for_each(|(panel, title)| panel.title = title);
    let second = picture(&panels, &Camera::new(-(front * 0.5 + side), up), width, height);
    [first, second]
}

/// Where the surface faces on the whole, and what is up in pictures of it.
pub(crate) fn directions(mesh: &Mesh) -> (Vector, Vector) {
    let front = front(mesh);
    (front, if front.y.abs() < 0.9 { Vector::y() } else { Vector::z() })
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

/// Where the surface faces on the whole; z for a closed one.
fn front(mesh: &Mesh) -> Vector {
    let (mut sum, mut total) = (Vector::zeros(), 0.0);
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        let cross = (b - a).cross(&(c - a));
        sum += cross;
        total += cross.norm();
    }
    // A face's mean normal tilts with its chin: it is the axis nearest to it that is "front".
    let axis = sum.iamax();
    if sum.norm() > 0.1 * total { Vector::ith(axis, sum[axis].signum()) } else { Vector::z() }
}

/// Whether more of the inferred part faces `side` than the other way.
fn leans(mesh: &Mesh, labels: &[u8], side: &Vector) -> bool {
    let normals = mesh.vertex_normals();
    let inferred = normals.iter().zip(labels).filter(|(_, label)| **label != MEASURED);
    inferred.map(|(normal, _)| normal.dot(side)).sum::<f64>() >= 0.0
}
