//! Training shapes together: copies, mixed units, a file that is not like the others.

use super::twins::{self, Picked};
use super::{Checked, Flat, Refused, counted};
use crate::correspondence;
use crate::io::Loaded;
use crate::mesh::Mesh;
use crate::quantile::median;
use crate::size;
use crate::surface::{keep_triangles, specks};
use lacuna::format::Unit;

/// Sizes farther than this factor from the usual one are not of one class in one unit.
const SPREAD: f64 = 4.0;
/// Farthest from the origin, in extents: the model's origin is stored in single precision.
const FAR: f64 = 1e4;

/// Training shapes that were looked at.
pub struct Set {
    /// The shapes to train on, repaired, with the number of each in the list given.
    pub shapes: Vec<(usize, Mesh)>,
    /// What was found, with the number of the shape.
    pub findings: Vec<(usize, String)>,
}

/// Looks at every shape and at all of them together. Copies are left out; `names` are for the messages.
///
/// # Errors
/// The first shape that cannot be used, with its name, or too few of them.
pub fn set(shapes: Vec<Loaded>, names: &[String], unit: Unit) -> Result<Set, Refused> {
    let name = |number: usize| names.get(number).map_or("a training shape", String::as_str);
    let (mut kept, mut findings): (Vec<(usize, Mesh)>, Vec<_>) = (Vec::new(), Vec::new());
    // Vertices that correspond do so as long as no mesh loses triangles of its own.
    let flat = if correspond(&shapes) { Flat::Kept } else { Flat::LeftOut };
    let mut copies = 0;
    for (number, shape) in shapes.into_iter().enumerate() {
        let checked = single(shape, flat);
        let (mesh, notes) = checked.usable().map_err(|e| Refused(format!("{}: {e}", name(number))))?;
        findings.extend(notes.into_iter().map(|note| (number, note)));
        if let Some((twin, _)) = kept.iter().find(|(_, other)| *other == mesh) {
            findings.push((number, format!("the same shape as {}; left out", name(*twin))));
            copies += 1;
            continue;
        }
        kept.push((number, mesh));
    }
    if kept.len() < 2 {
        return Err(Refused(too_few(kept.len(), copies)));
    }
    sizes(&kept, unit).map_err(|(number, text)| Refused(format!("{}: {text}", name(number))))?;
    let picked: Vec<Picked> = kept.iter().map(|(_, mesh)| Picked::of(mesh)).collect();
    let twins = twins::told(&picked.iter().collect::<Vec<_>>(), &|at| name(kept[at].0).into());
    findings.extend(twins.into_iter().map(|(at, text)| (kept[at].0, text)));
    // They are of one size: a sentence about the first is enough.
    let (number, first) = &kept[0];
    findings.extend(size::unusual(size::of_mesh(first), unit).map(|text| (*number, text)));
    Ok(Set { shapes: kept, findings })
}

/// A shape that models of the `shapes` are to approximate: for itself, its size, and whether it is one of them.
pub fn target(target: Loaded, shapes: &[Mesh], unit: Unit) -> Checked {
    let corresponds = shapes.first().is_some_and(|first| correspondence::correspond(first, &target.mesh));
    let mut checked = single(target, if corresponds { Flat::Kept } else { Flat::LeftOut });
    if checked.is_refused() {
        return checked;
    }
    let lengths = shapes.iter().map(size::of_mesh).collect();
    let usual = median(lengths).unwrap_or_else(|| size::of_mesh(&checked.mesh));
    if let Some(text) = misfit(size::of_mesh(&checked.mesh), usual, unit) {
        checked.refused(text);
    } else if shapes.contains(&checked.mesh) {
        checked.note(
            "it is one of the training shapes: how well others are approximated it does not tell".into(),
        );
    }
    checked
}

/// Whether all meshes have the same triangles.
fn correspond(shapes: &[Loaded]) -> bool {
    shapes.windows(2).all(|pair| correspondence::correspond(&pair[0].mesh, &pair[1].mesh))
}

/// One training shape for itself.
fn single(shape: Loaded, flat: Flat) -> Checked {
    let (mut checked, pieces) = super::mesh_with(shape, flat);
    if flat == Flat::LeftOut && !checked.is_refused() {
        leave_specks_out(&mut checked, &pieces);
    }
    if checked.mesh.triangles.is_empty() && !checked.is_refused() {
        checked.refused("it has no triangles: a model is trained on meshes, not on points".into());
    }
    checked.note_inwards();
    let far = checked
        .mesh
        .bounds()
        .map_or(0.0, |(low, high)| low.coords.abs().sup(&high.coords.abs()).max() / (high - low).max());
    if far > FAR && !checked.is_refused() {
        checked.refused(format!("it lies {far:.0} times its size from the origin: move it there first"));
    }
    checked
}

/// Leaves out the specks among the pieces: nobody looks at a training shape's again, and a single one would make the grid
/// larger and be learned.
fn leave_specks_out(checked: &mut Checked, pieces: &[u32]) {
    let specks = specks(pieces);
    let before = checked.mesh.triangles.len();
    checked.mesh = keep_triangles(&checked.mesh, |i| !specks[pieces[i] as usize]);
    let left_out = before - checked.mesh.triangles.len();
    if left_out > 0 {
        checked
            .repaired(format!("{} left out", counted(left_out, "triangle of specks", "triangles of specks")));
    }
}

fn too_few(different: usize, copies: usize) -> String {
    let what = counted(different, "different training shape", "different training shapes");
    let why = if copies > 0 { " (copies count once)" } else { "" };
    format!("a model needs at least 2 different shapes, there is {what}{why}: add meshes")
}

/// Finds a shape whose size is not that of the others.
fn sizes(shapes: &[(usize, Mesh)], unit: Unit) -> Result<(), (usize, String)> {
    let lengths: Vec<f64> = shapes.iter().map(|(_, mesh)| size::of_mesh(mesh)).collect();
    odd_sizes(&lengths, unit).into_iter().next().map_or(Ok(()), |(odd, text)| Err((shapes[odd].0, text)))
}

/// Which of some lengths are not those of shapes of one class in one unit, and what is wrong about each.
pub fn odd_sizes(lengths: &[f64], unit: Unit) -> Vec<(usize, String)> {
    let mut ascending = lengths.to_vec();
    ascending.sort_unstable_by(f64::total_cmp);
    // One that is there: between two groups in different units nothing is.
    let Some(&usual) = ascending.get(ascending.len() / 2) else { return vec![] };
    let odd = |(number, &length): (usize, &f64)| Some((number, misfit(length, usual, unit)?));
    lengths.iter().enumerate().filter_map(odd).collect()
}

/// What is wrong about a length among shapes of another one.
fn misfit(length: f64, usual: f64, unit: Unit) -> Option<String> {
    let ratio = length / usual;
    if (1.0 / SPREAD..=SPREAD).contains(&ratio) {
        return None;
    }
    let hint = size::unit_of(ratio, unit);
    let hint = hint.map_or("is it of the same class and in the same unit?".into(), |_| {
        format!("it seems to be in another unit than the others ({ratio:.4} times their size): convert it")
    });
    Some(format!("it is {length:.4} long, the others {usual:.4}; {hint}"))
}
