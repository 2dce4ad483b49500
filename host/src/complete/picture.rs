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

/// Draws a completion; each panel is `width` × `height` pixels.
pub fn draw(completion: &Completion, width: usize, height: usize) -> Image {
    let turned = |mesh: &Mesh| in_model(mesh, &completion.placed);
    let (scan, global) = (turned(&completion.scan), turned(&completion.global));
    let (local, merged) = (turned(&completion.local), turned(&completion.merged.mesh));
    let colours = colours(&completion.merged.labels);
    let panel = |mesh, title| Panel { mesh, colours: None, title };
    let highlighted = Panel { mesh: &merged, colours: Some(&colours), title: "inferred part in orange" };
    let panels = [
        panel(&scan, "scan"),
        panel(&global, "global fit"),
        panel(&local, "local fit"),
        panel(&merged, "completed"),
        highlighted,
    ];
    let front = front(&merged);
    let up = if front.y.abs() < 0.9 { Vector::y() } else { Vector::z() };
    let right = up.cross(&front).normalize();
    let side = if leans(&merged, &completion.merged.labels, &right) { right } else { -right };
    let first = picture(&untitled(&panels), &Camera::new(-front, up), width, height);
    let second = picture(&panels, &Camera::new(-(front * 0.5 + side), up), width, height);
    Image::stack(&[first, second])
}

fn untitled<'a>(panels: &[Panel<'a>]) -> Vec<Panel<'a>> {
    panels.iter().map(|panel| Panel { title: "", ..*panel }).collect()
}

/// The mesh in voxels of the model, so that pictures of different scans look alike.
fn in_model(mesh: &Mesh, placed: &Placed) -> Mesh {
    let turn = |n: &Vector| Vector::from(placed.pose.rotate(n.map(|c| c as f32).into()).map(f64::from));
    Mesh {
        points: mesh.points.iter().map(|p| placed.to_model(p)).collect(),
        normals: mesh.normals.iter().map(turn).collect(),
        triangles: mesh.triangles.clone(),
    }
}

/// Where the surface faces on the whole; z for a closed one.
pub(crate) fn front(mesh: &Mesh) -> Vector {
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
