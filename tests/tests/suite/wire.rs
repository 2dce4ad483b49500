//! Both ends of the wire protocol over a bad line: the right bits arrive, the device never falls over, every
//! refusal says why.

use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write};
use lacuna::completion::Stage;
use lacuna::depth::{Camera, Frame, Rows};
use lacuna::error::OptionName;
use lacuna::wire::Refusal;
use lacuna::wire::device::{Ended, MOST_FAILURES};
use lacuna::wire::distances::{Packer, unpack};
use lacuna::wire::frame::{Event, Header, Receiver};
use lacuna::wire::message::{
    Begin, BeginDepth, Hint, MAX_BATCH, MAX_DATA, MAX_PIXELS, Reply, Request, State, Status, VERSION, Vector,
};
use lacuna::{Error, Fixed, Model, Pose};
use lacuna_host::device::{self, Client, Link, Scan, Timing, refusal, run};
use lacuna_host::fit::{Digests, fit, means};
use lacuna_host::points::PackedPoints;
use lacuna_tests::device_memory::DeviceMemory;
use lacuna_tests::framed::framed;
use lacuna_tests::line::{Faults, HostEnd};
use lacuna_tests::model;
use lacuna_tests::rubbish::Rubbish;
use lacuna_tests::small::{Small, small, small_depth};
use proptest::prelude::*;
use proptest::test_runner::Config;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

const TIMING: Timing = Timing {
    reply: Duration::from_secs(60),
    pause: Duration::ZERO,
    attempts: 40,
    standstill: Duration::from_secs(60),
};

/// Runs a scan under a number of its own and gives back its digests.
fn completed(client: &mut Client<&HostEnd>, number: u32, batch: usize) -> Result<Digests, device::Error> {
    completed_of(small(), client, number, batch)
}

fn completed_of(
    small: &Small,
    client: &mut Client<&HostEnd>,
    number: u32,
    batch: usize,
) -> Result<Digests, device::Error> {
    let model = Model::from_bytes(&small.model).unwrap();
    let begin = Begin { scan: number, ..small.scan.begin };
    let scan = Scan { begin, batch, ..small.scan.clone() };
    let results = run(client, &model, &scan, &mut |_| ())?;
    Ok(results.into_fit(&model, &begin).unwrap().digests)
}

#[test]
fn ten_thousand_frames_over_a_bad_line_with_three_resets_end_with_the_right_bits() {
    let faults = Faults { damage: 0.01, loss: 0.01, repetition: 0.01, resets: vec![1500, 4100, 7300] };
    let line = HostEnd::start(small().model.clone(), 10_000, faults, 1);
    let mut client = Client::new(&line, TIMING);
    client.hello().unwrap();
    let mut scans = 0;
    while line.frames() < 10_000 {
        scans += 1;
        assert_eq!(completed(&mut client, scans, 2).unwrap(), small().digests, "scan {scans}");
    }
    println!(
        "{} frames, {scans} scans of {} points, {:?}",
        line.frames(),
        small().scan.points.len(),
        client.statistics
    );
    assert_eq!(line.resets_left(), 0);
    assert_eq!(client.statistics.sessions, 4);
    assert!(client.statistics.repeated > 200);
}

#[test]
fn a_depth_image_becomes_the_same_points_on_both_ends() {
    let line = HostEnd::start(small().model.clone(), 10_000, Faults::default(), 1);
    let mut client = Client::new(&line, TIMING);
    client.hello().unwrap();
    let scan = &small_depth().scan;
    println!("{} points of {:?}", scan.points.len(), scan.depth.as_ref().map(|depth| depth.frame));
    assert!(scan.points.len() > 300);
    assert_eq!(completed_of(small_depth(), &mut client, 1, MAX_PIXELS).unwrap(), small_depth().digests);
    assert_eq!(completed(&mut client, 2, MAX_BATCH).unwrap(), small().digests, "points after pixels");
    assert_eq!(completed_of(small_depth(), &mut client, 3, 7).unwrap(), small_depth().digests);
}

