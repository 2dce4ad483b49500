//! A training shape that is another one again, moved or mirrored, with the same vertices. It counts twice, and of a shape whose
//! twin is trained on, the errors that the calibration finds are too small.

use crate::mesh::{Mesh, Point};
use crate::picks::evenly;
use crate::register::umeyama::similarity;

/// Vertices that are compared.
const ASKED: usize = 500;
/// Largest distance of a twin's vertices, in its size: coordinates are written with five digits or more. (Two of ninety faces
/// with the same triangles are 0.03 apart.)
const APART: f64 = 5e-5;

/// What is compared of a shape.
pub struct Picked {
    vertices: usize,
    points: Vec<Point>,
}

/// How a shape is another one again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Twin {
    /// By a similarity transform.
    Moved,
    /// By one and a mirror.
    Mirrored,
}

impl Picked {
    /// Of a mesh.
    pub fn of(mesh: &Mesh) -> Self {
        let vertices = mesh.points.len();
        Self { vertices, points: evenly(vertices, ASKED).map(|i| mesh.points[i]).collect() }
    }

    /// Whether this is the other one again.
    pub fn twin(&self, other: &Self) -> Option<Twin> {
        if self.vertices != other.vertices {
            return None;
        }
        let with = |x: f64| other.points.iter().map(move |p| Point::new(x * p.x, p.y, p.z));
        let lies_on = |points: &mut dyn Iterator<Item = Point>| {
            let pairs: Vec<(Point, Point)> = self.points.iter().copied().zip(points).collect();
            similarity(&pairs).is_some_and(|motion| {
                let largest = |all: &mut dyn Iterator<Item = f64>| all.fold(0.0, f64::max);
                let size = largest(&mut pairs.iter().map(|(_, q)| (q - pairs[0].1).norm()));
                largest(&mut pairs.iter().map(|(p, q)| (motion * p - q).norm())) <= APART * size
            })
        };
        if lies_on(&mut with(1.0)) {
            return Some(Twin::Moved);
        }
        lies_on(&mut with(-1.0)).then_some(Twin::Mirrored)
    }
}

/// Which of some shapes are earlier ones again, and a sentence about each with the other one's name.
pub fn told(shapes: &[&Picked], name: &dyn Fn(usize) -> String) -> Vec<(usize, String)> {
    let twin = |(at, shape): (usize, &&Picked)| {
        let (earlier, twin) =
            shapes[..at].iter().enumerate().find_map(|(n, other)| Some((n, shape.twin(other)?)))?;
        let how = match twin {
            Twin::Moved => "the same shape as",
            Twin::Mirrored => "the mirror image of",
        };
        let what = format!("it is {how} {}, vertex for vertex", name(earlier));
        let follows =
            "trained on together they count twice, and expected errors come out too small; leave one out";
        Some((at, format!("{what}: {follows}")))
    };
    shapes.iter().enumerate().filter_map(twin).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Head;
    use nalgebra::{Similarity3, UnitQuaternion, Vector3};

    #[test]
    fn a_shape_that_is_another_one_moved_or_mirrored_is_told_and_a_bent_one_is_not() {
        let head = Head::sample(5, 0).mesh();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -2.0, 0.3));
        let motion = Similarity3::from_parts(Vector3::new(3.0, -2.0, 500.0).into(), turn, 1.2);
        let changed = |change: &dyn Fn(&Point) -> Point| {
            Picked::of(&Mesh { points: head.points.iter().map(change).collect(), ..head.clone() })
        };
        // As text files have them.
        let written = |p: Point| p.map(|c| (c * 1e3).round() / 1e3);
        let moved = changed(&|p| written(motion * p));
        let mirrored = changed(&|p| written(motion * Point::new(p.x, -p.y, p.z)));
        let bent = changed(&|p| motion * Point::new(p.x + 1e-5 * p.y * p.y, p.y, p.z));
        let own = Picked::of(&head);
        assert_eq!(
            [&own, &moved, &mirrored, &bent].map(|other| other.twin(&own)),
            [Some(Twin::Moved), Some(Twin::Moved), Some(Twin::Mirrored), None]
        );
        let told = told(&[&own, &bent, &mirrored, &moved], &|number| format!("head {number}"));
        let starts = ["it is the mirror image of head 0,", "it is the same shape as head 0,"];
        assert_eq!(told.iter().map(|(number, _)| *number).collect::<Vec<_>>(), [2, 3]);
        assert!(told.iter().zip(starts).all(|((_, text), start)| text.starts_with(start)), "{told:?}");
    }

    #[test]
    fn shapes_of_as_many_vertices_are_no_twins() {
        let [one, other] = [0, 1].map(|number| Picked::of(&Head::sample(5, number).mesh()));
        assert_eq!(one.twin(&other), None);
        assert_eq!(Picked::of(&Mesh::default()).twin(&Picked::of(&Mesh::default())), None);
    }
}
