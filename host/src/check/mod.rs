//! Checks before work: what is odd about a mesh, what of it is repaired, and what cannot be used.
//!
//! [`mesh`] looks at one mesh, [`scan`] at a scan and the size of the model it is meant for, [`training::set`] at
//! training shapes together. What is repaired leaves the measured surface as it is: only triangles that cover
//! nothing, copies, unused vertices and contradicting winding are touched.

pub mod alternatives;
mod amount;
mod copies;
mod edges;
mod filled;
mod fits;
pub mod inwards;
mod needles;
mod origin;
mod signs;
mod soup;
mod strays;
pub mod training;
mod triangles;
pub mod twins;
mod vertices;
mod winding;

use crate::io::Loaded;
use crate::mesh::Mesh;
use crate::surface::Edges;
use serde::Serialize;
pub use winding::encloses;

/// What follows from a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Worth knowing, nothing was changed.
    Note,
    /// Repaired without touching the measured surface.
    Repaired,
    /// The data cannot be used.
    Refused,
}

/// Something odd about a mesh: what, how much, and what to do.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// What follows from it.
    pub severity: Severity,
    /// A sentence without a full stop.
    pub text: String,
}

/// A mesh that was looked at.
#[derive(Clone, Debug, Default)]
pub struct Checked {
    /// The mesh, repaired.
    pub mesh: Mesh,
    /// What was found, in the order of the checks.
    pub findings: Vec<Finding>,
}

/// Data that cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Refused(String);

impl Checked {
    /// Adds something worth knowing.
    fn note(&mut self, text: String) {
        self.findings.push(Finding { severity: Severity::Note, text });
    }

    /// Adds a repair.
    fn repaired(&mut self, text: String) {
        self.findings.push(Finding { severity: Severity::Repaired, text });
    }

    /// Adds a reason not to use the mesh.
    fn refused(&mut self, text: String) {
        self.findings.push(Finding { severity: Severity::Refused, text });
    }

    /// Adds a note on a mesh that seems to be inside out.
    fn note_inwards(&mut self) {
        if !self.is_refused() {
            inwards::advice(&self.mesh).into_iter().for_each(|text| self.note(text));
        }
    }

    /// Whether the mesh cannot be used.
    pub fn is_refused(&self) -> bool {
        self.findings.iter().any(|finding| finding.severity == Severity::Refused)
    }

    /// The mesh and the sentences about it, if it can be used.
    ///
    /// # Errors
    /// The first reason against it.
    pub fn usable(self) -> Result<(Mesh, Vec<String>), Refused> {
        let refused = self.findings.iter().find(|finding| finding.severity == Severity::Refused);
        match refused {
            Some(finding) => Err(Refused(finding.text.clone())),
            None => Ok((self.mesh, self.findings.into_iter().map(|finding| finding.text).collect())),
        }
    }
}

/// Looks at a mesh or cloud for itself; what was repaired while it was read is the first that was found.
pub fn mesh(loaded: Loaded) -> Checked {
    mesh_with(loaded, Flat::LeftOut).0
}

/// What becomes of triangles without area.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Flat {
    LeftOut,
    /// They stay, and vertices are not joined: those of several meshes correspond.
    Kept,
}

/// The mesh that was looked at and, unless that cannot be used, the number of each triangle's piece.
fn mesh_with(loaded: Loaded, flat: Flat) -> (Checked, Vec<u32>) {
    let mut checked = Checked { mesh: loaded.mesh, findings: Vec::new() };
    loaded.repairs.into_iter().for_each(|text| checked.repaired(text));
    origin::check(&mut checked);
    if checked.mesh.triangles.is_empty() {
        if !checked.is_refused() {
            copies::check(&mut checked);
            strays::check(&mut checked);
            signs::check(&mut checked);
        }
        return (checked, vec![]);
    }
    if flat == Flat::LeftOut {
        soup::check(&mut checked);
    }
    let either_way = triangles::check(&mut checked, flat);
    if checked.is_refused() {
        return (checked, vec![]);
    }
    if flat == Flat::LeftOut {
        needles::check(&mut checked);
    }
    vertices::check(&mut checked);
    let edges = Edges::of(&checked.mesh);
    let pieces = edges::check(&mut checked, &edges, flat);
    winding::check(&mut checked, &edges, either_way);
    (checked, pieces)
}

/// As [`mesh`], for a mesh that may be meant for training.
pub fn lone_mesh(loaded: Loaded) -> Checked {
    let mut checked = mesh(loaded);
    checked.note_inwards();
    checked
}

/// Looks at a scan in the model's unit: for itself, then at its size and amount; `unit` is the one it was taken to be in.
pub fn scan(scan: Loaded, model: &lacuna::Model<'_>, unit: lacuna::format::Unit) -> Checked {
    let mut checked = mesh(scan);
    if !checked.is_refused() {
        fits::check(&mut checked, model, unit);
    }
    if !checked.is_refused() {
        amount::check(&mut checked, model);
    }
    if !checked.is_refused() {
        filled::check(&mut checked);
    }
    checked
}

/// "1 triangle", "2 triangles".
fn counted(count: usize, what: &str, many: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {many}") }
}

#[cfg(test)]
mod tests;
