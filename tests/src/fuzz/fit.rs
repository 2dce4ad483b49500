//! Points, poses, reaches, rounds and schedules of any kind against the tiny model: refused, or fitted to the same
//! bits whatever was in the memory before.

use super::source::Source;
use super::tiny::tiny;
use lacuna::cloud::{Packed, from_bytes};
use lacuna::completion::{Outcome, Settings};
use lacuna::digest::Digest;
use lacuna::pose_fit::{PATCH, ROUNDS, Round};
use lacuna::{
    Arithmetic, Cloud, Completion, Error, Fixed, Float, HullBuilder, Model, Pass, Pose, Reach, Schedule,
    Sizes,
};
use lacuna_host::fit::Buffers;

/// Most points taken from an input.
const POINTS: usize = 300;

/// Decodes a completion and runs it.
pub fn run(bytes: &[u8]) {
    let mut source = Source(bytes);
    let flags = source.byte();
    let flag = |bit: u8| flags >> bit & 1 == 1;
    let tiny = tiny();
    let model = tiny.model();
    let pose = if flag(0) { any_pose(&mut source) } else { near(&tiny.scan.begin.pose, &mut source) };
    let own = tiny.settings();
    let reach = flag(1).then(|| any_reach(&mut source));
    let rounds: Vec<Round> = if flag(2) { any_rounds(&mut source) } else { ROUNDS.map(short).to_vec() };
    let steps: Vec<(u8, Vec<f32>)> = any_passes(&mut source);
    let passes: Vec<Pass<'_>> =
        steps.iter().map(|(radius, steps)| Pass { radius: *radius, steps, part: 1 }).collect();
    let schedule = Schedule {
        stride: if flag(3) { source.byte() } else { own.schedule.stride },
        momentum: source.byte(),
        passes: &passes,
    };
    let step = if flag(4) { source.float() } else { tiny.scan.begin.step };
    let points: Vec<Packed> = match flag(5) {
        true => from_bytes(source.0).take(POINTS).collect(),
        false => mixed(&tiny.scan.points, source.0),
    };
    let Ok(cloud) = Cloud::new(&points, step) else { return };
    let settings = Settings { rounds: &rounds, schedule };
    if let Some(reach) = reach {
        claim(&model, cloud, pose, reach);
    }
    if flag(6) {
        let _ = completed::<Float>(&model, cloud, pose, settings, 0);
    } else {
        let clean = completed::<Fixed>(&model, cloud, pose, settings, 0);
        let dirty = completed::<Fixed>(&model, cloud, pose, settings, 0xa5);
        // Debug output tells NaN from NaN no more than the digests do.
        assert_eq!(format!("{clean:?}"), format!("{dirty:?}"), "what was in the memory shows in the result");
    }
}

/// The tiny scan as it is, in a far pose, with other schedules, and a few points of its own.
pub fn seeds() -> Vec<Vec<u8>> {
    let passes = [2, 1, 2, 0, 0, 0x40, 0x40, 0, 0, 0x80, 0x3f, 0, 1, 0, 0, 0x40, 0x40];
    let scan: Vec<u8> = tiny().scan.points.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    let calm = [0; 14];
    vec![
        [&[0][..], &calm, &passes, &[0]].concat(),
        [&[0][..], &calm, &passes, &[179]].concat(),
        [&[0x40][..], &calm, &passes, &[0]].concat(),
        [&[0x20][..], &calm, &passes, &[0], &scan[..12 * 120]].concat(),
        [&[0x02][..], &calm, &[0, 7, 0, 3, 0, 1], &passes, &[0]].concat(),
        [&[0x04][..], &calm, &[2, 2, 0, 0, 0x20, 0x41, 3, 1, 0, 0, 0, 0x3f, 1], &passes, &[0]].concat(),
        [&[0x7f][..], &[0x3f; 80], &scan[..240]].concat(),
    ]
}

/// Lets the points claim voxels as far as any reach: a completion takes the model's.
fn claim(model: &Model<'_>, cloud: Cloud<'_>, pose: Pose, reach: Reach) {
    let (mut targets, mut keys) = (vec![0; model.voxels()], vec![0i16; model.voxels()]);
    let Ok(mut builder) = HullBuilder::new(model, reach, &mut targets, &mut keys) else { return };
    for (point, normal) in (0..cloud.len()).filter_map(|index| cloud.point(index)) {
        builder.add(pose.apply(point), pose.rotate(normal));
    }
    builder.finish();
}

