//! Views that were not aligned well are told, and what they leave uncertain is expected.

use lacuna::Fixed;
use lacuna_host::complete::verdict::Grade;
use lacuna_host::complete::{Completion, Options, complete};
use lacuna_host::mesh::{Mesh, Vector};
use lacuna_host::synth::{Head, Kind, ScannerSettings, scan};
use lacuna_tests::model;

#[test]
fn views_that_lie_apart_are_told_and_expected_to_be_off() {
    let model = model();
    let views = scan(&Head::sample(1, 1003).mesh(), Kind::Stitched, &ScannerSettings::default(), 2).views;
    let completed = |apart: f64| -> Completion {
        let mut all = Mesh::default();
        for (i, view) in views.iter().enumerate() {
            let mut mesh = view.mesh(view.jump_mm());
            // None moves along another, and they do not move as one.
            mesh.points.iter_mut().for_each(|p| *p += Vector::ith(i, apart));
            all.append(&mesh);
        }
        complete::<Fixed>(&model, &all, &Options::of(&model)).expect("a completion")
    };
    let measured = |completion: &Completion| completion.expected_shares[0].expect("a measured part").median;
    let [together, near, far] = [0.0, 1.0, 2.5].map(completed);
    assert_eq!((together.verdict.evidence.layers, together.verdict.grade), (None, Grade::Good));
    let [one, two] = [&near, &far].map(|found| found.verdict.evidence.layers.expect("two layers"));
    // Along the surface nothing is seen of a motion: of each there is a part.
    assert!((0.5..1.5).contains(&one) && (2.0..3.0).contains(&(two / one)), "{one} {two}");
    assert!(measured(&near) > 2.0 * measured(&together) && measured(&far) > 2.0 * measured(&near));
    assert_eq!(far.verdict.grade, Grade::Check);
    assert!(
        far.verdict.reasons.iter().any(|reason| reason.contains("in two layers")),
        "{:?}",
        far.verdict.reasons
    );
}
