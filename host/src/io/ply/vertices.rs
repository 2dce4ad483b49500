//! The vertices of a PLY file.

use super::fixed;
use super::header::{Element, Property};
use super::rows;
use super::source::Source;
use crate::io::error::{Fault, Problem};
use crate::mesh::{Mesh, Point, Vector};

const POSITION: [&str; 3] = ["x", "y", "z"];
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];

/// Reads the vertices and, if they have them, their normals.
pub(super) fn read<'a>(
    source: &mut impl Source<'a>,
    element: &Element,
    mesh: &mut Mesh,
) -> Result<(), Fault> {
    let numbers = |names: [&str; 3]| {
        let is = |p: &Property, name: &str| p.length_kind.is_none() && p.name.eq_ignore_ascii_case(name);
        let number = |name: &str| element.properties.iter().position(|p| is(p, name));
        Some([number(names[0])?, number(names[1])?, number(names[2])?])
    };
    let position = numbers(POSITION).ok_or_else(|| no_position().in_whole())?;
    let normal = numbers(NORMAL);
    if bulk_vertices(source, element, mesh) {
        return Ok(());
    }
    let mut values = vec![0.0; element.properties.len()];
    mesh.points.reserve(element.count);
    for _ in 0..element.count {
        rows::row(source, element, |number, value| values[number] = value)?;
        mesh.points.push(Point::from(position.map(|number| values[number])));
        mesh.normals.extend(normal.map(|normal| Vector::from(normal.map(|number| values[number]))));
    }
    Ok(())
}

/// Reads vertices of a fixed binary layout; false if they are not of that kind.
fn bulk_vertices<'a>(source: &mut impl Source<'a>, element: &Element, mesh: &mut Mesh) -> bool {
    let columns = |names: [&str; 3]| {
        let [x, y, z] = names.map(|name| fixed::column(element, name));
        Some([x?, y?, z?])
    };
    let (Some(stride), Some(position)) = (fixed::stride(element), columns(POSITION)) else { return false };
    let Some((rows, endian)) = source.rows(element, stride) else { return false };
    mesh.points = fixed::triples(rows, stride, position, endian, Point::from);
    if let Some(normal) = columns(NORMAL) {
        mesh.normals = fixed::triples(rows, stride, normal, endian, Vector::from);
    }
    true
}

fn no_position() -> Problem {
    Problem::Other("the vertices have no properties x, y and z; export the file again".into())
}
