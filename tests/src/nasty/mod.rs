//! Files as nobody should write them, and valid ones that few readers take, built from scratch: one file a kind.

mod depth;
mod geometry;
mod names;
mod obj;
mod pcd;
mod ply_binary;
mod ply_text;
mod stl;
mod xyz;

/// What must become of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expected {
    /// Accepted, with so many vertices and triangles.
    Accepted(usize, usize),
    /// Refused with a sentence that contains these words.
    Refused(&'static str),
}

/// One file and what must become of it.
#[derive(Clone, Debug)]
pub struct Nasty {
    /// File name, unique.
    pub name: String,
    /// Content.
    pub bytes: Vec<u8>,
    /// Another file that belongs to it.
    pub beside: Option<(String, Vec<u8>)>,
    /// Outcome.
    pub expected: Expected,
}

impl Nasty {
    /// Writes the file, and what belongs to it, into a folder.
    ///
    /// # Panics
    /// Where the folder cannot be written.
    pub fn write(&self, folder: &std::path::Path) {
        std::fs::write(folder.join(&self.name), &self.bytes).expect("room for the file");
        if let Some((name, bytes)) = &self.beside {
            std::fs::write(folder.join(name), bytes).expect("room for the file");
        }
    }
}

/// All of them.
pub fn all() -> Vec<Nasty> {
    let parts = [
        ply_text::cases(),
        ply_binary::cases(),
        obj::cases(),
        stl::cases(),
        pcd::cases(),
        xyz::cases(),
        depth::cases(),
        names::cases(),
        geometry::cases(),
    ];
    parts.into_iter().flatten().collect()
}

fn case(name: &str, bytes: impl Into<Vec<u8>>, expected: Expected) -> Nasty {
    Nasty { name: name.into(), bytes: bytes.into(), beside: None, expected }
}

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
const FACE: &str = "property list uchar int vertex_indices\n";
const SQUARE: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
const CORNERS: [[u8; 3]; 4] = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]];

fn head(format: &str, elements: &str) -> String {
    format!("ply\nformat {format} 1.0\n{elements}end_header\n")
}

/// An ascii PLY of a square with these faces.
fn square(faces: &str) -> String {
    let count = faces.lines().count();
    let elements = format!("element vertex 4\n{XYZ}element face {count}\n{FACE}");
    head("ascii", &elements) + SQUARE + faces
}
