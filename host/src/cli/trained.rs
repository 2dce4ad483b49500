//! What `lacuna train` says about the model it made.

use super::scatter::Scatter;
use crate::train::align::Way;
use crate::train::choice::{Choice, Size};
use crate::train::leave_one_out::{self, Row, Summary};
use crate::unit::{digits, four_digits};
use lacuna::Model;
use lacuna::format::Calibration;

/// How a model was made.
pub struct Made {
    /// Where it is.
    pub output: String,
    /// Length of the file.
    pub flash: u64,
    /// Bytes of memory its fit takes.
    pub ram: u64,
    /// Spacing and modes, where they were chosen for a device.
    pub choice: Option<Choice>,
    /// How the shapes came into one pose.
    pub way: Way,
    /// What was noticed on the way.
    pub notes: Vec<String>,
    /// How long it took.
    pub seconds: f64,
}

#[derive(serde::Serialize)]
pub struct Report {
    output: String,
    class: String,
    shapes: usize,
    aligned: bool,
    /// How far they lay from their common pose, if they were in one frame and drawn to it.
    jitter: Option<Scatter>,
    modes: usize,
    voxels: usize,
    spacing: f32,
    bytes: u64,
    /// Memory of the fit without the scan's points.
    fit_bytes: u64,
    /// Spacing and modes without limits and within those that were given.
    choice: Option<Choice>,
    checksum: String,
    seconds: f64,
    /// How far mirror images of the shapes lie from the shapes, in their unit, if the class is symmetric.
    symmetry_deviation: Option<f32>,
    notes: Vec<String>,
    calibration: Option<Calibration>,
    /// How well shapes that were held back come out, a line a kind of scan.
    held_back: Vec<Summary>,
    leave_one_out: Option<LeaveOneOut>,
}

/// How well the class predicts its own unseen parts; lengths in the meshes' unit.
#[derive(serde::Serialize)]
pub struct LeaveOneOut {
    /// A line a kind of scan.
    pub summaries: Vec<Summary>,
    /// A row a shape.
    pub shapes: Vec<Row>,
}

impl Report {
    /// What is to be said about a model, and how well shapes that were held back come out, row by row if every one was and that
    /// was asked for.
    pub fn new(model: &Model<'_>, made: Made, held_back: Vec<Row>, row_by_row: bool) -> Self {
        let header = model.header();
        let summaries = leave_one_out::summaries(&held_back);
        Self {
            output: made.output,
            class: header.class.into(),
            shapes: header.shapes as usize,
            aligned: made.way == Way::Searched,
            jitter: made.way.apart().map(Scatter::from),
            modes: model.modes(),
            voxels: model.voxels(),
            spacing: header.spacing,
            bytes: made.flash,
            fit_bytes: made.ram,
            choice: made.choice,
            checksum: format!("{:08x}", model.checksum()),
            seconds: made.seconds,
            notes: made.notes,
            symmetry_deviation: model.symmetry().map(|plane| plane.deviation * header.spacing),
            calibration: model.calibration().copied(),
            leave_one_out: row_by_row
                .then(|| LeaveOneOut { summaries: summaries.clone(), shapes: held_back }),
            held_back: summaries,
        }
    }

    /// As lines of text; `symbol` is the meshes' unit.
    pub fn lines(&self, symbol: &str) -> Vec<String> {
        let mut lines: Vec<String> =
            self.notes.iter().map(|note| format!("note            {note}")).collect();
        lines.extend([
            format!("shapes          {} of class {}, {}", self.shapes, self.class, self.pose(symbol)),
            format!(
                "model           {} mode{}, {} voxels of {} {symbol}",
                self.modes,
                if self.modes == 1 { "" } else { "s" },
                self.voxels,
                four_digits(self.spacing.into())
            ),
            format!(
                "file            {} ({:.2} MiB, {:.1} s)",
                self.output,
                self.bytes as f64 / 1048576.0,
                self.seconds
            ),
        ]);
        lines.push(format!(
            "takes           {} bytes of flash, {} of RAM and 12 more for each point of a scan",
            self.bytes, self.fit_bytes
        ));
        lines.extend(self.choice.as_ref().map(|choice| chosen(choice, symbol)));
        lines.extend(self.symmetry_deviation.map(|off| {
            format!(
                "symmetry        a plane; mirror images lie {} {symbol} off in the root mean square",
                digits(off.into(), 2)
            )
        }));
        lines.push(expected_error(self.calibration.as_ref()));
        if let Some(table) = &self.leave_one_out {
            lines.extend(leave_one_out::table(&table.shapes, symbol));
        }
        lines.extend(
            self.held_back.iter().map(|summary| format!("held back       {}", summary.sentence(symbol))),
        );
        lines
    }

    /// How the shapes came into one pose.
    fn pose(&self, symbol: &str) -> String {
        match &self.jitter {
            Some(jitter) => format!("in one pose already; drawn to their mean: {}", jitter.sentence(symbol)),
            None if self.aligned => "aligned to each other".into(),
            None => "left as they lie".into(),
        }
    }
}

/// What a device cost the model.
fn chosen(choice: &Choice, symbol: &str) -> String {
    let Choice { usual, chosen } = choice;
    let Size { spacing, modes } = chosen;
    if chosen == usual {
        return "chosen          nothing had to be given up".into();
    }
    let kept = format!(
        "chosen          {modes} of {} modes, voxels of {} {symbol}",
        usual.modes,
        four_digits((*spacing).into())
    );
    if *spacing == usual.spacing {
        kept
    } else {
        format!("{kept} instead of {}", four_digits(usual.spacing.into()))
    }
}

/// How well the expected errors hold, as a line of text.
pub fn expected_error(calibration: Option<&Calibration>) -> String {
    let Some(c) = calibration else { return "expected error  not calibrated".into() };
    let [measured, inferred] = c.shares.map(|share| format!("{:.0} %", 100.0 * share));
    format!(
        "expected error  calibrated on {} scans of held-back shapes: {measured} of the true errors are below it where \
         measured, {inferred} where inferred (68 % wanted)",
        c.scans
    )
}
