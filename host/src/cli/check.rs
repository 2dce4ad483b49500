//! `lacuna check`.

use super::{Common, Failure, inputs, say, shapes};
use crate::check::training::odd_sizes;
use crate::check::twins::{self, Picked};
use crate::check::{self, Checked, Finding, Severity, alternatives};
use crate::complete::clean::clean;
use crate::complete::layers;
use crate::complete::noise::widest;
use crate::complete::verdict::{self, Grade};
use crate::io::{Loaded, depth};
use crate::register;
use crate::size;
use crate::unit;
use lacuna::Model;
use lacuna::format::Unit;
use std::path::{Path, PathBuf};

/// Look for what is wrong with scans or training meshes, without using them.
///
/// Exit code 1 if one of the files cannot be used.
#[derive(clap::Args)]
pub struct Check {
    /// Scans or meshes: PLY, OBJ, STL, PCD, XYZ, depth PNG, scan.json, or folders with one or with meshes
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Also whether they fit this model: size, amount of surface, pose
    #[arg(short, long)]
    model: Option<PathBuf>,
    /// Unit of the files, if it is not the model's: mm, m, in, um
    #[arg(long, value_parser = unit::parse, requires = "model")]
    unit: Option<Unit>,
    /// Seed of the search for the pose
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

#[derive(serde::Serialize)]
struct Report {
    file: String,
    usable: bool,
    vertices: usize,
    triangles: usize,
    /// Length of the sides of the bounding box, in the model's unit if there is one.
    extent: [f64; 3],
    /// Share of the scan that the best pose explains.
    inlier_share: Option<f64>,
    findings: Vec<Finding>,
    /// Its length, stray points aside.
    #[serde(skip)]
    length: f64,
    /// What others of its folder are compared with.
    #[serde(skip)]
    picked: Picked,
}

impl Check {
    /// Runs the subcommand.
    pub fn run(&self, common: &Common) -> Result<(), Failure> {
        let bytes = self.model.as_deref().map(|path| inputs::model_bytes(Some(path))).transpose()?;
        let model = bytes.as_deref().map(|bytes| inputs::model(bytes, self.model.as_deref())).transpose()?;
        let reports: Vec<Report> =
            self.files.iter().flat_map(|file| self.reports(file, model.as_ref())).collect();
        // The reason of a single file is the program's own complaint.
        let with_reasons = reports.len() > 1;
        if common.json {
            say(&serde_json::to_string_pretty(&reports)?);
        } else {
            reports.iter().for_each(|report| tell(report, with_reasons));
        }
        let refused = reports.iter().filter(|report| !report.usable).count();
        match reports.as_slice() {
            _ if refused == 0 => Ok(()),
            [one] => Err(reason(one).into()),
            all => Err(format!("{refused} of {} files cannot be used", all.len()).into()),
        }
    }

    /// A file, or all of a folder and how they go together: without a model they are meant for one, perhaps.
    fn reports(&self, path: &Path, model: Option<&Model<'_>>) -> Vec<Report> {
        let mut reports: Vec<Report> = listed(path).iter().map(|file| self.report(file, model)).collect();
        if model.is_some() {
            return reports;
        }
        let usable: Vec<usize> = (0..reports.len()).filter(|&i| reports[i].usable).collect();
        let lengths: Vec<f64> = usable.iter().map(|&i| reports[i].length).collect();
        let picked: Vec<&Picked> = usable.iter().map(|&i| &reports[i].picked).collect();
        let twins = twins::told(&picked, &|at| reports[usable[at]].file.clone());
        let sizes = odd_sizes(&lengths, Unit::Millimetre).into_iter().map(|(odd, text)| {
            (odd, format!("to be trained on with the others of its folder it must be of their size: {text}"))
        });
        for (at, text) in sizes.chain(twins) {
            reports[usable[at]].findings.push(Finding { severity: Severity::Note, text });
        }
        reports
    }

