//! The neighbourhoods of a scan's points, from narrow to wide, and the quadric that is fitted to each of them.

use crate::cubes::{self, Cube, cube};
use crate::mesh::{Mesh, Point, Vector};
use crate::quantile::median;
use crate::surface::{Moments, Quadric};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Points in the narrowest neighbourhood, about; a quadric has six terms.
const POINTS: f64 = 14.0;
/// Fewest points for a quadric.
const FEWEST: f64 = 10.0;
/// Each neighbourhood has this many times the points of the one before.
const GROWTH: f64 = 1.6;
/// Neighbourhoods of a point, up to 376 points. They come up to the widest earlier where points are far apart.
const WIDTHS: usize = 8;
/// Half of a confidence interval, standard deviations.
const CONFIDENCE: f64 = 2.0;
/// Farthest that noise throws a point off the quadric around it, standard deviations: one of 16,000 is farther.
const TAIL: f64 = 4.0;
/// Of the nearest points around one that noise has thrown off, at most this share lie nearer to it than to the quadric: at three
/// deviations 7 % would by chance; on a ridge as wide as three points three in five do.
const COMPANY: f64 = 0.25;
/// Narrowest radius in deviations of the noise: a ball that is less wide than the noise is high has half of it outside.
const NARROWEST: f64 = 2.0;
/// The neighbourhood of a disc comes so many after the narrowest: 1.6³ times as many points.
const DISC: usize = 3;
/// Share of the samples that must have a quadric.
const DENSE: f64 = 0.5;
/// Points of a cube that are looked at, at most, so that a heap of points takes no longer than a surface.
const CROWD: usize = 512;

/// What is around the points of a scan.
pub struct Neighbourhoods<'a> {
    scan: &'a Mesh,
    normals: &'a [Vector],
    cells: Cells,
    radii: [f64; WIDTHS],
    /// The narrowest neighbourhood that is used.
    first: usize,
}

impl<'a> Neighbourhoods<'a> {
    /// Of the `used` points of a scan, none wider than `widest`; the narrowest has about [`POINTS`] points at the `samples`.
    /// Neighbours are looked for `as_high` as that, too, or no farther off than the widest neighbourhood is wide. `None` where
    /// the narrowest would be wider than `widest`.
    pub fn new(
        (scan, normals): (&'a Mesh, &'a [Vector]),
        used: &[usize],
        samples: &[usize],
        widest: f64,
        as_high: bool,
    ) -> Option<Self> {
        let cells = |edge: f64| Cells::new((&scan.points, normals), used, edge);
        let high = cells(widest);
        let radii = radii(&high, (scan, normals), samples, widest)?;
        let cells = if as_high { high } else { cells(radii[WIDTHS - 1]) };
        Some(Self { scan, normals, cells, radii, first: 0 })
    }

    /// Edge of the cubes that neighbours are looked for in.
    pub const fn edge(&self) -> f64 {
        self.cells.edge
    }

    /// What becomes of a point where the scan has so much noise; `None` where it has no neighbourhood.
    pub fn moved(&self, i: usize, noise: f64) -> Option<Move> {
        self.quadrics(i).chosen(noise)
    }

    /// The noise, by the narrowest neighbourhood that is wide enough for it, which becomes the first; `None` where too few
    /// of the `samples` have one.
    pub fn noise(&mut self, samples: &[usize]) -> Option<f64> {
        loop {
            let variance = |&i: &usize| Some(self.quadrics(i).at[self.first]?.variance);
            let found: Vec<f64> = samples.par_iter().filter_map(variance).collect();
            let dense = found.len() as f64 >= DENSE * samples.len() as f64;
            let noise = median(found).filter(|_| dense).map(f64::sqrt);
            let radius = self.radii[self.first];
            if radius >= self.radii[WIDTHS - 1] || noise.is_some_and(|noise| radius >= NARROWEST * noise) {
                return noise;
            }
            self.first += 1;
        }
    }

    /// A disc around a point, four times as many points as the narrowest neighbourhood that is used, and as far up and down
    /// as neighbours are looked for: the way that it faces, and the points that face its way, along and over it.
    pub fn disc(&self, i: usize) -> (Vector, impl Iterator<Item = [f64; 3]>) {
        let radius = self.radii[(self.first + DISC).min(WIDTHS - 1)];
        let Around { axes: [.., normal], offsets } = self.around(i);
        (normal, offsets.into_iter().filter(move |[u, v, _]| u * u + v * v <= radius * radius))
    }

    /// What is around a point.
    fn around(&self, i: usize) -> Around {
        let here = &self.scan.points[i];
        let mut near: Vec<(f64, &Member)> = Vec::new();
        self.cells.near(here, self.cells.edge, |member, squared, _| near.push((squared, member)));
        let normal = self.facing(i, &near);
        let across = Vector::ith(normal.iamin(), 1.0).cross(&normal).normalize();
        let axes = [across, normal.cross(&across), normal];
        let same = near.iter().filter(|(_, near)| near.normal.dot(&normal) > 0.0);
        let offset = |near: &Member| axes.map(|axis| (near.point - here).dot(&axis));
        Around { axes, offsets: same.map(|(_, near)| offset(near)).collect() }
    }

    /// The quadrics around a point.
    fn quadrics(&self, i: usize) -> Quadrics {
        let Around { axes, offsets } = self.around(i);
        // Each point in the narrowest neighbourhood that it is in; a wider one has those of the narrower ones.
        let mut rings = [Moments::default(); WIDTHS];
        let mut beside = Vec::new();
        for [u, v, h] in offsets {
            let within = |radius: &f64| u * u + v * v <= radius * radius;
            if let Some(ring) = self.radii.iter().position(within) {
                rings[ring].add(u, v, h);
                if ring == 0 && self.first > 0 {
                    beside.push(h);
                }
            }
        }
        let mut sum = Moments::default();
        let at = std::array::from_fn(|k| {
            sum += rings[k];
            let wider = k == 0 || self.radii[k] > self.radii[k - 1];
            (k >= self.first && wider).then(|| sum.fit(FEWEST)).flatten()
        });
        Quadrics { axes, at, beside }
    }

