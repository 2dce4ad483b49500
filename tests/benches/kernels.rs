//! Times of the kernels: `cargo bench -p lacuna-tests`.

use divan::{Bencher, black_box};
use lacuna::completion::{self, Settings};
use lacuna::pose_fit::{ROUNDS, Round};
use lacuna::{Arithmetic, Fixed, Float, HullBuilder, Reach, Schedule, Sizes};
use lacuna_host::complete::{Completion, Options, complete};
use lacuna_host::distance::Surface;
use lacuna_host::fit::{Buffers, Fit, dense, fit};
use lacuna_host::io::{Format, parse};
use lacuna_host::mesh::{Mesh, Point};
use lacuna_host::register::register;
use lacuna_host::report;
use lacuna_host::surface::{Volume, marching_cubes};
use lacuna_host::synth::Head;
use lacuna_tests::{head_points, in_voxels, model, voxel_pose};

fn main() {
    divan::main();
}

/// A whole head through hull, global fit, local fit and both sets of distances.
fn whole_fit<A: Arithmetic>() -> Fit {
    let model = model();
    let settings = Settings { rounds: &[], schedule: Schedule::of(&model) };
    fit::<A>(&model, &head_points(1000).packed(), &voxel_pose(&model), settings).unwrap()
}

#[divan::bench(sample_count = 20)]
fn surface_of_distances(bencher: Bencher) {
    let model = model();
    let values = dense(&model, &whole_fit::<Fixed>().local_distances);
    let volume = Volume { dims: model.grid().sides().map(usize::from), values: &values };
    bencher.bench(|| marching_cubes(black_box(&volume), &Point::origin(), 3.3));
}

#[divan::bench(sample_count = 20)]
fn thousand_closest_points(bencher: Bencher) {
    let surface = Surface::new(&Head::sample(1, 1000).mesh()).unwrap();
    let points = Head::sample(1, 1001).mesh().points;
    let ask = |p: &Point| surface.distance(black_box(p), f64::INFINITY).map_or(0.0, |d| d.value);
    bencher.bench(|| points.iter().take(1000).map(ask).sum::<f64>());
}

#[divan::bench(sample_count = 20)]
fn hull_of_a_head(bencher: Bencher) {
    let model = model();
    let points = in_voxels(&head_points(1000), &voxel_pose(&model));
    let (mut targets, mut keys) = (vec![0; model.voxels()], vec![0i16; model.voxels()]);
    bencher.bench_local(|| {
        let mut builder = HullBuilder::new(&model, Reach::of(&model), &mut targets, &mut keys).unwrap();
        points.iter().for_each(|&(point, normal)| builder.add(point, normal));
        builder.finish().0.count
    });
}

/// A completion in lent memory, without and with the pose's refinement.
#[divan::bench(args = [false, true], sample_count = 10)]
fn completion(bencher: Bencher, refined: bool) {
    let model = model();
    let points = head_points(1000).packed();
    let schedule = Schedule::of(&model);
    let rounds: &[Round] = if refined { &ROUNDS } else { &[] };
    let settings = Settings { rounds, schedule };
    let mut buffers = Buffers::<Fixed>::new(&Sizes::required(&model, &schedule).unwrap());
    bencher.bench_local(|| {
        let cloud = points.cloud().unwrap();
        let mut job =
            completion::Completion::new(&model, cloud, voxel_pose(&model), settings, buffers.memory())
                .unwrap();
        job.run();
        job.outcome().unwrap().digests
    });
}

/// The whole fit in either arithmetic: hull and global fit are the same, the local fit is the difference.
#[divan::bench(types = [Fixed, Float], sample_count = 10)]
fn whole_fit_in<A: Arithmetic>() -> u32 {
    whole_fit::<A>().digests.distances
}

#[divan::bench(sample_count = 5)]
fn registration(bencher: Bencher) {
    let model = model();
    let scan: Mesh = parse(Format::Ply, lacuna_fixtures::SCAN).unwrap();
    bencher.bench(|| register(&model, black_box(&scan), 1).unwrap().inliers);
}

/// The example scan and its completion.
fn completed() -> (Mesh, Completion) {
    let (model, scan) = (model(), parse(Format::Ply, lacuna_fixtures::SCAN).unwrap());
    let options = Options::of(&model);
    let completion = complete::<Fixed>(&model, &scan, &options).unwrap();
    (scan, completion)
}

/// The two whose ratio counts: a report took 0.4 times as long as the completion it shows.
#[divan::bench(sample_count = 5)]
fn completion_of_the_example() -> usize {
    completed().1.merged.labels.len()
}

#[divan::bench(sample_count = 5)]
fn report_of_the_example(bencher: Bencher) {
    let (model, (scan, completion)) = (model(), completed());
    let scan_to_model = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    let subject = report::Subject {
        scan: "example",
        original: &scan,
        scan_to_model,
        notes: &[],
        settings: &[],
        command: "lacuna complete",
    };
    bencher.bench(|| report::completion::html(&completion, &model, &subject).unwrap().len());
}
