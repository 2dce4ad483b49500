//! The report of a completed scan.

use super::histogram::{Distances, drawing};
use super::html::{self, escape};
use super::page::{Page, section};
use super::scene::{Scene, Surface};
use super::{columns, table};
use crate::complete::noise::Noise;
use crate::complete::{Completion, picture};
use crate::distance;
use crate::evaluate::mesh_digest;
use crate::mesh::{Mesh, Vector};
use crate::uncertainty::hidden;
use crate::uncertainty::spread::Spread;
use crate::unit::{self, digits};
use lacuna::Model;
use rayon::prelude::*;

/// What a report says besides the completion itself.
pub struct Subject<'a> {
    /// What the scan is called.
    pub scan: &'a str,
    /// The scan as it was read.
    pub original: &'a Mesh,
    /// From the scan as it is in its file to the model.
    pub scan_to_model: [[f64; 4]; 4],
    /// What was found about the scan before it was completed.
    pub notes: &'a [String],
    /// Names and values of the settings.
    pub settings: &'a [(&'a str, String)],
    /// What to type to repeat it.
    pub command: &'a str,
}

/// Distances that fill the scale of colours, class millimetres.
const RANGES: [f64; 3] = [1.0, 4.0, 16.0];
/// Distances shown in the histogram, class millimetres.
const SHOWN: f64 = 2.0;
/// Distances counted in it, class millimetres.
const COUNTED: f64 = 8.0;

/// The whole file.
///
/// # Errors
/// Pictures or numbers that cannot be encoded; nothing is known that cannot.
pub fn html(
    completion: &Completion,
    model: &Model<'_>,
    subject: &Subject<'_>,
) -> Result<String, Box<dyn std::error::Error + Send + Sync>> {
    let unit = unit::symbol(model.header().unit);
    let (columns, scene) = rayon::join(|| columns::columns(completion), || scene(completion, model));
    let scene = html::json(&scene)?;
    let body = [
        heading(completion, subject.scan, unit),
        section("figure", "Scan, fits, completed surface", &columns?),
        view(),
        section("verdict", "Verdict", &verdict(completion, subject.notes, unit)),
        section("distances", "How the seen surface is met", &distances(completion, model, unit)),
        section("pose", "Pose", &pose(completion, &subject.scan_to_model)),
        section("model", "Model", &model_table(model)),
        section("repeat", "To repeat it", &repeat(completion, subject)),
    ];
    let title = format!("{}, completed", subject.scan);
    Ok(Page { title: &title, body: &body.concat(), scene: Some(&scene) }.html())
}

fn heading(completion: &Completion, scan: &str, unit: &str) -> String {
    let verdict = &completion.verdict;
    let grade = format!("{:?}", verdict.grade).to_lowercase();
    format!(
        "<h1>{}</h1>\n<p class=\"lead\">Verdict: <span class=\"grade {grade}\">{grade}</span>. The seen part lies \
         {} {unit} rms from the fitted surface; {:.0} % of the completed surface is inferred.</p>\n",
        escape(scan),
        digits(verdict.evidence.seen_rms, 2),
        100.0 * verdict.evidence.inferred_share
    )
}

/// The interactive view; the script fills in the choices.
fn view() -> String {
    let buttons = [
        ("left", "Turn left", "\u{2190}"),
        ("right", "Turn right", "\u{2192}"),
        ("up", "Turn up", "\u{2191}"),
        ("down", "Turn down", "\u{2193}"),
        ("closer", "Closer", "+"),
        ("farther", "Farther", "\u{2212}"),
        ("reset", "Reset the view", "Reset"),
    ];
    let button = |(act, name, sign): (&str, &str, &str)| {
        format!(
            "<button type=\"button\" data-act=\"{act}\" aria-label=\"{name}\" title=\"{name}\">{sign}</button>\n"
        )
    };
    let buttons: String = buttons.into_iter().map(button).collect();
    format!(
        "<section id=\"view-section\" aria-labelledby=\"view-heading\">\n<h2 id=\"view-heading\">Look around</h2>\n\
         <noscript><p>The interactive view needs JavaScript; everything else on this page does not.</p></noscript>\n\
         <p id=\"no-view\" hidden>This browser offers no WebGL 2, so there is no interactive view; the pictures above \
         and the PLY file show the same surfaces.</p>\n\
         <div id=\"viewer\">\n<div>\n<canvas id=\"view\" tabindex=\"0\" role=\"application\" aria-label=\"3D view\" \
         aria-describedby=\"status\"></canvas>\n\
         <p id=\"status\" class=\"note\" role=\"status\"></p>\n\
         <p class=\"note\">Drag to turn, pinch to zoom; with the view in focus the wheel, plus and minus zoom, arrow \
         keys turn, Home resets.</p>\n</div>\n<div>\n\
         <fieldset id=\"surface-choice\"><legend>Surface</legend></fieldset>\n\
         <fieldset id=\"colouring-choice\"><legend>Colour</legend></fieldset>\n\
         <p id=\"key-parts\" hidden><span class=\"swatch measured\"></span> measured \
         <span class=\"swatch inferred\"></span> inferred</p>\n\
         <div id=\"key-distance\" hidden><div id=\"scale-bar\" role=\"img\" aria-label=\"Scale of colours, dark is \
         near, bright is far\"></div><div class=\"ends\"><span id=\"range-low\"></span><span id=\"range-high\"></span>\
         </div><p class=\"note\" id=\"range-of\"></p></div>\n\
         <p id=\"range-choice\" hidden><label>Scale <select id=\"range\"></select></label></p>\n\
         <div class=\"buttons\" role=\"group\" aria-label=\"Turn and zoom\">\n{buttons}</div>\n</div>\n</div>\n</section>\n"
    )
}

