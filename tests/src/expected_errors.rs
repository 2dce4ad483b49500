//! How often expected errors hold.

use lacuna::Model;
use lacuna_host::mesh::Mesh;
use lacuna_host::synth::Kind;
use lacuna_host::train::held_out::trial;
use lacuna_host::uncertainty::expected::{expected, misfit};

/// Shares of measured and inferred vertices whose true error is below the expected one, over scans of `shapes` from
/// one side and from three.
///
/// # Panics
/// A model without a calibration, or a scan that is not completed.
#[must_use]
pub fn shares(model: &Model<'_>, shapes: &[Mesh]) -> [f64; 2] {
    let calibration = model.calibration().expect("a calibration");
    let (mut within, mut of) = ([0.0; 2], [0.0; 2]);
    for (number, shape) in shapes.iter().enumerate() {
        for kind in [Kind::Front, Kind::Stitched] {
            let done = trial(model, shape, 100 + number, kind).expect("a completion");
            let misfit = misfit(&done.cues);
            let known = done.cues.iter().zip(&done.errors).filter_map(|(cue, error)| Some((cue, (*error)?)));
            for (cue, error) in known {
                let part = usize::from(!cue.measured);
                of[part] += 1.0;
                within[part] += f64::from(u8::from(error <= expected(calibration, cue, misfit)));
            }
        }
    }
    let shares = [within[0] / of[0], within[1] / of[1]];
    println!("{} shapes: measured {:.3}, inferred {:.3}", shapes.len(), shares[0], shares[1]);
    shares
}
