//! A scan that does not fit: would it, turned inside out or mirrored? Asked only after a bad fit, and only told.

use crate::complete::Error;
use crate::complete::explained::Explained;
use crate::mesh::Mesh;
use crate::normals::neighbours;
use crate::register::{self, Registration, rank::SIZES};
use lacuna::Model;

/// A change of the scan with which it fits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alternative {
    /// Its triangles or normals the other way round.
    Flipped,
    /// Its mirror image.
    Mirrored,
    /// The mirror image of its coordinates, with the winding as it is: an axis was reversed in the export.
    Reversed,
}

/// Where a pose explains less than this share of a scan without tables and walls, clutter or another kind of object is most
/// of it: a raw photogrammetry scan with hair and shoulders 0.33, half a head with shoulders 0.26 to 0.36.
pub const DOUBTFUL: f64 = 0.5;
/// Cosine between normals that go with each other.
const SMOOTH: f64 = 0.7;
/// Least share of the scan that an alternative must explain.
const CONVINCING: f64 = 0.6;
/// By how much that share must exceed the one that was explained without it.
const GAIN: f64 = 0.25;

impl Alternative {
    /// The scan after this change.
    pub fn of(self, scan: &Mesh) -> Mesh {
        let mut mesh = scan.clone();
        if self != Self::Flipped {
            mesh.points.iter_mut().for_each(|p| p.x = -p.x);
            mesh.normals.iter_mut().for_each(|n| n.x = -n.x);
        }
        match self {
            Self::Reversed => mesh.normals.iter_mut().for_each(|n| *n = -*n),
            Self::Mirrored => mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2)),
            Self::Flipped => {
                mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
                mesh.normals.iter_mut().for_each(|n| *n = -*n);
            }
        }
        mesh
    }

    fn advice(self) -> &'static str {
        match self {
            Self::Flipped => {
                "with its triangles (of a cloud, its normals) the other way round it would fit: --flip turns them"
            }
            Self::Mirrored => {
                "its mirror image would fit: is it the other side of the body, or was an axis \
                 reversed in the export?"
            }
            Self::Reversed => {
                "its mirror image, turned inside out, would fit: an axis was reversed in the export"
            }
        }
    }
}

/// As [`advice`], on a pose that was found.
pub fn advice_on(model: &Model<'_>, scan: &Mesh, seed: u64, found: &Registration) -> Option<String> {
    if Explained::from(found).is_of_the_class() {
        return None;
    }
    advice(model, scan, seed, (found.explained(), found.placed.size(model)))
}

/// Why a scan cannot be completed, and what would make it fit, if anything would.
pub fn told(model: &Model<'_>, scan: &Mesh, seed: u64, error: &Error) -> String {
    let nowhere =
        matches!(error, Error::Register(register::Error::NoMatch) | Error::Fit(lacuna::Error::EmptyHull));
    match (nowhere && is_a_surface(scan)).then(|| advice(model, scan, seed, (0.0, 1.0))).flatten() {
        Some(advice) => format!("{error} Or: {advice}"),
        None => error.to_string(),
    }
}

/// Whether most of a scan's normals go with those beside them. Of noise, and of triangles at random, half of them do not; no
/// search need be made for these.
fn is_a_surface(scan: &Mesh) -> bool {
    let pairs = neighbours(&scan.points, &scan.vertex_normals(), 1);
    2 * pairs.iter().filter(|pair| pair.cosine > SMOOTH).count() > pairs.len()
}

/// What would make a scan fit, if it is doubtful whether it does in the pose that was found: so much of it `explained`, tables
/// and walls aside, and `size` times as large as the class. As a sentence; none if nothing would, or if it fits.
pub fn advice(model: &Model<'_>, scan: &Mesh, seed: u64, (explained, size): (f64, f64)) -> Option<String> {
    let before = in_a_possible_size(explained, size);
    if before >= DOUBTFUL {
        return None;
    }
    [Alternative::Flipped, Alternative::Mirrored, Alternative::Reversed].into_iter().find_map(|alternative| {
        let found = register::glance(model, &alternative.of(scan), seed).ok()?;
        let after = in_a_possible_size(found.explained(), found.placed.size(model));
        let convinces = after >= CONVINCING && after >= before + GAIN;
        let instead = if before > 0.0 { format!(" instead of {:.0}", 100.0 * before) } else { String::new() };
        let share = 100.0 * after;
        convinces
            .then(|| format!("{} ({share:.0}{instead} % of it, in a possible size)", alternative.advice()))
    })
}

/// What a pose explains of a scan, which is nothing in an impossible size: a shape of many times the size explains a scan
/// that is inside out.
fn in_a_possible_size(explained: f64, size: f64) -> f64 {
    if SIZES.contains(&size) { explained } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::shapes::ball;
    use crate::synth::{Head, Random};

    #[test]
    fn triangles_at_random_are_no_surface_and_one_inside_out_is() {
        let ball = ball(24, 9.0);
        let mut shuffled = ball.clone();
        let mut random = Random::new(1, 1);
        let count = ball.points.len() as f64;
        shuffled.triangles.iter_mut().flatten().for_each(|v| *v = random.range(0.0, count) as u32);
        let told = [ball.clone(), Alternative::Flipped.of(&ball), shuffled].map(|mesh| is_a_surface(&mesh));
        assert_eq!(told, [true, true, false]);
    }

    #[test]
    fn where_no_pose_is_found_it_is_told_what_would_make_the_scan_fit() {
        let model = Model::from_bytes(lacuna_fixtures::MODEL).expect("the built-in model");
        let inwards = Alternative::Flipped.of(&Head::sample(1, 1001).mesh());
        let said = |error| told(&model, &inwards, 1, &error);
        assert!(said(register::Error::NoMatch.into()).contains("--flip turns them"));
        assert!(said(Error::Fit(lacuna::Error::EmptyHull)).contains("--flip turns them"));
        assert!(!said(register::Error::TooFewPoints(3).into()).contains("--flip"));
    }
}
