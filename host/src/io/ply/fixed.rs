//! Bulk decoding of binary tables: the layouts that nearly all files have.

use super::header::Element;
use super::scalar::{Endian, Kind};

/// A number within a row of fixed length.
#[derive(Clone, Copy)]
pub(super) struct Column {
    kind: Kind,
    offset: usize,
}

/// Bytes of a row, if all rows have the same length.
pub(super) fn stride(element: &Element) -> Option<usize> {
    let scalars = element.properties.iter().all(|property| property.length_kind.is_none());
    scalars.then(|| element.properties.iter().map(|property| property.kind.size()).sum())
}

/// The column called `name` of an element without lists.
pub(super) fn column(element: &Element, name: &str) -> Option<Column> {
    let number = element.properties.iter().position(|property| property.name.eq_ignore_ascii_case(name))?;
    let offset = element.properties[..number].iter().map(|property| property.kind.size()).sum();
    Some(Column { kind: element.properties[number].kind, offset })
}

/// Three columns of every row, made into a `T`.
pub(super) fn triples<T>(
    rows: &[u8],
    stride: usize,
    columns: [Column; 3],
    endian: Endian,
    make: impl Fn([f64; 3]) -> T,
) -> Vec<T> {
    let rows = rows.chunks_exact(stride);
    let first = columns[0].offset;
    let packed = columns.iter().zip([first, first + 4, first + 8]);
    if endian == Endian::Little && packed.into_iter().all(|(c, at)| c.kind == Kind::F32 && c.offset == at) {
        return rows.map(|row| make(floats(&row[first..first + 12]))).collect();
    }
    rows.map(|row| make(columns.map(|c| c.kind.decode(&row[c.offset..], endian)))).collect()
}

fn floats(bytes: &[u8]) -> [f64; 3] {
    [0, 4, 8]
        .map(|at| f64::from(f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])))
}

/// Whether the rows are nothing but a list of 32-bit indices with its length in a byte.
pub(super) fn is_plain_list(element: &Element) -> bool {
    let [list] = element.properties.as_slice() else { return false };
    list.length_kind == Some(Kind::U8) && matches!(list.kind, Kind::I32 | Kind::U32)
}

/// Takes triangles off the head of `bytes`, at most `count`, up to the first row that is not
/// three indices below `vertices`; tells how many.
pub(super) fn triangles(bytes: &mut &[u8], count: usize, vertices: usize, out: &mut Vec<[u32; 3]>) -> usize {
    const ROW: usize = 13;
    let before = out.len();
    let index = |row: &[u8], at: usize| u32::from_le_bytes([row[at], row[at + 1], row[at + 2], row[at + 3]]);
    let plain = bytes.chunks_exact(ROW).take(count).map_while(|row| {
        let corners = [index(row, 1), index(row, 5), index(row, 9)];
        let largest = corners[0].max(corners[1]).max(corners[2]);
        (row[0] == 3 && (largest as usize) < vertices).then_some(corners)
    });
    out.extend(plain);
    let taken = out.len() - before;
    *bytes = &bytes[ROW * taken..];
    taken
}
