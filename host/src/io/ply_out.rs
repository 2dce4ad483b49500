//! Writes binary little-endian PLY, the form that other programs read fastest.

use std::io::{self, Write};
use std::path::Path;

use super::atomic;
use super::error::{Error, Problem};
use super::finish::is_finite;
use crate::mesh::Mesh;

/// What the first comment of a completed mesh begins with.
pub const COMPLETED: &str = "completed by lacuna";

/// What goes into a PLY file. All slices have one entry a vertex.
///
/// ```
/// use lacuna_host::{io, mesh::{Mesh, Point}};
/// let mesh = Mesh { points: vec![Point::new(1.0, 2.0, 3.0)], ..Mesh::default() };
/// let mut out = io::PlyOut::new(&mesh);
/// out.distances = Some(&[0.25]);
/// out.comments.push("completed from a frontal scan".into());
/// let path = tempfile::tempdir()?.keep().join("face.ply");
/// io::write_ply(&path, &out)?;
/// assert_eq!(io::read(&path)?, mesh);
/// # std::fs::remove_dir_all(path.parent().unwrap())?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct PlyOut<'a> {
    /// Vertices as `float x y z`, normals if there are any, and triangles.
    pub mesh: &'a Mesh,
    /// `uchar red green blue`.
    pub colours: Option<&'a [[u8; 3]]>,
    /// A class, as `uchar label`: measured or inferred, for example.
    pub labels: Option<&'a [u8]>,
    /// The distance to the scan as `float distance`, in the unit of the points.
    pub distances: Option<&'a [f32]>,
    /// Further `float` properties by name.
    pub properties: Vec<(&'a str, &'a [f32])>,
    /// Where the file comes from; every line of text is a `comment` of the header.
    pub comments: Vec<String>,
}

/// Largest step of coordinates in single precision, share of the extent: a thousandth of a millimetre in 200.
const COARSEST: f64 = 5e-6;

/// Writes a PLY file, completely or not at all.
///
/// # Errors
/// [`Error::Content`] if a slice has not one entry a vertex, a name is not one word or taken, a
/// corner index is out of range, or a coordinate does not fit into a float; [`Error::Write`] if
/// the disk refuses.
pub fn write_ply(path: &Path, out: &PlyOut<'_>) -> Result<(), Error> {
    out.check().map_err(|problem| problem.in_whole().in_file(path))?;
    atomic::write(path, |file| out.write(file))
}

impl<'a> PlyOut<'a> {
    /// A mesh and nothing else.
    pub fn new(mesh: &'a Mesh) -> Self {
        let (properties, comments) = (Vec::new(), Vec::new());
        Self { mesh, colours: None, labels: None, distances: None, properties, comments }
    }

    /// All float properties beyond position and normal.
    fn floats(&self) -> impl Iterator<Item = (&'a str, &'a [f32])> {
        self.distances.map(|values| ("distance", values)).into_iter().chain(self.properties.iter().copied())
    }

    fn check(&self) -> Result<(), Problem> {
        let mesh = self.mesh;
        let lengths = [(!mesh.normals.is_empty()).then_some(("normals", mesh.normals.len()))]
            .into_iter()
            .chain([self.colours.map(|values| ("colours", values.len()))])
            .chain([self.labels.map(|values| ("label", values.len()))])
            .flatten()
            .chain(self.floats().map(|(name, values)| (name, values.len())));
        for (name, found) in lengths {
            same_length(name, found, mesh.points.len())?;
        }
        self.check_names()?;
        check_mesh(mesh)
    }

    fn check_names(&self) -> Result<(), Problem> {
        let mut taken = vec!["x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "label"];
        for (name, _) in self.floats() {
            let word = !name.is_empty() && name.bytes().all(|b| b.is_ascii_graphic());
            if !word || taken.contains(&name) {
                let what = format!("{name:?} cannot name a property; choose another single word");
                return Err(Problem::Other(what));
            }
            taken.push(name);
        }
        Ok(())
    }

    fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(self.header().as_bytes())?;
        let (mut row, far_off) = (Vec::new(), self.is_far_off());
        for vertex in 0..self.mesh.points.len() {
            row.clear();
            self.vertex(vertex, far_off, &mut row);
            out.write_all(&row)?;
        }
        for triangle in &self.mesh.triangles {
            row.clear();
            row.push(3);
            row.extend(triangle.iter().flat_map(|corner| corner.to_le_bytes()));
            out.write_all(&row)?;
        }
        Ok(())
    }