fn scene(completion: &Completion, model: &Model<'_>) -> Scene {
    let unit = unit::symbol(model.header().unit);
    let millimetre = completion.placed.class_millimetre(model);
    let ranges = RANGES.map(|range| rounded(range * millimetre));
    let turned = |mesh: &Mesh| picture::in_model(mesh, &completion.placed);
    let (scan, global) = (turned(&completion.scan), turned(&completion.global));
    let (local, merged) = (turned(&completion.local), turned(&completion.merged.mesh));
    let fitted = distance::Surface::new(&completion.local);
    let to_fitted = |mesh: &Mesh| distances_to(fitted.as_ref(), mesh, ranges[2]);
    let measured = |mesh: &Mesh| distances_to(Some(&completion.measured.surface), mesh, ranges[2]);
    let surface = |name, mesh, distance_to, distances| Surface {
        name,
        mesh,
        distance_to,
        distances,
        errors: None,
        labels: None,
    };
    let to_scan = "the scan";
    let surfaces = [
        surface("scan", &scan, "the local fit", to_fitted(&completion.scan)),
        surface("global fit", &global, to_scan, measured(&completion.global)),
        surface("local fit", &local, to_scan, measured(&completion.local)),
        Surface {
            labels: Some(&completion.merged.labels),
            errors: Some(&completion.expected.errors).filter(|e| !e.is_empty()).map(Vec::as_slice),
            ..surface("completed", &merged, to_scan, completion.merged.distances.clone())
        },
    ];
    let (front, up) = picture::directions(&merged, &completion.merged.labels);
    let axes =
        [up.cross(&front), front.cross(&up.cross(&front)), front].map(|axis: Vector| axis.normalize().into());
    Scene::new(unit, ranges, axes, &surfaces)
}

/// Distances of vertices to a surface: `limit` where it is farther, or is none.
fn distances_to(surface: Option<&distance::Surface>, mesh: &Mesh, limit: f64) -> Vec<f32> {
    let to = |p| surface.and_then(|surface| surface.distance(p, limit)).map_or(limit, |d| d.value.abs());
    mesh.points.par_iter().map(|p| to(p) as f32).collect()
}

/// Two digits are enough for a scale.
fn rounded(value: f64) -> f64 {
    let place = libm::pow(10.0, libm::log10(value.abs().max(1e-12)).floor() - 1.0);
    let digits = (value / place).round();
    if place < 1.0 { digits / (1.0 / place).round() } else { digits * place }
}

fn verdict(completion: &Completion, notes: &[String], unit: &str) -> String {
    let said = table::list(completion.verdict.reasons.iter().chain(notes));
    let reasons = if said.is_empty() { "<p>Nothing is unusual about this scan.</p>\n".into() } else { said };
    let evidence = &completion.verdict.evidence;
    let [on_it, inferred] =
        [evidence.inlier_share, evidence.inferred_share].map(|share| format!("{:.1} %", 100.0 * share));
    let (seen, area) = (digits(evidence.seen_rms, 3), digits(evidence.inferred_area, 0));
    let pairs = [
        ("fitted surface", format!("{on_it} of the scan near the model lies on it")),
        ("left out", left_out(completion)),
        ("noise", completion.noise.map_or_else(|| "left as it was".into(), |noise| smoothed(noise, unit))),
        (
            "layers",
            evidence
                .layers
                .map_or_else(|| "one, as far as can be seen".into(), |apart| two_layers(apart, unit)),
        ),
        ("seen part", format!("{seen} {unit} rms from the fitted surface")),
        ("inferred part", format!("{inferred} of the surface, {area} {unit}\u{b2}")),
        ("expected error, one sigma", expected(completion, unit)),
        (
            "left open by the scan",
            evidence.spread.map_or("not estimated: the pose was given".into(), left_open),
        ),
        ("weights", format!("{:.2} deviations rms", evidence.weight_norm)),
        ("scale", format!("{:.3} of the class", evidence.scale)),
    ];
    reasons + &table::pairs(&pairs)
}

/// What of the scan is not in the completed surface.
fn left_out(completion: &Completion) -> String {
    let pieces = if completion.scan.is_cloud() { "points" } else { "triangles" };
    let share = 100.0 * completion.clutter.area_share;
    format!("{share:.1} % of the scan, and specks of {} {pieces}", completion.specks)
}

