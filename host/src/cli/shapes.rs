//! Training shapes and targets, as `train` and `evaluate` take them: read, checked for themselves and together.

use super::scatter::Scatter;
use super::{Failure, bar};
use crate::check::training;
use crate::io::{self, Loaded, limit};
use crate::mesh::Mesh;
use crate::train::align::{self, Align, Aligned, Way};
use crate::train::strangers::Stranger;
use crate::train::{self, grid};
use crate::unit;
use lacuna::format::Unit;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Meshes that can be used.
pub(super) struct Shapes {
    /// Their files.
    pub paths: Vec<PathBuf>,
    /// Checked and repaired.
    pub meshes: Vec<Mesh>,
    /// What was found, with the file's name.
    pub notes: Vec<String>,
}

/// Reads a training set and refuses what cannot be trained on, in any spacing or in this one.
pub(super) fn training_set(inputs: &[PathBuf], settings: &train::Settings) -> Result<Shapes, Failure> {
    let (paths, loaded) = read(inputs)?;
    let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    let set = training::set(loaded, &names, settings.unit)?;
    let notes = told(set.findings.iter().map(|(number, text)| (names[*number].as_str(), text.as_str())));
    let (numbers, meshes): (Vec<usize>, Vec<Mesh>) = set.shapes.into_iter().unzip();
    grid::check(&meshes, settings)?;
    Ok(Shapes { paths: numbers.iter().map(|&number| paths[number].clone()).collect(), meshes, notes })
}

/// More shapes than this of which the same is said share a sentence.
const FEW: usize = 3;

/// What was found of files, in sentences.
fn told<'a>(findings: impl Iterator<Item = (&'a str, &'a str)>) -> Vec<String> {
    let mut by_text: Vec<(&str, Vec<&str>)> = Vec::new();
    for (name, text) in findings {
        match by_text.iter_mut().find(|(other, _)| *other == text) {
            Some((_, names)) => names.push(name),
            None => by_text.push((text, vec![name])),
        }
    }
    let sentences = |(text, names): (&str, Vec<&str>)| -> Vec<String> {
        if names.len() > FEW {
            return vec![format!("{} and {} more: {text}", names[0], names.len() - 1)];
        }
        names.iter().map(|name| format!("{name}: {text}")).collect()
    };
    by_text.into_iter().flat_map(sentences).collect()
}

/// Reads complete meshes that a model of the `shapes` is to approximate, each once.
pub(super) fn targets(inputs: &[PathBuf], shapes: &[Mesh], unit: Unit) -> Result<Shapes, Failure> {
    let (paths, loaded) = read(inputs)?;
    let files: Vec<Option<PathBuf>> = paths.iter().map(|path| path.canonicalize().ok()).collect();
    let twice = |number: &usize| files[*number].is_some() && files[..*number].contains(&files[*number]);
    if let Some(twice) = (0..paths.len()).find(twice) {
        return Err(format!("{}: given twice as a target: name it once", paths[twice].display()).into());
    }
    let mut found = Shapes { paths, meshes: Vec::new(), notes: Vec::new() };
    for (path, target) in found.paths.iter().zip(loaded) {
        let name = path.display();
        let checked = training::target(target, shapes, unit).usable();
        let (mesh, notes) = checked.map_err(|refused| format!("{name}: {refused}"))?;
        found.meshes.push(mesh);
        found.notes.extend(notes.iter().map(|note| format!("{name}: {note}")));
    }
    Ok(found)
}

/// The shapes in one pose.
pub(super) fn aligned(
    shapes: &[Mesh],
    paths: &[PathBuf],
    (mode, seed): (Align, u64),
) -> Result<Aligned, Failure> {
    let progress = bar(shapes.len() as u64, "aligning");
    let aligned = align::align(shapes, mode, seed, &|done, _| progress.set_position(done));
    progress.finish_and_clear();
    aligned.map_err(|error| match error {
        align::Error::NoSurface(n) | align::Error::Turned(n) | align::Error::NoMatch { number: n, .. } => {
            named(paths, n, &error)
        }
        align::Error::OddFirst { .. } => named(paths, 0, &error),
    })
}

/// An error with the file of the shape it belongs to.
pub(super) fn named(paths: &[PathBuf], number: usize, error: &dyn std::error::Error) -> Failure {
    format!("{}: {error}", name(paths, number)).into()
}

/// The name of a shape's file.
pub(super) fn name(paths: &[PathBuf], number: usize) -> String {
    paths.get(number).map_or("?".into(), |path| path.display().to_string())
}

/// What is to be said about how the shapes lie.
pub(super) fn lay(aligned: &Aligned, paths: &[PathBuf], unit: Unit) -> Vec<String> {
    let kept = match aligned.way {
        Way::Kept(far) => Some(format!(
            "the shapes lie in one pose and were left as they lie: drawn to their mean, by {}, they would lie farther apart; \
             --align always searches for their poses",
            Scatter::from(far).sentence(unit::symbol(unit))
        )),
        Way::Drawn(_) | Way::Left | Way::Searched => None,
    };
    kept.into_iter().chain(aligned.strangers.iter().map(|one| stranger(one, aligned.way, paths))).collect()
}

/// A sentence about a shape that does not lie where most do, although they are trained on together.
fn stranger(stranger: &Stranger, way: Way, paths: &[PathBuf]) -> String {
    let advice = if way == Way::Searched {
        "is it of the same class? If not, leave it out; if it is, bring all into one pose and give --align never"
    } else {
        "is it of the same class, and in one pose (--align)?"
    };
    format!(
        "{}: only {:.0} % of it and {} lie together, as most others do: {advice}",
        name(paths, stranger.number),
        100.0 * stranger.overlap,
        name(paths, stranger.pattern),
    )
}

fn read(inputs: &[PathBuf]) -> Result<(Vec<PathBuf>, Vec<Loaded>), Failure> {
    let paths = expand(inputs)?;
    limit::check_all(&paths)?;
    let loaded = paths.par_iter().map(|path| io::read_noted(path)).collect::<Result<_, _>>()?;
    Ok((paths, loaded))
}

/// Files, and the meshes in folders, in the order of their names.
fn expand(inputs: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut paths = Vec::new();
    for input in inputs {
        if !input.is_dir() {
            paths.push(input.clone());
            continue;
        }
        let found = in_folder(input, &MESHES)?;
        if found.is_empty() {
            return Err(format!("the folder {} holds no meshes (ply, obj, stl)", input.display()).into());
        }
        paths.extend(found);
    }
    Ok(paths)
}

/// Endings of files that hold meshes.
pub(super) const MESHES: [&str; 3] = ["ply", "obj", "stl"];

/// The files in a folder whose names have one of some endings, in the order of their names.
pub(super) fn in_folder(folder: &Path, endings: &[&str]) -> Result<Vec<PathBuf>, Failure> {
    let is_one = |path: &PathBuf| {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        ending.is_some_and(|ending| endings.contains(&&*ending))
    };
    let entries = std::fs::read_dir(folder)
        .map_err(|error| format!("cannot read the folder {}: {error}", folder.display()))?;
    let mut found: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(is_one).collect();
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::told;

    #[test]
    fn what_is_found_of_many_files_is_one_sentence() {
        let found = [("a", "inwards"), ("b", "flat"), ("b", "inwards"), ("c", "inwards")];
        let few = ["a: inwards", "b: inwards", "c: inwards", "b: flat"];
        assert_eq!(told(found.into_iter()), few);
        let many = found.into_iter().chain([("d", "inwards")]);
        assert_eq!(told(many), ["a and 3 more: inwards", "b: flat"]);
    }
}
