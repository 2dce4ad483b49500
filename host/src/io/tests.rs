//! What holds for all formats: nothing panics, and errors say what, where and what to do.

use std::fs;

use proptest::prelude::*;

use super::*;

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
    property float z\nproperty list uchar int w\nelement face 2\nproperty list uchar int vertex_indices\n\
    property uchar red\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n\
    0 0 0 0\n1 0 0 1 5\n0 1 0 2 6 7\n3 0 1 2 255\n4 0 1 2 1 0\n5 0 1 2 -1 0\n";
const OBJ: &str = "# x\nv 0 0 0\nv 1.5e0 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 -2//-1 3//1\nf 1 2 \\\n 3\n";
const STL: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n\
    endloop\nendfacet\nendsolid a\n";
const XYZ: &str = "# x\n0 0 0 0 0 1\r\n1 2 3 -1 0 0\n";

/// A small binary PLY with every type and a list before, in and after its tables.
fn binary_ply() -> Vec<u8> {
    let header = "ply\nformat binary_big_endian 1.0\nelement a 1\nproperty list ushort double b\n\
        element vertex 3\nproperty double x\nproperty int y\nproperty char z\nelement face 2\n\
        property list uint ushort vertex_index\nproperty float c\nelement d 2\nproperty short e\nend_header\n";
    let mut bytes = header.as_bytes().to_vec();
    bytes.extend([0, 1, 0, 0, 0, 0, 0, 0, 0, 0]);
    for [x, y, z] in [[0, 0, 0], [1, 0, 0], [0, 1, 1_u8]] {
        bytes.extend(f64::from(x).to_be_bytes());
        bytes.extend([0, 0, 0, y, z]);
    }
    bytes.extend([0, 0, 0, 3, 0, 0, 0, 1, 0, 2, 0, 0, 0, 0]);
    bytes.extend([0, 0, 0, 4, 0, 0, 0, 1, 0, 2, 0, 1, 0, 0, 0, 0]);
    bytes.extend([0; 4]);
    bytes
}

/// The common layout, as this program writes it.
fn plain_ply() -> Vec<u8> {
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n\
        property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let floats = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].map(f32::to_le_bytes).concat();
    [header.as_bytes(), &floats, &[3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]].concat()
}

fn binary_stl() -> Vec<u8> {
    let mut bytes = b"solid".to_vec();
    bytes.resize(80, 0);
    bytes.extend([1, 0, 0, 0]);
    bytes.extend([0; 28]);
    bytes.extend(1.0_f32.to_le_bytes());
    bytes.extend([0; 12]);
    bytes.extend(1.0_f32.to_le_bytes());
    bytes.resize(134, 0);
    bytes
}

fn samples() -> Vec<(Format, Vec<u8>)> {
    vec![
        (Format::Ply, PLY.into()),
        (Format::Ply, binary_ply()),
        (Format::Ply, plain_ply()),
        (Format::Obj, OBJ.into()),
        (Format::Stl, STL.into()),
        (Format::Stl, binary_stl()),
        (Format::Xyz, XYZ.into()),
    ]
}

/// The guarantees of the module's first page.
fn is_sound(mesh: &Mesh) -> bool {
    let count = mesh.points.len();
    let unit = |n: &crate::mesh::Vector| *n == crate::mesh::Vector::zeros() || (n.norm() - 1.0).abs() < 1e-9;
    count > 0
        && mesh.points.iter().all(|p| p.iter().all(|value| value.is_finite()))
        && mesh.triangles.iter().all(|&[a, b, c]| a != b && b != c && c != a)
        && mesh.triangles.iter().flatten().all(|&v| (v as usize) < count)
        && (mesh.normals.is_empty() || mesh.normals.len() == count && mesh.normals.iter().all(unit))
}

/// Reads bytes in every way there is.
fn read_all_ways(bytes: &[u8]) {
    let _ = Format::detect(Path::new("scan"), bytes);
    for format in [Format::Ply, Format::Obj, Format::Stl, Format::Pcd, Format::Xyz] {
        match parse(format, bytes) {
            Ok(mesh) => assert!(is_sound(&mesh), "{mesh:?}"),
            Err(fault) => assert!(fault.problem.to_string().contains("; ")),
        }
    }
}

#[test]
fn the_samples_are_valid_and_recognised() {
    for (format, bytes) in samples() {
        assert_eq!(Format::detect(Path::new("scan"), &bytes), Ok(format));
        assert!(is_sound(&parse(format, &bytes).unwrap()));
    }
}

#[test]
fn truncating_a_file_anywhere_never_panics() {
    for (_, bytes) in samples() {
        (0..bytes.len()).for_each(|length| read_all_ways(&bytes[..length]));
    }
}

#[test]
fn truncated_binary_files_are_errors() {
    for (format, bytes) in
        [(Format::Ply, binary_ply()), (Format::Ply, plain_ply()), (Format::Stl, binary_stl())]
    {
        (0..bytes.len()).for_each(|length| assert!(parse(format, &bytes[..length]).is_err(), "{length}"));
    }
}

#[test]
fn changing_any_byte_never_panics() {
    for (_, bytes) in samples() {
        for (at, change) in (0..bytes.len()).flat_map(|at| [1, 2, 0x10, 0x80, 0xFF].map(|x| (at, x))) {
            let mut changed = bytes.clone();
            changed[at] ^= change;
            read_all_ways(&changed);
        }
    }
}

proptest! {
    #[test]
    fn any_bytes_after_any_beginning_never_panic(
        sample in 0_usize..7,
        keep in 0.0..1.0_f64,
        tail in prop::collection::vec(any::<u8>(), 0..300),
    ) {
        let mut bytes = samples().swap_remove(sample).1;
        bytes.truncate((keep * bytes.len() as f64) as usize);
        bytes.extend(tail);
        read_all_ways(&bytes);
    }
}

#[test]
fn files_are_read_by_content_and_name() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in
        [("a.OBJ", OBJ.into()), ("b.stl", plain_ply()), ("c.txt", XYZ.into()), ("d", binary_stl())]
    {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        assert_eq!(read(&path).unwrap(), read_scan(&path).unwrap());
    }
}

#[test]
fn errors_say_what_where_and_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let message = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        let text = read(&path).unwrap_err().to_string();
        text.strip_prefix(&format!("{}/", folder.path().display())).unwrap_or(&text).to_owned()
    };
    assert_eq!(message("a.ply", b""), "a.ply: the file is empty; export it again");
    assert_eq!(
        message("a.obj", OBJ.replace("3//1", "9//1").as_bytes()),
        "a.obj, line 6: a face names vertex 9, but there are 3 vertices; export the file again"
    );
    assert_eq!(
        message("b.ply", &plain_ply()[..plain_ply().len() - 20]),
        "b.ply, byte 169: the vertex table needs 36 bytes, but 29 are left; the file is cut off, copy it again"
    );
}

#[test]
fn missing_files_and_folders_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let missing = read(&folder.path().join("no.ply")).unwrap_err().to_string();
    assert!(missing.ends_with("no.ply: there is no such file; check the name"), "{missing}");
    let text = read(folder.path()).unwrap_err().to_string();
    assert!(text.ends_with("this is a folder; name a file in it"), "{text}");
}