    fn header(&self) -> String {
        let mut lines = vec!["ply".to_owned(), "format binary_little_endian 1.0".to_owned()];
        let comments = self.comments.iter().flat_map(|text| text.split(['\n', '\r']));
        lines.extend(comments.filter(|line| !line.is_empty()).map(|line| format!("comment {line}")));
        lines.push(format!("element vertex {}", self.mesh.points.len()));
        lines.extend(self.columns().iter().map(|column| format!("property {column}")));
        lines.push(format!("element face {}", self.mesh.triangles.len()));
        lines.push("property list uchar int vertex_indices\nend_header\n".to_owned());
        lines.join("\n")
    }

    /// Whether the mesh lies so far from the origin that single precision would move its vertices: coordinates are
    /// doubles then.
    fn is_far_off(&self) -> bool {
        let Some((low, high)) = self.mesh.bounds() else { return false };
        let farthest = low.coords.abs().sup(&high.coords.abs()).max();
        f64::from(f32::EPSILON) * farthest > COARSEST * (high - low).max()
    }

    /// Types and names of the vertex properties, in the order in which [`Self::vertex`] writes.
    fn columns(&self) -> Vec<String> {
        let mut columns = if self.is_far_off() {
            vec!["double x", "double y", "double z"]
        } else {
            vec!["float x", "float y", "float z"]
        };
        if !self.mesh.normals.is_empty() {
            columns.extend(["float nx", "float ny", "float nz"]);
        }
        if self.colours.is_some() {
            columns.extend(["uchar red", "uchar green", "uchar blue"]);
        }
        if self.labels.is_some() {
            columns.push("uchar label");
        }
        let floats = self.floats().map(|(name, _)| format!("float {name}"));
        columns.into_iter().map(str::to_owned).chain(floats).collect()
    }

    fn vertex(&self, vertex: usize, far_off: bool, row: &mut Vec<u8>) {
        for &value in self.mesh.points[vertex].iter() {
            if far_off { row.extend(value.to_le_bytes()) } else { row.extend((value as f32).to_le_bytes()) }
        }
        let mut float = |value: f64| row.extend((value as f32).to_le_bytes());
        self.mesh.normals.get(vertex).into_iter().flatten().for_each(|&value| float(value));
        row.extend(self.colours.into_iter().flat_map(|colours| colours[vertex]));
        row.extend(self.labels.map(|labels| labels[vertex]));
        for (_, values) in self.floats() {
            row.extend(values[vertex].to_le_bytes());
        }
    }
}

fn same_length(name: &str, found: usize, vertices: usize) -> Result<(), Problem> {
    if found == vertices {
        return Ok(());
    }
    let what =
        format!("there are {found} values of {name} for {vertices} vertices; give one for each vertex");
    Err(Problem::Other(what))
}