#[test]
fn a_host_that_comes_back_goes_on_where_the_device_is() {
    let line = HostEnd::start(small().model.clone(), 10_000, Faults::default(), 1);
    let begin = small().scan.begin;
    let mut first = Client::new(&line, TIMING);
    first.hello().unwrap();
    first.status(&Request::Begin(begin)).unwrap();
    let batch: Vec<u8> = small().scan.points[0].iter().flat_map(|v| v.to_le_bytes()).collect();
    first.status(&Request::Points { first: 0, batch: &batch }).unwrap();
    let mut second = Client::new(&line, TIMING);
    second.hello().unwrap();
    assert_eq!(second.status(&Request::Status).unwrap().received, 1);
    let lost = first.status(&Request::Status);
    assert!(matches!(lost, Err(device::Error::Refused(Refusal::WrongSession { .. }))), "{lost:?}");
    let other = completed(&mut first, 77, MAX_BATCH);
    let is_taken = |error: &device::Error| matches!(error, device::Error::Refused(Refusal::WrongSession { current }) if *current != 0);
    assert!(other.as_ref().is_err_and(is_taken), "{other:?}");
    let status = second.status(&Request::Status).unwrap();
    assert_eq!((status.scan, status.received), (begin.scan, 1), "the first host did not take it back");
    assert_eq!(completed(&mut second, begin.scan, MAX_BATCH).unwrap(), small().digests);
    let frames = line.frames();
    assert_eq!(completed(&mut second, begin.scan, MAX_BATCH).unwrap(), small().digests);
    assert!(line.frames() - frames < 60, "the results are there already");
}

/// A line that says something all the time, but never ends a frame.
struct Chatter;

impl Link for Chatter {
    fn send(&mut self, _: &[u8]) -> std::io::Result<()> {
        Ok(())
    }

    fn receive(&mut self, bytes: &mut [u8], _: Duration) -> std::io::Result<usize> {
        bytes.fill(b'U');
        Ok(bytes.len())
    }
}

#[test]
fn a_line_that_never_falls_silent_is_given_up() {
    let timing = Timing { reply: Duration::from_millis(5), pause: Duration::ZERO, attempts: 2, ..TIMING };
    let mut client = Client::new(Chatter, timing);
    assert!(matches!(client.hello(), Err(device::Error::Silent(2))));
}

/// A line that answers so many requests with a frame that is none, and others not at all.
struct Spoiled(u32);

impl Link for Spoiled {
    fn send(&mut self, _: &[u8]) -> std::io::Result<()> {
        Ok(())
    }

    fn receive(&mut self, bytes: &mut [u8], _: Duration) -> std::io::Result<usize> {
        if self.0 == 0 {
            return Ok(0);
        }
        self.0 -= 1;
        let mut frame = [20; 21];
        frame[20] = 0;
        bytes[..frame.len()].copy_from_slice(&frame);
        Ok(frame.len())
    }
}

#[test]
fn a_burst_of_damage_is_waited_out_and_a_line_that_damages_all_is_told_as_that() {
    let mut client = Client::new(Spoiled(10), Timing { attempts: 10, ..TIMING });
    let begun = Instant::now();
    let said = client.hello().unwrap_err();
    assert!(matches!(said, device::Error::Damaged { attempts: 10, damaged: 10 }), "{said:?}");
    assert!(said.to_string().starts_with("10 of 10 requests, or"), "{said}");
    assert!(begun.elapsed() > Duration::from_millis(400), "{:?}: shorter than many bursts", begun.elapsed());
    assert_eq!(client.statistics.damaged, 10);
    let mut once = Client::new(Spoiled(1), Timing { attempts: 10, ..TIMING });
    assert!(matches!(once.hello(), Err(device::Error::Silent(10))), "a glitch, and then nobody");
}

/// A connection of which one end has been recorded.
#[derive(Default)]
struct Tape {
    input: Vec<u8>,
    output: Vec<u8>,
    /// Reads that fail first.
    failures: u32,
}

impl ErrorType for Tape {
    type Error = ErrorKind;
}

impl Read for Tape {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        if self.failures > 0 {
            self.failures -= 1;
            return Err(ErrorKind::Other);
        }
        let count = self.input.len().min(bytes.len());
        bytes.iter_mut().zip(self.input.drain(..count)).for_each(|(to, from)| *to = from);
        Ok(count)
    }
}

