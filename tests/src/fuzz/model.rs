//! Model bytes: refused, or a model that can be walked from end to end and fitted to a scan.

use super::fit::completed;
use super::tiny::tiny;
use lacuna::format::{CHECKSUM_AT, MAGIC, PREFIX, VERSION, checksum};
use lacuna::wire::distances::brick_of;
use lacuna::{Cloud, Fixed, Model, Schedule, Sizes};

/// Reads the bytes as they are, and again with magic, version, length and checksum made good: only then damage
/// reaches the checks behind them.
pub fn run(bytes: &[u8]) {
    if let Ok(model) = Model::from_bytes(bytes) {
        walk(&model);
    }
    let mut forged = bytes.to_vec();
    if forge(&mut forged)
        && let Ok(model) = Model::from_bytes(&forged)
    {
        walk(&model);
        fit(&model);
    }
}

/// The tiny model, and the same without its bulk.
pub fn seeds() -> Vec<Vec<u8>> {
    let file = &tiny().file;
    vec![file.clone(), file[..PREFIX + 300].to_vec(), file[..PREFIX].to_vec()]
}

/// Makes the part before the header agree with the rest; false where there is no room for it.
pub fn forge(file: &mut [u8]) -> bool {
    if file.len() < PREFIX {
        return false;
    }
    let length = file.len() as u32;
    file[..8].copy_from_slice(&MAGIC);
    file[8..10].copy_from_slice(&VERSION.to_le_bytes());
    file[12..16].copy_from_slice(&length.to_le_bytes());
    let sum = checksum(file);
    file[CHECKSUM_AT..PREFIX].copy_from_slice(&sum.to_le_bytes());
    true
}

/// Asks for everything a model has.
///
/// # Panics
/// Where accessors contradict each other.
pub fn walk(model: &Model<'_>) {
    let modes = model.modes();
    assert!((0..modes).all(|k| model.deviation(k) > 0.0 && model.gain(k) > 0.0));
    let mut voxels = 0;
    for (number, brick) in model.bricks().enumerate() {
        assert_eq!((brick.first, model.brick_number(brick.corner)), (voxels, Some(number)));
        assert_eq!(brick.exponents().len(), modes);
        let mut expected = 0;
        for (y, z) in (0..brick.edge()).flat_map(|z| (0..brick.edge()).map(move |y| (y, z))) {
            let row = brick.row(y, z);
            for voxel in (0..brick.edge()).filter_map(|x| row.voxel(x)) {
                assert_eq!((voxel, brick.basis(voxel).len()), (expected, modes));
                brick.mean(voxel);
                expected += 1;
            }
        }
        assert_eq!(expected, brick.voxels());
        if expected > 0 {
            assert_eq!(brick_of(model, voxels), number);
        }
        voxels += expected;
    }
    assert_eq!(voxels, model.voxels());
    let [x, y, z] = model.grid().node_sides(model.header().far_stride);
    let last = model.far([x - 1, y - 1, z - 1]);
    assert!(last.is_none_or(f32::is_finite) && model.far([x, y, z]).is_none());
}

/// Fits the tiny scan to a model that is small enough to be fitted in a blink.
fn fit(model: &Model<'_>) {
    let tiny = tiny();
    let settings = tiny.scan.begin.settings(model);
    let nodes = model.grid().nodes(model.header().stride);
    if nodes > 20_000 || model.voxels() > 5_000 || model.modes() > 16 {
        return;
    }
    let still = Schedule { passes: &settings.schedule.passes[1..2], ..settings.schedule };
    if Sizes::required(model, &still).is_ok()
        && let Ok(cloud) = Cloud::new(&tiny.scan.points, tiny.scan.begin.step)
    {
        let settings = lacuna::completion::Settings { schedule: still, ..settings };
        let _ = completed::<Fixed>(model, cloud, tiny.scan.begin.pose, settings, 0);
    }
}
