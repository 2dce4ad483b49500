//! Real scans completed by a model of thirty faces, once for all tests that look at them: nine of three other faces, and a raw
//! head with hair and collar.

use crate::real_data;
use crate::sample::{Sample, real};
use crate::trained::thirty_faces;
use lacuna::Fixed;
use lacuna_host::complete::{Completion, Options, complete};
use lacuna_host::io;
use lacuna_host::mesh::Mesh;
use std::sync::OnceLock;

/// Names of the nine scans, face by face.
pub fn nine_names() -> impl Iterator<Item = String> {
    (0..3).flat_map(|face| ["front", "side", "stitched"].map(|kind| format!("target_{face:02}_{kind}")))
}

/// From the front, from the side and stitched from three views, in unknown poses; none without the real data.
pub fn nine_faces() -> Option<&'static [(Sample, Completion)]> {
    static DONE: OnceLock<Option<Vec<(Sample, Completion)>>> = OnceLock::new();
    let completed = || {
        let (scans, model) = (real_data("scans")?, thirty_faces()?);
        let one = |name: String| {
            let sample = real(&scans.join(&name));
            let completion = complete::<Fixed>(&model, &sample.scan, &Options::of(&model));
            (sample, completion.unwrap_or_else(|error| panic!("{name}: {error}")))
        };
        Some(nine_names().map(one).collect())
    };
    DONE.get_or_init(completed).as_deref()
}

/// A raw head of ten thousand vertices, with hair, collar and folded triangles, as it is and completed; none without the real
/// data.
pub fn raw_head() -> Option<&'static (Mesh, Completion)> {
    static DONE: OnceLock<Option<(Mesh, Completion)>> = OnceLock::new();
    let completed = || {
        let (path, model) = (real_data("faces/targets_real/demoface_raw.ply")?, thirty_faces()?);
        let scan = io::read(&path).expect("a mesh");
        let completion = complete::<Fixed>(&model, &scan, &Options::of(&model)).expect("a completion");
        Some((scan, completion))
    };
    DONE.get_or_init(completed).as_ref()
}