/// Outcome and digest of the distances of a completion whose memory held `rubbish` before.
///
/// # Errors
/// What the core refuses.
pub fn completed<A: Arithmetic>(
    model: &Model<'_>,
    cloud: Cloud<'_>,
    pose: Pose,
    settings: Settings<'_>,
    rubbish: u8,
) -> Result<(Outcome, u32), Error> {
    let mut buffers = Buffers::<A>::new(&Sizes::required(model, &settings.schedule)?);
    if rubbish != 0 {
        used(model, settings, &mut buffers);
        soil(&mut buffers, rubbish);
    }
    let mut job = Completion::new(model, cloud, pose, settings, buffers.memory())?;
    job.run();
    let outcome = job.outcome()?;
    let mut distances = vec![0i16; model.voxels()];
    if let Some(fit) = job.local() {
        for brick in model.bricks() {
            fit.distances(&brick, |voxel, distance| distances[voxel] = distance);
        }
    }
    let mut digest = Digest::new();
    distances.iter().for_each(|d| digest.add(&d.to_le_bytes()));
    Ok((outcome, digest.value()))
}

/// Leaves another completion behind, for what has no number that could be filled in.
fn used<A: Arithmetic>(model: &Model<'_>, settings: Settings<'_>, buffers: &mut Buffers<A>) {
    let other = &tiny().scan;
    let turned = other.begin.pose.moved([0.0; 3], [0.3, -0.2, 0.1], 0.1, [2.0, 1.0, -1.0]);
    let Ok(cloud) = Cloud::new(&other.points, other.begin.step) else { return };
    if let Ok(mut job) = Completion::new(model, cloud, turned, settings, buffers.memory()) {
        job.run();
    }
}

fn soil<A: Arithmetic>(buffers: &mut Buffers<A>, rubbish: u8) {
    let number = f64::from(rubbish);
    buffers.pose_normal.fill(number);
    buffers.pose_chunk.fill(number as f32);
    buffers.pose_columns.fill([number as i16; PATCH]);
    buffers.pose_weights.fill(number as f32);
    buffers.targets.fill(i16::from(rubbish) * 77);
    buffers.normal.fill(number);
    buffers.block.fill(i32::from(rubbish) << 16);
    buffers.global.fill(number);
    buffers.node_weights.fill(A::weight(number));
    buffers.previous.fill(A::weight(-number));
    buffers.hull_rows.fill(rubbish);
    buffers.nodes.fill(u32::from(rubbish) << 8);
}

fn short(round: Round) -> Round {
    Round { iterations: round.iterations.min(3), ..round }
}

/// The true pose, moved by less than half a turn, a factor of two and eight voxels.
fn near(pose: &Pose, source: &mut Source<'_>) -> Pose {
    let omega = std::array::from_fn(|_| source.within(3.0));
    let growth = source.within(0.7);
    pose.moved([0.0; 3], omega, growth, std::array::from_fn(|_| source.within(8.0)))
}

fn any_pose(source: &mut Source<'_>) -> Pose {
    Pose {
        rotation: std::array::from_fn(|_| std::array::from_fn(|_| source.float())),
        scale: source.float(),
        translation: std::array::from_fn(|_| source.float()),
    }
}

fn any_reach(source: &mut Source<'_>) -> Reach {
    Reach { front: source.short(), behind: source.short(), lateral: source.short() }
}

fn any_rounds(source: &mut Source<'_>) -> Vec<Round> {
    let round = |source: &mut Source<'_>| {
        let (iterations, misfit, flags) = (source.byte() % 4, source.float(), source.byte());
        Round {
            iterations: iterations.into(),
            points: usize::from(flags >> 3) * 40,
            misfit,
            growth: flags & 1 == 1,
            shape: flags & 2 == 2,
            own: flags & 4 == 4,
            tied: flags & 8 == 8,
        }
    };
    (0..source.below(4)).map(|_| round(source)).collect()
}

fn any_passes(source: &mut Source<'_>) -> Vec<(u8, Vec<f32>)> {
    (0..source.below(4))
        .map(|_| (source.byte(), (0..source.below(4)).map(|_| source.float()).collect()))
        .collect()
}

/// The scan's points, some of them replaced by other bytes.
fn mixed(points: &[Packed], bytes: &[u8]) -> Vec<Packed> {
    let mut points = points.to_vec();
    for (slot, other) in points.iter_mut().zip(from_bytes(bytes)) {
        *slot = other;
    }
    points
}