    /// The way that the surface around a point faces: noise tilts what lies next to it.
    fn facing(&self, i: usize, near: &[(f64, &Member)]) -> Vector {
        let wide = (self.first + WIDTHS / 2).min(WIDTHS - 1);
        [self.first, wide].iter().fold(self.normals[i], |facing, &k| {
            let reach = self.radii[k] * self.radii[k];
            let within = near.iter().filter(|(squared, _)| *squared <= reach).map(|(_, near)| near.normal);
            let sum: Vector = within.filter(|normal| normal.dot(&facing) > 0.0).sum();
            sum.try_normalize(0.0).unwrap_or(facing)
        })
    }
}

/// The radii of the neighbourhoods, none above `widest`; `None` where the narrowest would be.
fn radii(
    cells: &Cells,
    (scan, facing): (&Mesh, &[Vector]),
    samples: &[usize],
    widest: f64,
) -> Option<[f64; WIDTHS]> {
    let count = |&i: &usize| {
        let mut count = 0.0;
        cells.near(&scan.points[i], widest, |near, _, of| {
            count += if near.normal.dot(&facing[i]) > 0.0 { of } else { 0.0 };
        });
        count
    };
    let typical = median(samples.par_iter().map(count).collect())?;
    // On a surface their number grows with the square of the radius.
    let narrow = widest * (POINTS / typical).sqrt();
    let radius = |k: usize| (narrow * libm::pow(GROWTH, k as f64 / 2.0)).min(widest);
    (narrow < widest).then(|| std::array::from_fn(radius))
}

/// A point with its normal: what lies in a cube lies together in memory.
struct Member {
    point: Point,
    normal: Vector,
}

/// The points of a scan by cubes.
struct Cells {
    edge: f64,
    cubes: FxHashMap<Cube, Vec<Member>>,
}

impl Cells {
    fn new((points, normals): (&[Point], &[Vector]), used: &[usize], edge: f64) -> Self {
        let mut cubes: FxHashMap<Cube, Vec<Member>> = FxHashMap::default();
        for &i in used {
            let member = Member { point: points[i], normal: normals[i] };
            cubes.entry(cube(&points[i], edge)).or_default().push(member);
        }
        Self { edge, cubes }
    }

    /// Calls `found` with points within `radius`, at most the cubes' edge, their squared distance, and how many each
    /// stands for in a crowd.
    fn near<'a>(&'a self, p: &Point, radius: f64, mut found: impl FnMut(&'a Member, f64, f64)) {
        for members in cubes::around(cube(p, self.edge)).filter_map(|cube| self.cubes.get(&cube)) {
            let of = members.len().div_ceil(CROWD);
            for member in members.iter().step_by(of) {
                let squared = (member.point - p).norm_squared();
                if squared <= radius * radius {
                    found(member, squared, of as f64);
                }
            }
        }
    }
}

/// The points around one that face its way.
struct Around {
    /// Across and along the surface, and the way that it faces.
    axes: [Vector; 3],
    /// From the point, along these.
    offsets: Vec<[f64; 3]>,
}

/// The quadrics around a point, from narrow to wide.
struct Quadrics {
    /// Across and along the surface, and the way that it faces.
    axes: [Vector; 3],
    at: [Option<Quadric>; WIDTHS],
    /// Heights of the nearest points, itself among them, where neighbourhoods are wider for the noise.
    beside: Vec<f64>,
}

/// What becomes of a point.
pub struct Move {
    /// From where it was measured.
    pub motion: Vector,
    /// Unit normal of the surface there.
    pub normal: Vector,
    /// One standard deviation of the noise that is left.
    pub deviation: f64,
}

impl Quadrics {
    /// Onto the widest that agrees with all narrower ones and with the point.
    fn chosen(&self, noise: f64) -> Option<Move> {
        let half = |share: f64| CONFIDENCE * noise * share.sqrt();
        let thrown = !self.beside.is_empty() && self.thrown(noise);
        let own = if thrown { f64::INFINITY } else { half(1.0) };
        let (mut low, mut high) = (-own, own);
        let mut chosen = None;
        for quadric in self.at.iter().flatten() {
            low = low.max(quadric.height - half(quadric.share));
            high = high.min(quadric.height + half(quadric.share));
            if low > high {
                break;
            }
            chosen = Some(quadric);
        }
        let Quadric { height, slope, share, .. } = chosen?;
        let [across, along, normal] = self.axes;
        Some(Move {
            motion: normal * *height,
            normal: (normal - across * slope[0] - along * slope[1]).normalize(),
            deviation: noise * share.sqrt(),
        })
    }

    /// Whether a point that the narrowest quadric does not agree with may be where it is by noise alone; it has no say then.
    /// Left where it is, it would be a pit in the surface.
    fn thrown(&self, noise: f64) -> bool {
        let Some(&Quadric { height, share, .. }) = self.at.iter().flatten().next() else { return false };
        let off = height.abs() / noise;
        let by_noise = off > CONFIDENCE * (1.0 + share.sqrt()) && off <= TAIL * (1.0 - share).max(0.0).sqrt();
        let with_it = self.beside.iter().filter(|beside| 2.0 * beside.abs() < height.abs()).count();
        by_noise && with_it.saturating_sub(1) as f64 <= COMPANY * (self.beside.len() - 1) as f64
    }
}
