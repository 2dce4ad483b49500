//! What the columns after x y z of a text cloud are: normals, or something that has no place in a cloud.

use super::finish::is_finite;
use crate::mesh::{Mesh, Vector};

/// How far from one the length of a normal may be that was written with two digits.
const UNIT: f64 = 0.02;
/// Share of the vertices that must have a normal of unit length: clouds lack some at holes and edges.
const NEARLY_ALL: f64 = 0.9;

/// The values after x y z of all lines.
pub(super) struct Further {
    /// Values a line.
    pub count: usize,
    /// Line by line.
    pub values: Vec<f64>,
}

impl Further {
    /// Gives the mesh its normals, and tells which columns are left out, if any are.
    pub fn take_normals(&self, mesh: &mut Mesh) -> Option<String> {
        let normals = self.normals(mesh);
        if let Some(first) = normals {
            mesh.normals = self.vectors(first).collect();
        }
        let taken = normals.map_or(0..0, |first| first..first + 3);
        let left: Vec<usize> = (0..self.count).filter(|column| !taken.contains(column)).collect();
        if left.is_empty() {
            return None;
        }
        let normals = normals.map_or("there are no normals".into(), |first| {
            format!("columns {} to {} are taken for normals", first + 4, first + 6)
        });
        Some(format!("{} left out: the first three columns are taken for x y z, {normals}", named(&left)))
    }

    /// The first of the three columns that hold normals.
    fn normals(&self, mesh: &Mesh) -> Option<usize> {
        if self.count < 3 {
            return None;
        }
        // Three columns alone may hold normals of any length: only colours can be mistaken for them.
        if self.count == 3 {
            return (!self.are_colours(mesh)).then_some(0);
        }
        let shares = (0..=self.count - 3).map(|first| (first, self.unit_share(first, mesh)));
        let (first, share) = shares.reduce(|best, next| if next.1 > best.1 { next } else { best })?;
        (share >= NEARLY_ALL).then_some(first)
    }

    fn vectors(&self, first: usize) -> impl Iterator<Item = Vector> {
        self.values
            .chunks_exact(self.count)
            .map(move |row| Vector::new(row[first], row[first + 1], row[first + 2]))
    }

    /// Share of the vertices whose vector has unit length; those without a place are not asked.
    fn unit_share(&self, first: usize, mesh: &Mesh) -> f64 {
        let placed = || mesh.points.iter().zip(self.vectors(first)).filter(|(point, _)| is_finite(point));
        let unit = placed().filter(|(_, vector)| (vector.norm() - 1.0).abs() <= UNIT).count();
        unit as f64 / placed().count().max(1) as f64
    }

    /// Whether the values are red, green and blue: whole numbers up to 255, not all 0 or 1; or from 0 to 1, and not of unit
    /// length.
    fn are_colours(&self, mesh: &Mesh) -> bool {
        let byte = |value: &f64| (0.0..=255.0).contains(value) && value.fract() == 0.0;
        let known = || self.values.iter().filter(|value| !value.is_nan());
        if known().all(|value| (0.0..=1.0).contains(value)) {
            return self.unit_share(0, mesh) < NEARLY_ALL;
        }
        known().all(byte)
    }
}

/// "column 4", "columns 4 to 6 and 10": the further columns with these numbers, ascending.
fn named(columns: &[usize]) -> String {
    let runs = columns.chunk_by(|a, b| a + 1 == *b);
    let run = |run: &[usize]| match run {
        [one] => (one + 4).to_string(),
        [first, .., last] => format!("{} to {}", first + 4, last + 4),
        [] => String::new(),
    };
    let runs: Vec<String> = runs.map(run).collect();
    let word = if columns.len() == 1 { "column" } else { "columns" };
    format!("{word} {}", runs.join(" and "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Point;

    fn taken(rows: &[&[f64]]) -> (Vec<Vector>, Option<String>) {
        let points = (0..rows.len()).map(|i| Point::new(i as f64, 0.0, 0.0)).collect();
        let mut mesh = Mesh { points, ..Mesh::default() };
        let note = Further { count: rows[0].len(), values: rows.concat() }.take_normals(&mut mesh);
        (mesh.normals, note)
    }

    #[test]
    fn vectors_of_unit_length_are_normals_wherever_they_stand() {
        let normals = [Vector::new(0.6, 0.8, 0.0), Vector::new(0.0, 0.0, -1.0)];
        let layouts: [([&[f64]; 2], &str); 4] = [
            ([&[0.6, 0.8, 0.0, 17.0], &[0.0, 0.0, -1.0, 3.0]], "column 7 left out"),
            ([&[17.0, 0.6, 0.8, 0.0], &[3.0, 0.0, 0.0, -1.0]], "column 4 left out"),
            ([&[9.0, 8.0, 7.0, 0.6, 0.8, 0.0], &[1.0, 0.0, 0.0, 0.0, 0.0, -1.0]], "columns 4 to 6 left out"),
            (
                [&[9.0, 0.6, 0.8, 0.0, 5.0, 6.0], &[1.0, 0.0, 0.0, -1.0, 3.0, 3.0]],
                "columns 4 and 8 to 9 left out",
            ),
        ];
        for (rows, left) in layouts {
            let (found, note) = taken(&rows);
            assert_eq!(found, normals, "{left}");
            assert!(note.as_deref().is_some_and(|note| note.starts_with(left)), "{note:?}");
        }
    }

    #[test]
    fn intensity_and_colours_are_left_out_with_a_note() {
        for row in [&[0.5][..], &[0.5, 0.25], &[-1200.0, 255.0, 128.0, 0.0], &[200.0, 90.0, 80.0, 0.5]] {
            let (normals, note) = taken(&[row, row]);
            assert!(normals.is_empty(), "{row:?}");
            assert!(note.is_some_and(|note| note.ends_with("there are no normals")), "{row:?}");
        }
    }

    #[test]
    fn some_vertices_may_lack_their_normal() {
        let mut rows: Vec<&[f64]> = vec![&[0.0, 1.0, 0.0, 7.0]; 19];
        rows.push(&[0.0; 4]);
        assert_eq!(taken(&rows).0.len(), 20);
        rows.extend([&[0.0; 4][..]; 3]);
        assert!(taken(&rows).0.is_empty());
    }

    #[test]
    fn vertices_without_a_place_are_not_asked_for_normals() {
        let mut mesh =
            Mesh { points: vec![Point::origin(), Point::new(f64::NAN, 0.0, 0.0)], ..Mesh::default() };
        let values = vec![0.0, 0.0, 1.0, 5.0, f64::NAN, f64::NAN, f64::NAN, 0.0];
        assert!(Further { count: 4, values }.take_normals(&mut mesh).is_some());
        assert_eq!(mesh.normals.len(), 2);
    }

    #[test]
    fn three_further_columns_are_normals_of_any_length_or_colours() {
        assert_eq!(
            taken(&[&[0.0, 0.0, 2.0], &[0.0, -3.5, 0.0]]),
            (vec![Vector::z() * 2.0, -3.5 * Vector::y()], None)
        );
        for colours in [[[255.0, 128.0, 0.0], [0.0, 0.0, 1.0]], [[0.75, 0.5, 0.5], [0.25, 0.125, 1.0]]] {
            let (normals, note) = taken(&colours.each_ref().map(<[f64; 3]>::as_slice));
            assert!(normals.is_empty() && note.is_some(), "{colours:?}");
        }
        assert_eq!(taken(&[&[0.6, 0.8, 0.0], &[0.0, 0.0, 1.0]]).0.len(), 2);
    }
}
