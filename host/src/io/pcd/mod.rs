//! PCD, the point clouds of PCL: ascii, binary, binary_compressed.
//!
//! The crates for it trust the header's counts or know only some of the types; the format is small. Points that
//! are not finite stand for pixels without a measurement and are left out.

mod header;
mod lzf;

use self::header::{Column, Data, Header, Kind};
use super::Loaded;
use super::error::{Fault, Problem};
use super::finish::finish;
use super::text::{Lines, number, words};
use crate::mesh::{Mesh, Point, Vector};

/// Whether this begins like a PCD file.
pub(super) fn is_pcd(bytes: &[u8]) -> bool {
    Header::begins(bytes)
}

/// Reads a PCD file: x, y, z and, if there are, normal_x, normal_y, normal_z.
pub(super) fn parse(bytes: &[u8]) -> Result<Loaded, Fault> {
    let header = Header::parse(bytes)?;
    let (position, normal) =
        (header.triple(["x", "y", "z"]), header.triple(["normal_x", "normal_y", "normal_z"]));
    let no_position = || Problem::Other("the fields x, y and z are missing; export them".into()).in_whole();
    let position = position.ok_or_else(no_position)?;
    let body = &bytes[header.length..];
    let rows = match header.data {
        Data::Ascii => return finish(ascii(&header, body, position, normal)?),
        Data::Binary => Rows { bytes: body.into(), header: &header, by_row: true },
        Data::Compressed => Rows { bytes: unpack(&header, body)?.into(), header: &header, by_row: false },
    };
    rows.check()?;
    let mut cloud = Cloud::default();
    for row in 0..header.points {
        cloud.add(position.map(|c| rows.value(c, row)), normal.map(|n| n.map(|c| rows.value(c, row))));
    }
    finish(cloud.0)
}

/// The points so far.
#[derive(Default)]
struct Cloud(Mesh);

impl Cloud {
    fn add(&mut self, position: [f64; 3], normal: Option<[f64; 3]>) {
        self.0.points.push(Point::from(position));
        self.0.normals.extend(normal.map(Vector::from));
    }
}

fn ascii(
    header: &Header,
    body: &[u8],
    position: [Column; 3],
    normal: Option<[Column; 3]>,
) -> Result<Mesh, Fault> {
    let (mut cloud, mut values, mut read) = (Cloud::default(), Vec::new(), 0);
    let lines = Lines::new(body).filter(|(_, text)| words(text).next().is_some());
    for (line, text) in lines.take(header.points) {
        let line = line + header.lines;
        values.clear();
        for word in words(text) {
            values.push(number(word).map_err(|problem| problem.in_line(line))?);
        }
        if values.len() != header.columns {
            let (found, expected) = (values.len(), header.columns);
            let what = format!("{found} values in a line, FIELDS and COUNT say {expected}; correct the line");
            return Err(Problem::Other(what).in_line(line));
        }
        cloud.add(position.map(|c| values[c.number]), normal.map(|n| n.map(|c| values[c.number])));
        read += 1;
    }
    if read < header.points {
        let what =
            format!("POINTS says {}, {read} are there; the file is cut off, copy it again", header.points);
        return Err(Problem::Other(what).in_whole());
    }
    Ok(cloud.0)
}

/// Takes the two sizes in front of compressed data and unpacks it.
fn unpack(header: &Header, body: &[u8]) -> Result<Vec<u8>, Fault> {
    let size = |at: usize| {
        let field = body.get(at..at + 4)?.try_into().ok()?;
        Some(u32::from_le_bytes(field) as usize)
    };
    let at = header.length;
    let truncated = |needed: usize| {
        let (needed, left) = (needed as u64, body.len() as u64);
        Problem::Truncated { what: "the compressed data", needed, left }.at_byte(at)
    };
    let (Some(packed), Some(unpacked)) = (size(0), size(4)) else { return Err(truncated(8)) };
    let data = body.get(8..).and_then(|rest| rest.get(..packed)).ok_or_else(|| truncated(packed + 8))?;
    if header.stride.checked_mul(header.points) != Some(unpacked) {
        let what = format!(
            "the data unpacks to {unpacked} bytes, {} points of {} bytes are announced; copy the file again",
            header.points, header.stride
        );
        return Err(Problem::Other(what).at_byte(at));
    }
    let damaged =
        || Problem::Other("the compressed data is damaged; copy the file again".into()).at_byte(at + 8);
    lzf::unpack(data, unpacked).ok_or_else(damaged)
}

/// Binary values: row by row, or, in compressed files, column by column.
struct Rows<'a> {
    bytes: std::borrow::Cow<'a, [u8]>,
    header: &'a Header,
    by_row: bool,
}

impl Rows<'_> {
    fn check(&self) -> Result<(), Fault> {
        let needed = self.header.stride.saturating_mul(self.header.points) as u64;
        let left = self.bytes.len() as u64;
        if needed <= left {
            return Ok(());
        }
        Err(Problem::Truncated { what: "the point table", needed, left }.at_byte(self.header.length))
    }

    fn value(&self, column: Column, row: usize) -> f64 {
        let at = if self.by_row {
            row * self.header.stride + column.offset
        } else {
            column.offset * self.header.points + row * column.bytes
        };
        column.kind.decode(self.bytes.get(at..).unwrap_or_default())
    }
}

impl Kind {
    /// The value at the head of `bytes`.
    fn decode(self, bytes: &[u8]) -> f64 {
        fn head<const N: usize>(bytes: &[u8]) -> [u8; N] {
            bytes.first_chunk().copied().unwrap_or([0; N])
        }
        match self {
            Kind::F32 => f32::from_le_bytes(head(bytes)).into(),
            Kind::F64 => f64::from_le_bytes(head(bytes)),
            Kind::I8 => i8::from_le_bytes(head(bytes)).into(),
            Kind::I16 => i16::from_le_bytes(head(bytes)).into(),
            Kind::I32 => i32::from_le_bytes(head(bytes)).into(),
            Kind::I64 => i64::from_le_bytes(head(bytes)) as f64,
            Kind::U8 => u8::from_le_bytes(head(bytes)).into(),
            Kind::U16 => u16::from_le_bytes(head(bytes)).into(),
            Kind::U32 => u32::from_le_bytes(head(bytes)).into(),
            Kind::U64 => u64::from_le_bytes(head(bytes)) as f64,
        }
    }
}

#[cfg(test)]
mod tests;
