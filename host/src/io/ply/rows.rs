//! Rows of a PLY table: their least size, their values, their lists.

use super::fixed;
use super::header::{Element, Property};
use super::source::Source;
use crate::io::error::{Fault, Problem};

/// Refuses an element that cannot fit into what is left, before anything is reserved for it.
pub(super) fn check_room<'a>(source: &impl Source<'a>, element: &Element) -> Result<(), Fault> {
    let least = |property: &Property| source.least(property.length_kind.unwrap_or(property.kind));
    let row: usize = element.properties.iter().map(least).sum();
    let needed = row.saturating_mul(element.count);
    if needed > source.left() {
        let what = match element.name.as_str() {
            "vertex" => "the vertex table",
            "face" => "the face table",
            _ => "a table",
        };
        let problem = Problem::Truncated { what, needed: needed as u64, left: source.left() as u64 };
        return Err(Fault { place: source.place(), problem });
    }
    Ok(())
}

/// Steps over an element.
pub(super) fn skip<'a>(source: &mut impl Source<'a>, element: &Element) -> Result<(), Fault> {
    if element.properties.is_empty() {
        return Ok(());
    }
    if let Some(stride) = fixed::stride(element)
        && source.rows(element, stride).is_some()
    {
        return Ok(());
    }
    (0..element.count).try_for_each(|_| row(source, element, |_, _| {}))
}

/// Reads one row; `take` gets the number of each property that is no list, and its value.
pub(super) fn row<'a>(
    source: &mut impl Source<'a>,
    element: &Element,
    mut take: impl FnMut(usize, f64),
) -> Result<(), Fault> {
    for (number, property) in element.properties.iter().enumerate() {
        match list_length(source, property)? {
            Some(length) => source.skip(property.kind, length)?,
            None => take(number, source.value(property.kind)?),
        }
    }
    source.end_row()
}

/// The length in front of a list; none if the property is no list.
fn list_length<'a>(source: &mut impl Source<'a>, property: &Property) -> Result<Option<usize>, Fault> {
    let Some(kind) = property.length_kind else { return Ok(None) };
    let place = source.place();
    let length = source.value(kind)?;
    if length < 0.0 || length.fract() != 0.0 || !length.is_finite() {
        let problem = Problem::Other(format!("a list has the length {length}; export the file again"));
        return Err(Fault { place, problem });
    }
    Ok(Some(length as usize))
}

/// Reads one row and keeps the list that is property `number`.
pub(super) fn index_row<'a>(
    source: &mut impl Source<'a>,
    element: &Element,
    number: usize,
    list: &mut Vec<f64>,
) -> Result<(), Fault> {
    list.clear();
    for (n, property) in element.properties.iter().enumerate() {
        let length = list_length(source, property)?;
        if n != number {
            source.skip(property.kind, length.unwrap_or(1))?;
            continue;
        }
        for _ in 0..length.unwrap_or(0) {
            list.push(source.value(property.kind)?);
        }
    }
    source.end_row()
}