/// A mesh that can be read again.
fn check_mesh(mesh: &Mesh) -> Result<(), Problem> {
    let vertices = mesh.points.len();
    let as_float = |point: &crate::mesh::Point| point.map(|value| f64::from(value as f32));
    let mut not_finite = (0..vertices).filter(|&vertex| !is_finite(&as_float(&mesh.points[vertex])));
    if let Some(vertex) = not_finite.next() {
        return Err(Problem::NotFinite { vertex, count: 1 + not_finite.count() });
    }
    match mesh.triangles.iter().flatten().find(|&&corner| corner as usize >= vertices) {
        Some(&corner) => Err(Problem::Index { index: i64::from(corner), vertices }),
        None if vertices > i32::MAX as usize => Err(Problem::TooMany),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Point, Vector};

    fn triangle() -> Mesh {
        let points = vec![Point::new(1.0, 2.0, 3.0), Point::new(4.0, 5.0, 6.5), Point::new(-7.0, 8.0, 9.0)];
        Mesh { points, normals: vec![], triangles: vec![[0, 1, 2]] }
    }

    fn bytes(out: &PlyOut<'_>) -> Vec<u8> {
        let mut bytes = Vec::new();
        out.write(&mut bytes).unwrap();
        bytes
    }

    #[test]
    fn a_mesh_far_from_the_origin_keeps_its_coordinates() {
        let folder = tempfile::tempdir().unwrap();
        for (offset, name) in [(1e3, "float x"), (1e7, "double x")] {
            let corners = [[0.1, 0.2, 0.3], [200.7, 0.0, 0.0], [0.0, 100.9, 5.5]];
            let points: Vec<Point> = corners.map(|c| Point::from(c.map(|c| c + offset))).to_vec();
            let mesh = Mesh { points, triangles: vec![[0, 1, 2]], ..Mesh::default() };
            let path = folder.path().join("mesh.ply");
            write_ply(&path, &PlyOut::new(&mesh)).unwrap();
            assert!(PlyOut::new(&mesh).columns().contains(&name.to_owned()), "{offset}");
            let found = crate::io::read(&path).unwrap();
            let moved =
                found.points.iter().zip(&mesh.points).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(moved < 1e-4 && found.triangles == mesh.triangles, "{offset}: {moved}");
        }
    }

    #[test]
    fn a_mesh_comes_back_as_it_was() {
        let mut mesh = triangle();
        assert_eq!(crate::io::parse(crate::io::Format::Ply, &bytes(&PlyOut::new(&mesh))), Ok(mesh.clone()));
        mesh.normals = vec![Vector::x(), Vector::z(), -Vector::y()];
        assert_eq!(crate::io::parse(crate::io::Format::Ply, &bytes(&PlyOut::new(&mesh))), Ok(mesh.clone()));
    }

    #[test]
    fn the_layout_is_the_one_promised() {
        let mesh = triangle();
        let mut out = PlyOut::new(&mesh);
        out.colours = Some(&[[1, 2, 3]; 3]);
        out.labels = Some(&[7; 3]);
        out.distances = Some(&[0.5; 3]);
        out.properties = vec![("sigma", &[2.0; 3])];
        out.comments = vec!["first\r\nsecond".into(), "third".into()];
        let header = "ply\nformat binary_little_endian 1.0\ncomment first\ncomment second\ncomment third\n\
            element vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
            property uchar green\nproperty uchar blue\nproperty uchar label\nproperty float distance\n\
            property float sigma\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
        let bytes = bytes(&out);
        assert_eq!(String::from_utf8_lossy(&bytes[..header.len()]), header);
        let row = [&[1.0_f32, 2.0, 3.0].map(f32::to_le_bytes).concat()[..], &[1, 2, 3, 7]].concat();
        assert_eq!(bytes[header.len()..][..16], row);
        assert_eq!(bytes[header.len() + 16..][..8], [0.5_f32, 2.0].map(f32::to_le_bytes).concat());
        assert_eq!(bytes[header.len() + 72..], [3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
    }

    #[test]
    fn what_could_not_be_read_again_is_refused() {
        let mesh = triangle();
        let refused = |change: &dyn Fn(&mut PlyOut<'_>)| {
            let mut out = PlyOut::new(&mesh);
            change(&mut out);
            out.check().unwrap_err().to_string()
        };
        assert!(refused(&|out| out.labels = Some(&[1])).contains("1 values of label for 3 vertices"));
        assert!(refused(&|out| out.properties = vec![("a b", &[0.0; 3])]).contains("\"a b\""));
        assert!(refused(&|out| out.properties = vec![("x", &[0.0; 3])]).contains("\"x\""));
        let (mut far, mut torn) = (triangle(), triangle());
        (far.points[2].x, torn.triangles[0][1]) = (1e39, 3);
        assert_eq!(PlyOut::new(&far).check(), Err(Problem::NotFinite { vertex: 2, count: 1 }));
        assert_eq!(PlyOut::new(&torn).check(), Err(Problem::Index { index: 3, vertices: 3 }));
    }

    #[test]
    fn a_refused_file_does_not_come_into_being() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ply");
        let mesh = triangle();
        let mut out = PlyOut::new(&mesh);
        out.labels = Some(&[]);
        assert!(write_ply(&path, &out).unwrap_err().to_string().contains("a.ply"));
        assert!(!path.exists());
    }
}