fn smoothed(Noise { before, after }: Noise, unit: &str) -> String {
    let [before, after] = [before, after].map(|noise| digits(noise, 2));
    format!("{before} {unit} in the scan, {after} after smoothing")
}

fn two_layers(apart: f64, unit: &str) -> String {
    format!("two, {} {unit} apart, where views overlap", digits(apart, 2))
}

fn left_open(Spread { turn, surface }: Spread) -> String {
    let surface = digits(surface, 1);
    format!("{turn:.1} degrees of the pose, {surface} class millimetres of the surface, by the model alone")
}

/// Medians of the expected errors where the surface was measured and where not.
fn expected(completion: &Completion, unit: &str) -> String {
    let [measured, inferred] = completion
        .expected_shares
        .map(|share| share.map_or("-".into(), |share| format!("{} {unit}", digits(share.median, 2))));
    let guess = if completion.expected.calibrated { "" } else { "; a guess, the model is not calibrated" };
    let hidden = hidden::told(completion.expected.hidden, unit);
    format!("{measured} where measured, {inferred} where inferred (medians){hidden}{guess}")
}

fn distances(completion: &Completion, model: &Model<'_>, unit: &str) -> String {
    let millimetre = completion.placed.class_millimetre(model);
    let measure = |fitted| Distances::new(&completion.scan, fitted, COUNTED * millimetre);
    let (local, global) = (measure(&completion.local), measure(&completion.global));
    let row = |name: &str, of: &Distances| {
        let numbers = [of.rms(), of.within(0.5), of.within(0.95)].map(|d| digits(d, 3));
        [vec![name.to_owned(), of.count().to_string()], numbers.to_vec()].concat()
    };
    let head = [
        "fit",
        "vertices",
        &format!("rms {unit}"),
        &format!("median {unit}"),
        &format!("95 % within {unit}"),
    ];
    drawing(&local, &global, rounded(SHOWN * millimetre), unit)
        + &table::grid(&head, &[row("local", &local), row("global", &global)])
        + &format!(
            "<p class=\"note\">From the scan's vertices to the pure model surface, before it is moved onto the scan; \
             vertices beyond its rim or farther than {} {unit} are left out.</p>\n",
            digits(COUNTED * millimetre, 1)
        )
}

fn pose(completion: &Completion, matrix: &[[f64; 4]; 4]) -> String {
    // All digits: `--pose` takes it back, in whatever units it is.
    let rows = matrix.map(|row| row.map(|c| format!("{c:?}")).join(", "));
    let [best, next] = completion.verdict.evidence.pose_inliers.map(|share| 100.0 * share);
    let next = if next > 0.0 { format!(", the next best that was tried {next:.1} %") } else { String::new() };
    format!(
        "<p>This pose explains {best:.1} % of the scan{next}. From scan to model, as <code>--pose</code> takes \
         it:</p>\n<pre>[[{}]]</pre>\n",
        rows.join("],\n [")
    )
}

fn model_table(model: &Model<'_>) -> String {
    let h = model.header();
    let [x, y, z] = h.sides;
    let unit = unit::symbol(h.unit);
    table::pairs(&[
        ("class", h.class.to_owned()),
        ("made", h.made.to_owned()),
        (
            "shapes, modes",
            format!("{}, {} ({:.1} % of the variance)", h.shapes, model.modes(), 100.0 * h.explained),
        ),
        (
            "voxels",
            format!(
                "{x} \u{d7} {y} \u{d7} {z} of {} {unit}, {} stored",
                unit::four_digits(h.spacing.into()),
                h.voxels
            ),
        ),
        ("weight nodes", format!("every {} {unit}", digits((f32::from(h.stride) * h.spacing).into(), 1))),
        ("format, CRC-32", format!("version {}, {:08x}", model.version(), model.checksum())),
    ])
}

fn repeat(completion: &Completion, subject: &Subject<'_>) -> String {
    let mut rows = vec![
        ("program", format!("lacuna {}", env!("CARGO_PKG_VERSION"))),
        ("scan", subject.scan.to_owned()),
        (
            "scan as used",
            format!(
                "{} vertices, {} triangles, CRC-32 {:08x}",
                subject.original.points.len(),
                subject.original.triangles.len(),
                mesh_digest(subject.original)
            ),
        ),
    ];
    rows.extend(subject.settings.iter().cloned());
    rows.push(("digests", completion.fit.digests.to_string()));
    format!(
        "<pre>{}</pre>\n{}<p class=\"note\">The same command on the same files gives the same digests on every \
         machine, and on a device.</p>\n",
        escape(subject.command),
        table::pairs(&rows)
    )
}

#[cfg(test)]
mod tests {
    use super::rounded;

    #[test]
    fn scales_have_two_digits() {
        assert_eq!([1.0387, 16.49, 0.004_123, 0.0].map(rounded)[..3], [1.0, 16.0, 0.0041]);
        assert!(rounded(0.0).abs() < 1e-9);
    }
}
