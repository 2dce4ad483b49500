//! Wavefront OBJ: vertices, normals and faces; everything else is skipped.

use super::Loaded;
use super::error::{Fault, Problem};
use super::finish::{finish, next_index};
use super::text::{Lines, numbers, quote, small_integer, words};
use crate::mesh::{Mesh, Point, Vector};

/// Reads an OBJ file. Polygons become fans, negative indices count back from the latest vertex,
/// a file without faces is a point cloud. Vertices keep their order, used or not, because
/// landmarks and correspondences name them by number.
pub(super) fn parse(bytes: &[u8]) -> Result<Loaded, Fault> {
    let mut reader = Reader::default();
    for (line, text) in Lines::new(bytes).continued() {
        reader.line = line;
        let mut words = words(text);
        match words.next() {
            Some(b"v") => reader.vertex(numbers(&mut words, line)?)?,
            Some(b"vn") => reader.normals.push(Vector::from(numbers(&mut words, line)?)),
            Some(b"f") => reader.face(words).map_err(|problem| problem.in_line(line))?,
            _ => {}
        }
    }
    reader.finish()
}

/// What has been read so far.
#[derive(Default)]
struct Reader {
    mesh: Mesh,
    line: usize,
    /// The normals of the file, which corners name by number.
    normals: Vec<Vector>,
    /// Vertex and normal of every corner that has a normal.
    shading: Vec<[u32; 2]>,
    /// Vertices of the face at hand.
    face: Vec<u32>,
    vertex_use: Largest,
    normal_use: Largest,
}

/// The largest index used and the line that used it. Faces may stand before their vertices, so
/// it is judged at the end.
#[derive(Default)]
struct Largest(Option<(u32, usize)>);

impl Reader {
    fn vertex(&mut self, xyz: [f64; 3]) -> Result<(), Fault> {
        next_index(&self.mesh.points).map_err(|problem| problem.in_line(self.line))?;
        self.mesh.points.push(Point::from(xyz));
        Ok(())
    }

    fn face<'a>(&mut self, corners: impl Iterator<Item = &'a [u8]>) -> Result<(), Problem> {
        self.face.clear();
        for corner in corners.take_while(|word| !word.starts_with(b"#")) {
            let mut parts = corner.split(|&b| b == b'/');
            let vertex = resolve(parts.next().unwrap_or_default(), self.mesh.points.len(), "vertex")?;
            self.vertex_use.note(vertex, self.line);
            self.face.push(vertex);
            if let Some(normal) = parts.nth(1).filter(|part| !part.is_empty()) {
                let normal = resolve(normal, self.normals.len(), "normal")?;
                self.normal_use.note(normal, self.line);
                self.shading.push([vertex, normal]);
            }
        }
        if let [first, rest @ ..] = self.face.as_slice() {
            self.mesh.triangles.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
        }
        Ok(())
    }

    fn finish(mut self) -> Result<Loaded, Fault> {
        let vertices = self.mesh.points.len();
        if vertices == 0 {
            return Err(Problem::NoVertices.in_whole());
        }
        if let Some((index, line)) = self.vertex_use.beyond(vertices) {
            return Err(Problem::Index { index: i64::from(index) + 1, vertices }.in_line(line));
        }
        let left_out = self.normals.is_empty() && !self.shading.is_empty();
        if left_out {
            self.shading.clear();
        } else if let Some((index, line)) = self.normal_use.beyond(self.normals.len()) {
            return Err(no_such("normal", i64::from(index) + 1, self.normals.len()).in_line(line));
        }
        self.mesh.normals = self.vertex_normals();
        let mut loaded = finish(self.mesh)?;
        if left_out {
            loaded.repairs.push("the faces name normals, the file has none: taken from the triangles".into());
        }
        Ok(loaded)
    }

    /// One normal a vertex: the sum of those its corners name. Where corners name none, the
    /// normals belong to the vertices in their order, as point clouds have it.
    fn vertex_normals(&mut self) -> Vec<Vector> {
        if self.shading.is_empty() {
            return std::mem::take(&mut self.normals);
        }
        let mut sums = vec![Vector::zeros(); self.mesh.points.len()];
        for &[vertex, normal] in &self.shading {
            sums[vertex as usize] += self.normals[normal as usize];
        }
        sums
    }
}

impl Largest {
    fn note(&mut self, index: u32, line: usize) {
        if self.0.is_none_or(|(largest, _)| index > largest) {
            self.0 = Some((index, line));
        }
    }

    fn beyond(&self, count: usize) -> Option<(u32, usize)> {
        self.0.filter(|&(index, _)| index as usize >= count)
    }
}

/// The index, from 0, that a word means after `count` items: from 1 upwards or from -1 downwards.
fn resolve(word: &[u8], count: usize, what: &str) -> Result<u32, Problem> {
    let written = match small_integer(word) {
        Some(value) => i64::from(value),
        None => signed(word)?,
    };
    let index = if written < 0 { count as i64 + written } else { written - 1 };
    u32::try_from(index).map_err(|_| no_such(what, written, count))
}

fn signed(word: &[u8]) -> Result<i64, Problem> {
    let parsed = std::str::from_utf8(word).ok().and_then(|text| text.parse::<i32>().ok());
    parsed.map(i64::from).ok_or_else(|| Problem::NotANumber(quote(word)))
}

