//! A scan that does not fit: would it, turned inside out or mirrored? Asked only after a bad fit, and only told.

use crate::mesh::Mesh;
use crate::register;
use lacuna::Model;

/// A change of the scan with which it fits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alternative {
    /// Its triangles or normals the other way round.
    Flipped,
    /// Its mirror image.
    Mirrored,
    /// The mirror image of its coordinates, with the winding as it is: an axis was reversed in the export.
    Reversed,
}

/// An alternative must explain this share of the scan, and so much more than the scan itself does.
const CONVINCING: [f64; 2] = [0.6, 0.25];

impl Alternative {
    /// The scan after this change.
    pub fn of(self, scan: &Mesh) -> Mesh {
        let mut mesh = scan.clone();
        if self != Self::Flipped {
            mesh.points.iter_mut().for_each(|p| p.x = -p.x);
            mesh.normals.iter_mut().for_each(|n| n.x = -n.x);
        }
        match self {
            Self::Reversed => mesh.normals.iter_mut().for_each(|n| *n = -*n),
            Self::Mirrored => mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2)),
            Self::Flipped => {
                mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
                mesh.normals.iter_mut().for_each(|n| *n = -*n);
            }
        }
        mesh
    }

    fn advice(self) -> &'static str {
        match self {
            Self::Flipped => "with its triangles turned round it would fit: give --flip",
            Self::Mirrored => {
                "its mirror image would fit: is it the other side of the body, or was an axis \
                 reversed in the export?"
            }
            Self::Reversed => {
                "its mirror image, turned inside out, would fit: an axis was reversed in the export"
            }
        }
    }
}

/// What would make a scan fit that the model explains by `inliers` only, as a sentence; none if nothing would.
pub fn advice(model: &Model<'_>, scan: &Mesh, seed: u64, inliers: f64) -> Option<String> {
    [Alternative::Flipped, Alternative::Mirrored, Alternative::Reversed].into_iter().find_map(|alternative| {
        let found = register::register(model, &alternative.of(scan), seed).ok()?.inliers;
        let convinces = found >= CONVINCING[0] && found >= inliers + CONVINCING[1];
        convinces.then(|| {
            format!("{} ({:.0} instead of {:.0} %)", alternative.advice(), 100.0 * found, 100.0 * inliers)
        })
    })
}
