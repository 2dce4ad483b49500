//! PLY as bytes.

use super::Expected::{Accepted, Refused};
use super::{CORNERS, FACE, Nasty, XYZ, case, head};

/// A square in any number types and order of bytes, with an index of another size.
fn binary(big: bool, double: bool, short: bool) -> Vec<u8> {
    let number = if double { "double" } else { "float" };
    let format = if big { "binary_big_endian" } else { "binary_little_endian" };
    let index = if short { "short" } else { "uint" };
    let elements =
        format!("element vertex 4\n{XYZ}element face 2\nproperty list uchar {index} vertex_index\n");
    let mut bytes = head(format, &elements.replace("float", number)).into_bytes();
    let mut put = |little: &[u8]| {
        let ordered: Vec<u8> = if big { little.iter().rev().copied().collect() } else { little.to_vec() };
        bytes.extend(ordered);
    };
    for value in [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0_u8] {
        if double { put(&f64::from(value).to_le_bytes()) } else { put(&f32::from(value).to_le_bytes()) }
    }
    for row in [[0, 1, 2], [0, 2, 3_u8]] {
        put(&[3]);
        for index in row {
            if short { put(&u16::from(index).to_le_bytes()) } else { put(&u32::from(index).to_le_bytes()) }
        }
    }
    bytes
}

pub(super) fn cases() -> Vec<Nasty> {
    let mut cases = Vec::new();
    for (big, double, short) in (0..8).map(|i| (i & 1 > 0, i & 2 > 0, i & 4 > 0)) {
        let name = format!("binary_big_{big}_double_{double}_short_{short}.ply");
        cases.push(case(&name, binary(big, double, short), Accepted(4, 2)));
    }
    let good = binary(false, false, false);
    for cut in [1, 13, 26, 40] {
        cases.push(case(&format!("binary_cut_{cut}.ply"), &good[..good.len() - cut], Refused("needs")));
    }
    let mut index = good.clone();
    let last = index.len() - 1;
    index[last] = 0x7F;
    cases.push(case("binary_index.ply", index, Refused("a face names")));
    let mut nan = good.clone();
    let start = nan.len() - 26 - 48;
    nan[start..start + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    cases.push(case("binary_nan.ply", nan, Refused("not finite")));
    cases.extend(layouts());
    cases.extend(lengths());
    cases
}

/// Vertices as floats of the machine's order.
fn corners(big: bool) -> Vec<u8> {
    let float = |&value: &u8| {
        let value = f32::from(value);
        if big { value.to_be_bytes() } else { value.to_le_bytes() }
    };
    CORNERS.as_flattened().iter().flat_map(float).collect()
}

/// Lists before the coordinates, strips of the other order of bytes, faces first, indices of a byte.
fn layouts() -> Vec<Nasty> {
    let little = |elements: &str| head("binary_little_endian", elements).into_bytes();
    let lists = format!("property list uchar float w\n{XYZ}property list ushort double u\n");
    let mut listed = little(&format!("element vertex 4\n{lists}element face 1\n{FACE}"));
    for (i, corner) in CORNERS.iter().enumerate() {
        listed.push(i as u8);
        listed.extend([0, 0, 0, 63].repeat(i));
        listed.extend(corner.iter().flat_map(|&value| f32::from(value).to_le_bytes()));
        listed.extend([1, 0, 0, 0, 0, 0, 0, 0, 0xF8, 0x7F]);
    }
    listed.extend([4, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0]);

    let strips =
        format!("element vertex 4\n{XYZ}element tristrips 1\nproperty list int int vertex_indices\n");
    let strip = [7, 0, 1, 2, -1, 0, 2, 3_i32].map(i32::to_be_bytes).concat();
    let strips = [head("binary_big_endian", &strips).into_bytes(), corners(true), strip].concat();

    let first = format!("element face 2\nproperty list uchar ushort vertex_index\nelement vertex 4\n{XYZ}");
    let faces = vec![3, 0, 0, 1, 0, 2, 0, 3, 0, 0, 2, 0, 3, 0];
    let first = [little(&first), faces, corners(false)].concat();

    let bytes = format!("element vertex 4\n{XYZ}element face 2\nproperty list uchar uchar vertex_indices\n");
    let bytes = [little(&bytes), corners(false), vec![3, 0, 1, 2, 3, 0, 2, 3]].concat();
    vec![
        case("lists_first.ply", listed, Accepted(4, 2)),
        case("strips_big.ply", strips, Accepted(4, 2)),
        case("faces_first_short.ply", first, Accepted(4, 2)),
        case("marked_binary.ply", [b"\xEF\xBB\xBF", &bytes[..]].concat(), Accepted(4, 2)),
        case("index_of_a_byte.ply", bytes, Accepted(4, 2)),
    ]
}

/// Lengths of lists and tables that no file has.
fn lengths() -> Vec<Nasty> {
    let with = |list: &str, length: &[u8], count: u32| {
        let elements =
            format!("element vertex 4\n{XYZ}element face {count}\nproperty list {list} vertex_indices\n");
        let header = head("binary_little_endian", &elements).into_bytes();
        [header, corners(false), length.to_vec(), vec![0; 40]].concat()
    };
    vec![
        case("list_of_billions.ply", with("uint uint", &[255; 4], 1), Refused("needs")),
        case("faces_of_billions.ply", with("uchar int", &[], u32::MAX), Refused("the face table needs")),
        case("length_nan.ply", with("float int", &f32::NAN.to_le_bytes(), 1), Refused("length NaN")),
        case("length_negative.ply", with("char int", &[255], 1), Refused("length -1")),
    ]
}