fn no_such(what: &str, index: i64, count: usize) -> Problem {
    match what {
        "vertex" => Problem::Index { index, vertices: count },
        _ => Problem::Other(format!(
            "a face names {what} {index}, but there are {count}; export the file again"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::Place;

    fn parse(bytes: &[u8]) -> Result<Mesh, Fault> {
        Ok(super::parse(bytes)?.mesh)
    }

    const CORNERS: &str = "v 0 0 0\nv 1 0 0 1.0\nv 1 1 0 0.5 0.5 0.5\nv 0 1 0\n";

    fn triangles(faces: &str) -> Vec<[u32; 3]> {
        parse(format!("{CORNERS}{faces}").as_bytes()).unwrap().triangles
    }

    #[test]
    fn triangles_quads_and_polygons_are_read() {
        assert_eq!(triangles("f 1 2 3"), [[0, 1, 2]]);
        assert_eq!(triangles("f 1 2 3 4"), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(triangles("v 0 .5 0\nf 1 2 3 4 5").len(), 3);
    }

    #[test]
    fn all_spellings_of_a_corner_are_read() {
        assert_eq!(triangles("vt 0 0\nvn 0 0 1\nf 1/1 2/1/1 3//1"), [[0, 1, 2]]);
        assert_eq!(triangles("f -4 -3 -1"), [[0, 1, 3]]);
        assert_eq!(triangles("f 1 2 \\\r\n 3\r\n"), [[0, 1, 2]]);
        assert_eq!(triangles("f 1 2 3 # 9\n"), [[0, 1, 2]]);
    }

    #[test]
    fn faces_may_stand_before_their_vertices() {
        assert_eq!(parse(format!("f 1 2 3\n{CORNERS}").as_bytes()).unwrap().triangles, [[0, 1, 2]]);
    }

    #[test]
    fn other_statements_are_skipped() {
        let text = "g a\nusemtl b\ns off\nl 1 2\np 1\nf 1 2\nf\nvp 0 1\n# f 9 9 9\n";
        assert!(triangles(text).is_empty());
    }

    #[test]
    fn unused_vertices_keep_their_place() {
        let mesh = parse(format!("{CORNERS}f 4 3 2").as_bytes()).unwrap();
        assert_eq!((mesh.points.len(), mesh.triangles[0]), (4, [3, 2, 1]));
    }

    #[test]
    fn normals_of_corners_are_averaged_at_the_vertex() {
        let faces = "vn 1 0 0\nvn 0 1 0\nf 1//1 2//1 3//1\nf 1//2 3//1 4//2\n";
        let mesh = parse(format!("{CORNERS}{faces}").as_bytes()).unwrap();
        assert_eq!(mesh.normals[0], Vector::new(1.0, 1.0, 0.0).normalize());
        assert_eq!(mesh.normals[2], Vector::x());
    }

    #[test]
    fn normals_of_a_point_cloud_follow_the_vertices() {
        let mesh = parse(b"vn 0 0 2\nv 1 2 3\nvn 0 3 0\nv 4 5 6\n").unwrap();
        assert_eq!((mesh.points.len(), mesh.normals), (2, vec![Vector::z(), Vector::y()]));
    }

    #[test]
    fn errors_name_the_line() {
        let index = |index| Problem::Index { index, vertices: 4 };
        let cases = [
            ("f 1 2 5", index(5)),
            ("f 1 2 0", index(0)),
            ("f 1 2 -5", index(-5)),
            ("f 1 2 x", Problem::NotANumber("x".into())),
            ("f 1 2 9999999999", Problem::NotANumber("9999999999".into())),
            ("v 1 2", Problem::Columns { expected: "3", found: 2 }),
            ("v 1 2 z", Problem::NotANumber("z".into())),
        ];
        for (line, problem) in cases {
            let fault = parse(format!("{CORNERS}{line}\n").as_bytes()).unwrap_err();
            assert_eq!(fault, Fault { place: Place::Line(5), problem });
        }
        let fault = parse(format!("{CORNERS}vn 0 0 1\nf 1//1 2//1 3//2\n").as_bytes()).unwrap_err();
        assert_eq!(fault, no_such("normal", 2, 1).in_line(6));
    }

    #[test]
    fn normals_that_the_whole_file_lacks_are_left_to_the_triangles() {
        let loaded = super::parse(format!("{CORNERS}f 1/1/1 2/1/1 3/1/1\n").as_bytes()).unwrap();
        assert_eq!((loaded.mesh.triangles.len(), loaded.mesh.normals.len()), (1, 0));
        assert_eq!(loaded.repairs, ["the faces name normals, the file has none: taken from the triangles"]);
    }

    #[test]
    fn triangles_agree_with_those_of_tobj() {
        let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 4 3 2 1\nf -1 -3 -4\n";
        let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
        let no_materials = |_: &std::path::Path| Ok(Default::default());
        let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, no_materials).unwrap();
        let theirs = &models[0].mesh;
        let ours = parse(text.as_bytes()).unwrap();
        let corners: Vec<Point> = ours.triangles.iter().flatten().map(|&v| ours.points[v as usize]).collect();
        let positions: Vec<Point> = theirs.positions.chunks(3).map(|p| point(p[0], p[1], p[2])).collect();
        assert_eq!(corners, theirs.indices.iter().map(|&v| positions[v as usize]).collect::<Vec<_>>());
    }

    fn point(x: f32, y: f32, z: f32) -> Point {
        Point::new(x.into(), y.into(), z.into())
    }
}
