//! Mesh files: refused with a sentence, or read into a mesh that keeps the readers' promises.

use lacuna_host::io::{Format, parse};
use lacuna_host::mesh::Mesh;
use lacuna_host::surface::components;
use std::path::Path;

/// PLY.
pub fn ply(bytes: &[u8]) {
    read(Format::Ply, bytes);
}

/// OBJ.
pub fn obj(bytes: &[u8]) {
    read(Format::Obj, bytes);
}

/// STL.
pub fn stl(bytes: &[u8]) {
    read(Format::Stl, bytes);
}

/// PCD.
pub fn pcd(bytes: &[u8]) {
    read(Format::Pcd, bytes);
}

/// Text in columns.
pub fn xyz(bytes: &[u8]) {
    read(Format::Xyz, bytes);
}

fn read(format: Format, bytes: &[u8]) {
    let _ = Format::detect(Path::new("scan"), bytes);
    match parse(format, bytes) {
        Ok(mesh) => check(&mesh),
        Err(fault) => assert!(fault.in_file(Path::new("scan")).to_string().len() > 10),
    }
}

/// What the readers promise.
///
/// # Panics
/// Where they do not keep it.
pub fn check(mesh: &Mesh) {
    assert!(!mesh.points.is_empty() && mesh.points.iter().all(|p| p.iter().all(|c| c.is_finite())));
    let valid = |[a, b, c]: &[u32; 3]| {
        a != b && b != c && c != a && [a, b, c].iter().all(|&&v| (v as usize) < mesh.points.len())
    };
    assert!(mesh.triangles.iter().all(valid));
    assert!(mesh.normals.is_empty() || mesh.normals.len() == mesh.points.len());
    let unit = |n: &lacuna_host::mesh::Vector| n.norm() == 0.0 || (n.norm() - 1.0).abs() < 1e-6;
    assert!(mesh.normals.iter().all(unit));
    assert_eq!(components(mesh).len(), mesh.triangles.len());
}

const VERTICES: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
const FACES: &str = "element face 2\nproperty list uchar int vertex_indices\n";

/// Ascii with everything, binary of both orders, strips.
pub fn ply_seeds() -> Vec<Vec<u8>> {
    let text = format!(
        "ply\r\nformat ascii 1.0\ncomment a\nobj_info b\nelement camera 1\nproperty list short double k\n\
         {VERTICES}property double nx\nproperty double ny\nproperty double nz\nproperty uchar red\n{FACES}\
         property float quality\nend_header\n3 1 2 3\n0 0 0 0 0 1 9\n1 0 0 0 0 1 9\n1 1e0 0 0 0 1 9\n\
         0 1 0 0 0 1 9\n3 0 1 2 0.5\n4 0 1 2 3 0.25\n"
    );
    let strips = format!(
        "ply\nformat ascii 1.0\n{VERTICES}element tristrips 1\nproperty list int int vertex_indices\n\
         end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n6 0 1 2 -1 1 2\n"
    );
    let corners: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.5];
    let binary = |order: &str, float: fn(f32) -> [u8; 4], int: fn(i32) -> [u8; 4]| {
        let mut bytes = format!("ply\nformat {order} 1.0\n{VERTICES}{FACES}end_header\n").into_bytes();
        bytes.extend(corners.into_iter().flat_map(float));
        for face in [&[0, 1, 2][..], &[0, 1, 2, 3]] {
            bytes.push(face.len() as u8);
            bytes.extend(face.iter().copied().flat_map(int));
        }
        bytes
    };
    vec![
        text.into_bytes(),
        strips.into_bytes(),
        binary("binary_little_endian", f32::to_le_bytes, i32::to_le_bytes),
        binary("binary_big_endian", f32::to_be_bytes, i32::to_be_bytes),
    ]
}

/// Quads, negative indices, colours, lines that go on.
pub fn obj_seeds() -> Vec<Vec<u8>> {
    let whole = "# a\nmtllib a.mtl\no head\nv 0 0 0 1 0 0\nv 1 0 0 .5 .5 .5\nv 1 1 0\nv 0 1 0\nvn 0 0 1\n\
                 vt 0 0\ng front\nusemtl skin\ns 1\nf 1//1 2//1 3//1\nf -4 -3 -2 -1\nf 1/1/1 2/1/1 \\\n3/1/1\n";
    vec![whole.into(), b"v 1e3 -2.5e-3 7\nv 0 0 0\r\nv 1 2 3 1\r\nf 1 2 3\r\nl 1 2\np 1\n".to_vec()]
}

/// Both kinds, and a binary one that calls itself solid.
pub fn stl_seeds() -> Vec<Vec<u8>> {
    let text = "solid a\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 1 1 0\n  \
                endloop\n endfacet\nendsolid a\n";
    let binary = |name: &[u8]| {
        let mut bytes = vec![b' '; 80];
        bytes[..name.len()].copy_from_slice(name);
        bytes.extend(2u32.to_le_bytes());
        for corner in [1.0f32, -1.0] {
            let numbers = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, corner, 0.0];
            bytes.extend(numbers.iter().flat_map(|v: &f32| v.to_le_bytes()));
            bytes.extend([0, 0]);
        }
        bytes
    };
    vec![text.into(), text.repeat(2).into(), binary(b"made by"), binary(b"solid part")]
}

/// Ascii, binary, and compressed as one literal run.
pub fn pcd_seeds() -> Vec<Vec<u8>> {
    let header = |data: &str| {
        format!(
            "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 2\n\
             HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA {data}\n"
        )
        .into_bytes()
    };
    let values: Vec<u8> =
        [0.0f32, 1.0, 2.0, 0.0, 3.0, 4.0, 5.0, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let literal = [&[31][..], &values].concat();
    let sizes = [(literal.len() as u32).to_le_bytes(), (values.len() as u32).to_le_bytes()].concat();
    let normals =
        b"FIELDS x y z normal_x normal_y normal_z\nSIZE 8 8 8 4 4 4\nTYPE F F F F F F\nWIDTH 1\nHEIGHT 1\n\
                    POINTS 1\nDATA ascii\n1 2 nan 0 0 1\n4 5 6 0 0 1\n";
    vec![
        [&header("ascii")[..], b"0 1 2 0\n3 4 5 0\n"].concat(),
        [&header("binary")[..], &values].concat(),
        [&header("binary_compressed")[..], &sizes, &literal].concat(),
        normals.to_vec(),
    ]
}

/// Three and six columns, separators, remarks.
pub fn xyz_seeds() -> Vec<Vec<u8>> {
    vec![
        b"# x y z\n0 0 0\n1 2 3\n-1e-3 .5 +7\n".to_vec(),
        b"0 0 0 0 0 1\r\n1,2,3,0,1,0\r\n// remark\n4\t5\t6\t1\t0\t0\n".to_vec(),
        b"3\n0;0;0\n1;1;1\n2;2;2\n".to_vec(),
    ]
}