    fn report(&self, file: &Path, model: Option<&Model<'_>>) -> Report {
        let name = file.display().to_string();
        let mut inlier_share = None;
        let checked = match load(file) {
            Err(error) => Err(error.to_string()),
            Ok(Loaded { mesh, repairs }) => Ok(match model {
                None => check::lone_mesh(Loaded { mesh, repairs }),
                Some(model) => {
                    let own = model.header().unit;
                    let given = self.unit.unwrap_or(own);
                    let mesh = inputs::scaled(mesh, unit::millimetres(given) / unit::millimetres(own));
                    let mut checked = check::scan(Loaded { mesh, repairs }, model, given);
                    inlier_share = self.fit(model, &mut checked);
                    checked
                }
            }),
        };
        let checked = checked.unwrap_or_else(|text| {
            let text = text.strip_prefix(&format!("{name}: ")).unwrap_or(&text).to_owned();
            let findings = vec![Finding { severity: Severity::Refused, text }];
            Checked { findings, ..Checked::default() }
        });
        let extent = checked.mesh.bounds().map_or([0.0; 3], |(low, high)| (high - low).into());
        Report {
            file: name,
            usable: !checked.is_refused(),
            vertices: checked.mesh.points.len(),
            triangles: checked.mesh.triangles.len(),
            extent,
            inlier_share,
            findings: checked.findings,
            length: size::of_mesh(&checked.mesh),
            picked: Picked::of(&checked.mesh),
        }
    }

    /// Looks whether a usable scan lies anywhere in the model.
    fn fit(&self, model: &Model<'_>, checked: &mut Checked) -> Option<f64> {
        if checked.is_refused() {
            return None;
        }
        let scan = clean(&checked.mesh, widest(model)).scan;
        let refused = |text| Finding { severity: Severity::Refused, text };
        match register::register(model, &scan, self.seed) {
            Err(error) => {
                checked.findings.push(refused(alternatives::told(model, &scan, self.seed, &error.into())));
                None
            }
            Ok(found) => {
                let note = |text| Finding { severity: Severity::Note, text };
                let scale = found.placed.size(model);
                let millimetre = found.placed.class_millimetre(model);
                let layers = layers::apart(&checked.mesh, widest(model)).and_then(|apart| {
                    verdict::in_layers(apart, millimetre, unit::symbol(model.header().unit))
                });
                let odd = verdict::of_pose(&found, scale).chain(layers);
                let finding = |(grade, text)| if grade == Grade::Reject { refused(text) } else { note(text) };
                checked.findings.extend(odd.map(finding));
                let advice = alternatives::advice_on(model, &scan, self.seed, &found);
                checked.findings.extend(advice.map(note));
                Some(found.inliers)
            }
        }
    }
}

/// Endings of meshes and scans: of text clouds those that nothing else has.
const SCANS: [&str; 6] = ["ply", "obj", "stl", "pcd", "xyz", "pts"];

/// A file, or the meshes and clouds in a folder; a folder with depth images is a scan, an empty one has its error.
fn listed(path: &Path) -> Vec<PathBuf> {
    if !is_folder_of_meshes(path) {
        return vec![path.into()];
    }
    let meshes = shapes::in_folder(path, &SCANS).ok().filter(|meshes| !meshes.is_empty());
    meshes.unwrap_or_else(|| vec![path.into()])
}

fn is_folder_of_meshes(path: &Path) -> bool {
    path.is_dir() && !depth::is_in(path)
}

fn load(path: &Path) -> Result<Loaded, Failure> {
    if is_folder_of_meshes(path) && shapes::in_folder(path, &SCANS)?.is_empty() {
        let (path, endings) = (path.display(), SCANS.join(", "));
        return Err(
            format!("{path}: there is no mesh or cloud ({endings}) and no scan.json in this folder").into()
        );
    }
    inputs::scan(Some(path))
}

fn reason(report: &Report) -> String {
    let refused = report.findings.iter().find(|finding| finding.severity == Severity::Refused);
    let text = refused.map_or("", |finding| finding.text.as_str());
    if text.starts_with(&report.file) { text.into() } else { format!("{}: {text}", report.file) }
}

fn tell(report: &Report, with_reasons: bool) {
    if !report.usable {
        say(&format!("{}: cannot be used", report.file));
    } else {
        let [x, y, z] = report.extent;
        let counts = format!("{} vertices, {} triangles", report.vertices, report.triangles);
        let fit =
            report.inlier_share.map_or(String::new(), |s| format!(", best pose explains {:.0} %", 100.0 * s));
        say(&format!("{}: {counts}, {x:.4} x {y:.4} x {z:.4}{fit}", report.file));
    }
    for finding in report.findings.iter().filter(|f| with_reasons || f.severity != Severity::Refused) {
        say(&format!("  {}", finding.text));
    }
}
