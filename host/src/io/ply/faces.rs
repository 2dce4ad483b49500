//! The polygons and triangle strips of a PLY file.

use super::fixed;
use super::header::{Element, Property};
use super::rows::index_row;
use super::source::Source;
use crate::io::error::{Fault, Problem};

const INDICES: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Reads polygons and cuts them into fans.
pub(super) fn polygons<'a>(
    source: &mut impl Source<'a>,
    element: &Element,
    vertices: usize,
    out: &mut Vec<[u32; 3]>,
) -> Result<(), Fault> {
    if element.count == 0 {
        return Ok(());
    }
    let number = indices(element)?;
    // Three indices and their number take four bytes at least: no room beyond the file's size.
    out.reserve(element.count.min(source.left() / 4));
    let plain = fixed::is_plain_list(element);
    let (mut polygon, mut done) = (Vec::new(), 0);
    while done < element.count {
        if let Some(bytes) = source.little().filter(|_| plain) {
            done += fixed::triangles(bytes, element.count - done, vertices, out);
        }
        if done < element.count {
            let place = source.place();
            index_row(source, element, number, &mut polygon)?;
            fan(&polygon, vertices, out).map_err(|problem| Fault { place, problem })?;
            done += 1;
        }
    }
    Ok(())
}

/// Reads triangle strips; -1 begins a new one.
pub(super) fn strips<'a>(
    source: &mut impl Source<'a>,
    element: &Element,
    vertices: usize,
    out: &mut Vec<[u32; 3]>,
) -> Result<(), Fault> {
    if element.count == 0 {
        return Ok(());
    }
    let number = indices(element)?;
    let mut row = Vec::new();
    for _ in 0..element.count {
        let place = source.place();
        index_row(source, element, number, &mut row)?;
        for strip in row.split(|&index| index == -1.0) {
            ribbon(strip, vertices, out).map_err(|problem| Fault { place, problem })?;
        }
    }
    Ok(())
}

/// Which property holds the corner indices.
fn indices(element: &Element) -> Result<usize, Fault> {
    let is_indices = |p: &Property| INDICES.contains(&p.name.as_str()) && p.length_kind.is_some();
    element.properties.iter().position(is_indices).ok_or_else(|| {
        let problem = format!("the element {:?} has no list vertex_indices; export it again", element.name);
        Problem::Other(problem).in_whole()
    })
}

fn fan(polygon: &[f64], vertices: usize, out: &mut Vec<[u32; 3]>) -> Result<(), Problem> {
    let [first, rest @ ..] = polygon else { return Ok(()) };
    let first = corner(*first, vertices)?;
    for pair in rest.windows(2) {
        out.push([first, corner(pair[0], vertices)?, corner(pair[1], vertices)?]);
    }
    Ok(())
}

/// Every second triangle of a strip is turned round.
fn ribbon(strip: &[f64], vertices: usize, out: &mut Vec<[u32; 3]>) -> Result<(), Problem> {
    for (number, corners) in strip.windows(3).enumerate() {
        let [a, b, c] = [0, 1, 2].map(|k| corner(corners[k], vertices));
        out.push(if number % 2 == 0 { [a?, b?, c?] } else { [b?, a?, c?] });
    }
    Ok(())
}

/// A corner index, checked.
fn corner(value: f64, vertices: usize) -> Result<u32, Problem> {
    if value.fract() == 0.0 && (0.0..vertices as f64).contains(&value) {
        return Ok(value as u32);
    }
    Err(Problem::Index { index: value as i64, vertices })
}