impl ReadReady for Tape {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        Ok(!self.input.is_empty())
    }
}

impl Write for Tape {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        self.output.extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

#[test]
fn what_a_connection_left_behind_is_not_heard_by_the_next_one() {
    let frame =
        |session: u32, request: &Request<'_>| framed(Header { session, sequence: 0 }, request).unwrap();
    let hello = Request::Hello { version: VERSION };
    let cut = frame(5, &Request::Points { first: 0, batch: &[7; 120] });
    let mut memory = DeviceMemory::new(&small().model, 10);
    let mut said = |input: Vec<u8>| {
        let mut tape = Tape { input, ..Tape::default() };
        memory.serve(&mut tape, &small().model);
        let mut receiver = Receiver::new();
        let mut heard = |byte: u8| match receiver.push(byte) {
            Event::Frame => {
                receiver.message::<Reply<'_>>().map(|(header, reply)| (header.session, format!("{reply:?}")))
            }
            _ => None,
        };
        tape.output.into_iter().filter_map(&mut heard).collect::<Vec<_>>()
    };
    let greeting = |session: u32| vec![(session, format!("{:?}", Some(Reply::Hello { version: VERSION })))];
    assert_eq!(said([frame(5, &hello), cut[..100].to_vec()].concat()), greeting(5));
    assert_eq!(said(frame(6, &hello)), greeting(6));
}

#[test]
fn a_line_that_fails_now_and_then_only_loses_bytes() {
    let input = framed(Header { session: 5, sequence: 0 }, &Request::Hello { version: VERSION }).unwrap();
    let mut memory = DeviceMemory::new(&small().model, 10);
    let mut served = |failures: u32| {
        let mut tape = Tape { input: input.clone(), failures, ..Tape::default() };
        let ended = memory.serve(&mut tape, &small().model);
        (ended, tape.output.is_empty())
    };
    assert_eq!(served(MOST_FAILURES), (Ended::Closed, false));
    assert_eq!(served(MOST_FAILURES + 1), (Ended::Failed(ErrorKind::Other), true));
}

/// A device that answers at once.
struct Answering<F> {
    answer: F,
    receiver: Receiver,
    waiting: Vec<u8>,
}

impl<F: FnMut(Header, Request<'_>) -> Reply<'static>> Answering<F> {
    fn with(answer: F) -> Self {
        Self { answer, receiver: Receiver::new(), waiting: vec![] }
    }
}

impl<F: FnMut(Header, Request<'_>) -> Reply<'static>> Link for Answering<F> {
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        for &byte in bytes {
            if self.receiver.push(byte) == Event::Frame {
                let (header, request) = self.receiver.message::<Request<'_>>().unwrap();
                let reply = (self.answer)(header, request.unwrap());
                self.waiting.extend(framed(header, &reply).unwrap());
            }
        }
        Ok(())
    }

    fn receive(&mut self, bytes: &mut [u8], _: Duration) -> std::io::Result<usize> {
        let count = self.waiting.len().min(bytes.len());
        bytes.iter_mut().zip(self.waiting.drain(..count)).for_each(|(to, from)| *to = from);
        Ok(count)
    }
}

#[test]
fn a_device_that_gets_no_further_is_given_up() {
    let begin = small().scan.begin;
    let state = State::Fitting { stage: Stage::Hull, done: 1, total: 9 };
    let status = Status { state, scan: begin.scan, received: begin.points, announced: begin.points };
    let timing = Timing { standstill: Duration::from_millis(20), ..TIMING };
    let mut client = Client::new(Answering::with(|_, _| Reply::Status(status)), timing);
    let model = Model::from_bytes(&small().model).unwrap();
    let ended = run(&mut client, &model, &small().scan, &mut |_| ());
    assert!(matches!(ended, Err(device::Error::Standstill(_))), "{:?}", ended.map(|_| ()));
}

#[test]
fn after_a_request_that_the_device_does_not_know_the_same_number_is_due() {
    let mut due = vec![];
    let answer = |header: Header, request: Request<'_>| {
        due.push(header.sequence);
        match request {
            Request::Hello { .. } => Reply::Hello { version: VERSION },
            Request::Counters => Reply::Refused(Refusal::BadRequest),
            _ => Reply::Refused(Refusal::NoResult),
        }
    };
    let mut client = Client::new(Answering::with(answer), TIMING);
    client.hello().unwrap();
    for request in [Request::Outcome, Request::Counters, Request::Outcome, Request::Outcome] {
        assert!(client.ask(&request).is_err());
    }
    drop(client);
    assert_eq!(due, [0, 1, 2, 2, 3]);
}

proptest! {
    #![proptest_config(Config { cases: 12, failure_persistence: None, ..Config::default() })]

    /// Points or a depth image, whatever the line does, within what forty attempts can mend.
    #[test]
    fn any_bad_line_ends_with_the_right_bits(
        seed: u64,
        damage in 0.0..0.1,
        loss in 0.0..0.1,
        repetition in 0.0..0.1,
        mut resets in prop::collection::vec(1u64..300, 0..3),
        batch in 5usize..=MAX_BATCH,
    ) {
        resets.sort_unstable();
        for (sent, batch) in [(small(), batch), (small_depth(), batch * MAX_PIXELS / MAX_BATCH)] {
            let faults = Faults { damage, loss, repetition, resets: resets.clone() };
            let line = HostEnd::start(small().model.clone(), 10_000, faults, seed);
            let mut client = Client::new(&line, TIMING);
            client.hello().unwrap();
            prop_assert_eq!(completed_of(sent, &mut client, 1, batch).unwrap(), sent.digests);
        }
    }
}

proptest! {
    #[test]
    fn distances_come_back_from_any_voxel(
        seed: u64,
        first in 0.0..1.0,
        spread in 1i32..70_000,
    ) {
        let model = model();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let means: Vec<i16> = means(&model);
        let near = |mean: i16, change: i32| (i32::from(mean) + change).clamp(-32768, 32767) as i16;
        let distances: Vec<i16> = means.iter().map(|&m| near(m, rng.random_range(-spread..spread))).collect();
        let first = (first * means.len() as f64) as usize;
        let mut bytes = [0; MAX_DATA];
        let mut packer = Packer::new(&mut bytes);
        let sent = distances.iter().zip(&means).skip(first).take_while(|&(&d, &m)| packer.push(d, m)).count();
        let mut back = vec![0; means.len()];
        prop_assert_eq!(unpack(&model, first, packer.finish(), &mut back), Some(sent));
        prop_assert_eq!(&back[first..first + sent], &distances[first..first + sent]);
        prop_assert!(sent >= MAX_DATA / 3 || first + sent == means.len());
    }

    /// No panic, no point that integers do not hold, and never more of them than there are places for.
    #[test]
    fn any_depth_image_is_survived(
        numbers: [f32; 6],
        sizes in (1u16..40, 1u16..12, 1u8..4, 1u16..4),
        wild: bool,
        room in 0usize..500,
        pixels in prop::collection::vec(any::<u16>(), 0..480),
    ) {
        let (width, height, reach, stride) = sizes;
        let [fx, fy, cx, cy, unit, jump] = if wild { numbers } else { [30.0, 30.0, 20.0, 6.0, 0.01, 1000.0] };
        let camera = Camera { width, height, fx, fy, cx, cy, unit };
        let frame = Frame { camera, jump, reach, stride, view: Pose::IDENTITY };
        let mut memory = vec![0; frame.required()];
        let Ok(mut rows) = Rows::new(frame, 0.01, &mut memory) else { return Ok(()) };
        let mut points = vec![[0; 6]; room];
        let mut count = 0;
        for (v, row) in (0..height).zip(pixels.chunks(width.into())) {
            let next = camera.number(0, v);
            let Some(made) = rows.take(next, (0, v), row.iter().copied(), &mut points[count..]) else { break };
            count += made;
        }
        let cloud = lacuna::Cloud::new(&points[..count], 0.01).unwrap();
        for (_, normal) in (0..count).filter_map(|i| cloud.point(i)) {
            let length: f32 = normal.iter().map(|c| c * c).sum();
            prop_assert!((length - 1.0).abs() < 1e-3, "{normal:?}");
        }
    }

    #[test]
    fn any_bytes_from_a_device_are_survived(bytes: Vec<u8>, first in 0usize..40_000) {
        let model = model();
        let mut distances = vec![0; model.voxels()];
        unpack(&model, first, &bytes, &mut distances);
        let mut receiver = Receiver::new();
        for byte in bytes {
            if receiver.push(byte) == Event::Frame {
                receiver.message::<Request<'_>>();
            }
        }
    }
}

/// `LACUNA_WIRE_FRAMES` sets how many; a million take about a minute.
#[test]
fn rubbish_does_not_upset_the_device() {
    let wanted =
        std::env::var("LACUNA_WIRE_FRAMES").ok().and_then(|text| text.parse().ok()).unwrap_or(20_000);
    let line = HostEnd::start(small().model.clone(), 10_000, Faults::default(), 1);
    let mut rubbish = Rubbish::new(&small().scan, 5);
    let (mut sent, mut answered, mut buffer) = (0u64, 0u64, vec![0; 1 << 16]);
    while sent < wanted {
        for frame in rubbish.some() {
            (&line).send(&frame).unwrap();
            sent += 1;
            answered += u64::from((&line).receive(&mut buffer, Duration::ZERO).unwrap() > 0);
        }
    }
    println!("{sent} frames of rubbish, {answered} answered");
    assert!(line.is_alive() && answered > sent / 3);
    let mut client = Client::new(&line, TIMING);
    client.hello().unwrap();
    assert_eq!(completed(&mut client, 4_000_000_000, MAX_BATCH).unwrap(), small().digests);
}

#[test]
fn a_device_with_a_damaged_model_says_so_and_refuses_all_else() {
    let mut damaged = small().model.clone();
    damaged[2000] ^= 4;
    let line = HostEnd::start(damaged, 100, Faults::default(), 1);
    let mut client = Client::new(&line, TIMING);
    client.hello().unwrap();
    assert_eq!(client.info().unwrap().model, Err(Error::Damaged));
    let again = client.ask(&Request::Hello { version: VERSION });
    assert!(matches!(again, Ok(Reply::Hello { version: VERSION })), "{again:?}");
    for request in
        [Request::Begin(small().scan.begin), Request::Fit, Request::Status, Request::Distances { first: 0 }]
    {
        let answer = client.ask(&request);
        assert!(matches!(answer, Err(device::Error::Refused(Refusal::Core(Error::Damaged)))), "{answer:?}");
    }
}

#[test]
fn memory_that_is_too_small_is_told_before_a_point_is_sent() {
    let memory = DeviceMemory::new(&small().model, 100).without_fit();
    let line = HostEnd::serving(small().model.clone(), memory, Faults::default(), 1);
    let mut client = Client::new(&line, TIMING);
    client.hello().unwrap();
    let told = client.info().unwrap().model.unwrap_err();
    assert!(matches!(told, Error::BufferTooSmall { given: 0, .. }), "{told:?}");
}

fn assert_refused(client: &mut Client<&HostEnd>, request: &Request<'_>, expected: Refusal) {
    let answer = client.ask(request);
    assert!(matches!(&answer, Err(device::Error::Refused(found)) if *found == expected), "{answer:?}");
}

#[test]
fn each_wrong_request_is_refused_by_name() {
    let line = HostEnd::start(small().model.clone(), 50, Faults::default(), 1);
    let client = &mut Client::new(&line, TIMING);
    let begin = Begin { points: 20, ..small().scan.begin };
    assert_refused(client, &Request::Status, Refusal::WrongSession { current: 0 });
    assert_refused(client, &Request::Hello { version: 9 }, Refusal::UnknownVersion { spoken: VERSION });
    client.hello().unwrap();
    let points = |first, batch| Request::Points { first, batch };
    let without_scan = [
        (Request::Fit, Refusal::NoScan),
        (points(0, &[0; 12]), Refusal::NoScan),
        (Request::Outcome, Refusal::NoResult),
        (Request::DepthRows { row: 0, column: 0, pixels: &[0; 2] }, Refusal::NoScan),
        (Request::Begin(Begin { points: 51, ..begin }), Refusal::TooManyPoints { limit: 50 }),
        (Request::Begin(Begin { step: 0.0, ..begin }), Refusal::Core(Error::Option(OptionName::CloudStep))),
        (
            Request::Begin(Begin { pose: Pose { scale: f32::NAN, ..begin.pose }, ..begin }),
            Refusal::Core(Error::Pose),
        ),
    ];
    for (request, refusal) in without_scan {
        assert_refused(client, &request, refusal);
    }
    client.status(&Request::Begin(begin)).unwrap();
    let with_scan = [
        (points(1, &[0; 12]), Refusal::WrongPlace { received: 0 }),
        (points(0, &[0; 13]), Refusal::BrokenBatch),
        (points(0, &[0; 12 * 21]), Refusal::TooManyPoints { limit: 20 }),
        (Request::Fit, Refusal::PointsMissing { received: 0, announced: 20 }),
        (Request::DepthRows { row: 0, column: 0, pixels: &[0; 2] }, Refusal::WrongKind),
    ];
    for (request, refusal) in with_scan {
        assert_refused(client, &request, refusal);
    }
}

/// The small head's depth image, and a device with room for `points`.
fn depth_begin(points: u32) -> (BeginDepth, HostEnd) {
    let scan = &small_depth().scan;
    let frame = scan.depth.as_ref().unwrap().frame;
    let line = HostEnd::start(small().model.clone(), points as usize, Faults::default(), 1);
    (BeginDepth { begin: Begin { points, ..scan.begin }, frame }, line)
}

#[test]
fn a_depth_image_with_impossible_numbers_is_refused_by_name() {
    let (begin, line) = depth_begin(5000);
    let client = &mut Client::new(&line, TIMING);
    client.hello().unwrap();
    let frame = begin.frame;
    let option = |name| Refusal::Core(Error::Option(name));
    let camera = |camera: Camera| Frame { camera, ..frame };
    let c = frame.camera;
    let flat = Pose { scale: f32::NAN, ..frame.view };
    let [x, y, _] = frame.view.rotation;
    let sheared = Pose { rotation: [x, y, y], ..frame.view };
    let frames = [
        (camera(Camera { width: 0, ..c }), option(OptionName::ImageSize)),
        (camera(Camera { fx: 0.0, ..c }), option(OptionName::FocalLength)),
        (camera(Camera { fy: f32::NAN, ..c }), option(OptionName::FocalLength)),
        (camera(Camera { cx: f32::NAN, ..c }), option(OptionName::PrincipalPoint)),
        (camera(Camera { unit: 0.0, ..c }), option(OptionName::DepthUnit)),
        (camera(Camera { width: 2000, ..c }), Refusal::ImageTooWide { limit: 2560, needed: 4000 }),
        (Frame { jump: f32::INFINITY, ..frame }, option(OptionName::DepthJump)),
        (Frame { stride: 0, ..frame }, option(OptionName::PixelStride)),
        (Frame { reach: 0, ..frame }, option(OptionName::PixelStride)),
        (Frame { view: flat, ..frame }, Refusal::Core(Error::Pose)),
        (Frame { view: sheared, ..frame }, Refusal::Core(Error::Pose)),
    ];
    for (frame, refusal) in frames {
        assert_refused(client, &Request::BeginDepth(BeginDepth { frame, ..begin }), refusal);
    }
    let step = Begin { step: f32::NAN, ..begin.begin };
    let step = Request::BeginDepth(BeginDepth { begin: step, ..begin });
    assert_refused(client, &step, option(OptionName::CloudStep));
    assert_eq!(client.status(&Request::Status).unwrap().state, State::Idle);
}

#[test]
fn pixels_that_do_not_follow_are_refused_and_change_nothing() {
    let (begin, line) = depth_begin(5000);
    let client = &mut Client::new(&line, TIMING);
    client.hello().unwrap();
    let Camera { width, height, .. } = begin.frame.camera;
    let announced = client.status(&Request::BeginDepth(begin)).unwrap().announced;
    assert_eq!(announced, u32::from(width) * u32::from(height));
    let rows = |row, column, pixels| Request::DepthRows { row, column, pixels };
    let pixels = [0; 2 * 97];
    let half = client.status(&rows(0, 0, &pixels[..96])).unwrap();
    assert_eq!((half.received, half.state), (48, State::Receiving));
    let wrong = [
        (rows(0, 0, &pixels[..2]), Refusal::WrongRow { row: 0, column: 48 }),
        (rows(0, 47, &pixels[..98]), Refusal::WrongRow { row: 0, column: 48 }),
        (rows(0, width, &[]), Refusal::WrongRow { row: 0, column: 48 }),
        (rows(height, 0, &pixels[..2]), Refusal::WrongRow { row: 0, column: 48 }),
        (rows(0, 48, &pixels[..98]), Refusal::RowTooLong { width }),
        (rows(0, 48, &pixels[..3]), Refusal::BrokenBatch),
        (Request::Points { first: 0, batch: &[] }, Refusal::WrongKind),
        (Request::Fit, Refusal::RowsMissing { received: 0, announced: height }),
    ];
    for (request, refusal) in wrong {
        assert_refused(client, &request, refusal);
    }
    assert_eq!(client.status(&rows(0, 48, &pixels[..96])).unwrap().received, 96);
    assert_eq!(client.status(&rows(7, 0, &pixels[..2])).unwrap().received, 7 * 96 + 1, "six rows left out");
    let missing = Refusal::RowsMissing { received: 7, announced: height };
    assert_refused(client, &Request::Fit, missing);
    client.status(&rows(height - 1, width - 1, &pixels[..2])).unwrap();
    assert_refused(client, &rows(height, 0, &[]), Refusal::WrongRow { row: height, column: 0 });
    let nothing = Refusal::Core(Error::TooFewPoints { given: 0 });
    assert_refused(client, &Request::Fit, nothing);
}

/// Asks until a fit has ended.
fn ended(client: &mut Client<&HostEnd>) -> Status {
    loop {
        let status = client.status(&Request::Status).unwrap();
        if !matches!(status.state, State::Fitting { .. }) {
            return status;
        }
    }
}

#[test]
fn a_fit_that_failed_says_why_begins_anew_when_asked_and_a_new_scan_is_welcome() {
    let line = HostEnd::start(small().model.clone(), 10_000, Faults::default(), 1);
    let client = &mut Client::new(&line, TIMING);
    client.hello().unwrap();
    let scan = &small().scan;
    let far = Pose { translation: [9e3; 3], ..scan.begin.pose };
    let begin = Begin { pose: far, hint: Hint::Exact, ..scan.begin };
    let mut status = client.status(&Request::Begin(begin)).unwrap();
    while status.received < status.announced {
        let first = status.received;
        status = client.status(&Request::Points { first, batch: &scan.points_after(first) }).unwrap();
    }
    for time in ["first", "second"] {
        let begun = client.status(&Request::Fit).unwrap();
        assert!(matches!(begun.state, State::Fitting { .. }), "{time}: {begun:?}");
        status = ended(client);
        assert_eq!(status.state, State::Failed(Error::EmptyHull), "{time}");
    }
    let first = status.received;
    assert_refused(client, &Request::Points { first, batch: &[] }, Refusal::Busy);
    assert_refused(client, &Request::DepthRows { row: 0, column: 0, pixels: &[] }, Refusal::Busy);
    // The same by way of the host, as a scan of its own.
    let missing = Scan { begin: Begin { scan: 6, ..begin }, ..scan.clone() };
    let failed = run(client, &Model::from_bytes(&small().model).unwrap(), &missing, &mut |_| ());
    let expected = matches!(failed, Err(device::Error::Refused(Refusal::Core(Error::EmptyHull))));
    assert!(expected, "{:?}", failed.err());
    assert_eq!(completed(client, 7, MAX_BATCH).unwrap(), small().digests);
}

#[test]
fn a_device_with_less_room_than_the_scan_refuses_it_with_its_limit() {
    let (mut begin, line) = depth_begin(50);
    let small = small_depth();
    let model = Model::from_bytes(&small.model).unwrap();
    let client = &mut Client::new(&line, TIMING);
    client.hello().unwrap();
    for scan in [&small.scan, &lacuna_tests::small::small().scan] {
        let refused = run(client, &model, scan, &mut |_| ()).unwrap_err();
        assert!(
            matches!(refused, device::Error::Refused(Refusal::TooManyPoints { limit: 50 })),
            "{refused:?}"
        );
        assert!(refused.to_string().contains("at most 50 points"), "{refused}");
    }
    // An image that gives more points than announced is refused at the row that does, which changes nothing.
    begin.begin.points = 20;
    let scan = Scan { begin: begin.begin, ..small.scan.clone() };
    let refused = run(client, &model, &scan, &mut |_| ()).unwrap_err();
    assert!(matches!(refused, device::Error::Refused(Refusal::TooManyPoints { limit: 20 })), "{refused:?}");
    let status = client.status(&Request::Status).unwrap();
    assert_eq!(status.state, State::Receiving);
    assert!(status.received > 0 && status.received < status.announced, "{status:?}");
}

#[test]
fn after_the_fit_points_and_results_beyond_the_end_are_refused() {
    let line = HostEnd::start(small().model.clone(), 10_000, Faults::default(), 1);
    let client = &mut Client::new(&line, TIMING);
    client.hello().unwrap();
    completed(client, 1, MAX_BATCH).unwrap();
    let voxels = Model::from_bytes(&small().model).unwrap().header().voxels;
    assert_refused(client, &Request::Points { first: 0, batch: &[] }, Refusal::Busy);
    let beyond = Request::Distances { first: voxels + 1 };
    assert_refused(client, &beyond, Refusal::OutOfRange { limit: voxels });
    let beyond = Request::Weights { of: Vector::Global, first: 100 };
    assert_refused(client, &beyond, Refusal::OutOfRange { limit: 7 });
    let idle = client.status(&Request::Cancel).unwrap();
    assert_eq!((idle.state, idle.scan), (State::Idle, 0));
}

/// The hint goes with the scan: the device refines the pose by the last rounds only, as the host does.
#[test]
fn a_settled_pose_is_refined_as_on_the_host() {
    let small = small();
    let model = Model::from_bytes(&small.model).unwrap();
    let begin = Begin { hint: Hint::Settled, ..small.scan.begin };
    let points = PackedPoints { points: small.scan.points.clone(), step: begin.step };
    let here = fit::<Fixed>(&model, &points, &begin.pose, begin.settings(&model)).unwrap().digests;
    let line = HostEnd::start(small.model.clone(), 10_000, Faults::default(), 1);
    let mut client = Client::new(&line, TIMING);
    client.hello().unwrap();
    let scan = Scan { begin, ..small.scan.clone() };
    let results = run(&mut client, &model, &scan, &mut |_| ()).unwrap();
    assert_eq!(results.into_fit(&model, &begin).unwrap().digests, here);
    assert_ne!(here.pose, small.digests.pose, "a rough pose is refined otherwise");
}

/// All refusals, by their numbers on the line.
fn refusals() -> Vec<Refusal> {
    let numbered = |outer: u8| {
        (0..64u8).flat_map(move |middle| (0..64u8).map(move |inner| [outer, middle, inner, 0, 0, 0, 0, 0]))
    };
    let all = (0..64u8).flat_map(numbered).filter_map(|bytes| postcard::from_bytes(&bytes).ok());
    let mut refusals: Vec<Refusal> = all.collect();
    refusals.dedup();
    refusals
}

#[test]
fn every_refusal_has_a_sentence_of_its_own() {
    let name = |refusal: &Refusal| {
        let text = format!("{refusal:?}");
        text.split(|c: char| !c.is_alphanumeric() && c != '(').next().unwrap_or_default().to_owned()
    };
    let sentences: BTreeSet<(String, String)> = refusals().iter().map(|r| (name(r), refusal(r))).collect();
    let kinds: BTreeSet<&String> = sentences.iter().map(|(kind, _)| kind).collect();
    assert!(kinds.len() >= 33, "{kinds:?}");
    let different: BTreeSet<&String> = sentences.iter().map(|(_, sentence)| sentence).collect();
    for (kind, sentence) in &sentences {
        assert!(sentence.len() > 20, "{kind}: {sentence}");
    }
    assert_eq!(different.len(), sentences.len(), "two refusals share a sentence");
}
