//! Point clouds of PCL.

use super::Expected::{Accepted, Refused};
use super::{Nasty, SQUARE, case};

pub(super) fn head(points: usize, data: &str) -> String {
    format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n\
         COUNT 1 1 1\nWIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA {data}\n"
    )
}

pub(super) fn cases() -> Vec<Nasty> {
    let text = head(4, "ascii") + SQUARE;
    let floats: Vec<u8> =
        [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0_u8].iter().flat_map(|&v| f32::from(v).to_le_bytes()).collect();
    let binary = [head(4, "binary").as_bytes(), &floats].concat();
    let packed = |size: u32, data: &[u8]| {
        let head = head(4, "binary_compressed").into_bytes();
        [head, (data.len() as u32).to_le_bytes().to_vec(), size.to_le_bytes().to_vec(), data.to_vec()]
            .concat()
    };
    // Columns: x, then y, then z, as two literal runs of 24 bytes.
    let column = |axis: usize| floats.chunks(4).skip(axis).step_by(3).flatten().copied().collect::<Vec<u8>>();
    let columns = [column(0), column(1), column(2)].concat();
    let literal: Vec<u8> = columns.chunks(24).flat_map(|run| [&[23][..], run].concat()).collect();
    vec![
        case("text.pcd", text.clone(), Accepted(4, 0)),
        case("binary.pcd", binary.clone(), Accepted(4, 0)),
        case("packed.pcd", packed(48, &literal), Accepted(4, 0)),
        case("nan.pcd", text.replacen("1 1 0", "nan nan nan", 1), Accepted(3, 0)),
        case("all_nan.pcd", head(1, "ascii") + "nan nan nan\n", Refused("not finite")),
        case("cut.pcd", &binary[..binary.len() - 5], Refused("needs 48 bytes")),
        case("cut_text.pcd", head(9, "ascii") + SQUARE, Refused("POINTS says 9")),
        case("billions.pcd", head(4_000_000_000, "binary"), Refused("needs")),
        case("packed_bomb.pcd", packed(u32::MAX, &literal), Refused("unpacks to")),
        case("packed_cut.pcd", packed(48, &literal[..20]), Refused("damaged")),
        case("packed_back.pcd", packed(48, &[2 << 5, 200]), Refused("damaged")),
        case("type.pcd", text.replace("TYPE F", "TYPE Q"), Refused("TYPE Q")),
        case("lengths.pcd", text.replace("SIZE 4 4 4", "SIZE 4 4"), Refused("different lengths")),
        case("no_z.pcd", text.replace("FIELDS x y z", "FIELDS x y w"), Refused("x, y and z are missing")),
        case("data.pcd", text.replace("DATA ascii", "DATA zip"), Refused("not known")),
        case("no_data.pcd", text.split("DATA").next().unwrap_or_default(), Refused("DATA")),
        case("crlf.pcd", text.replace('\n', "\r\n"), Accepted(4, 0)),
        case("count_none.pcd", text.replace("COUNT 1 1 1", "COUNT 1 0 1"), Refused("COUNT 0")),
        case(
            "count_billions.pcd",
            text.replace("COUNT 1 1 1", "COUNT 1 1 4294967295"),
            Refused("a point of"),
        ),
        case("size_none.pcd", text.replace("SIZE 4", "SIZE 0"), Refused("SIZE 0")),
        case("width_negative.pcd", text.replace("WIDTH 4", "WIDTH -4"), Refused("is not a number")),
        case(
            "height.pcd",
            text.replace("HEIGHT 1", "HEIGHT 18446744073709551615"),
            Refused("WIDTH times HEIGHT"),
        ),
        case("small_letters.pcd", text.to_lowercase(), Refused("does not belong")),
    ]
}
