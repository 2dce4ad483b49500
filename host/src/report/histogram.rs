//! How far the scan's vertices lie from the fitted surfaces, as numbers and as a drawing.

use super::html::escape;
use crate::distance::Surface;
use crate::mesh::Mesh;
use crate::unit::digits;
use rayon::prelude::*;
use std::fmt::Write;

/// Bars on either side of zero.
const HALF: usize = 20;
const SIZE: [f64; 2] = [640.0, 240.0];
/// Room for the labels below.
const FOOT: f64 = 28.0;

/// Distances of the seen surface, positive outside the fitted one.
pub struct Distances {
    /// Ascending.
    sorted: Vec<f64>,
}

impl Distances {
    /// From the vertices of `scan` to `fitted`, up to `reach`; vertices beyond its rim are not on the class's part
    /// of the surface and are left out.
    pub fn new(scan: &Mesh, fitted: &Mesh, reach: f64) -> Self {
        let Some(surface) = Surface::new(fitted) else { return Self { sorted: Vec::new() } };
        let distance = |p| surface.distance(p, reach).filter(|d| !d.on_border).map(|d| d.value);
        let mut sorted: Vec<f64> = scan.points.par_iter().filter_map(distance).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        Self { sorted }
    }

    /// How many vertices were measured.
    pub fn count(&self) -> usize {
        self.sorted.len()
    }

    /// Root mean square.
    pub fn rms(&self) -> f64 {
        let squares: f64 = self.sorted.iter().map(|d| d * d).sum();
        (squares / self.sorted.len().max(1) as f64).sqrt()
    }

    /// What a share of the distances, signs aside, does not exceed.
    pub fn within(&self, share: f64) -> f64 {
        let mut sizes: Vec<f64> = self.sorted.iter().map(|d| d.abs()).collect();
        sizes.sort_unstable_by(f64::total_cmp);
        crate::quantile::quantile(&sizes, share).unwrap_or(0.0)
    }

    /// Share of the vertices in each bar; the outermost bars hold what lies beyond them.
    fn bars(&self, range: f64) -> [f64; 2 * HALF] {
        let mut bars = [0.0; 2 * HALF];
        let share = 1.0 / self.sorted.len().max(1) as f64;
        for d in &self.sorted {
            let place = ((d / range + 1.0) * HALF as f64).clamp(0.0, 2.0 * HALF as f64 - 1.0);
            bars[place as usize] += share;
        }
        bars
    }
}

/// A histogram as SVG: the local fit as bars, the global fit as a line.
pub fn drawing(local: &Distances, global: &Distances, range: f64, unit: &str) -> String {
    let (bars, line) = (local.bars(range), global.bars(range));
    let top = bars.iter().chain(&line).copied().fold(1e-9, f64::max);
    let [width, height] = SIZE;
    let base = height - FOOT;
    let step = width / (2 * HALF) as f64;
    let y = |share: f64| base - share / top * (base - 12.0);
    let mut out = format!(
        "<svg class=\"histogram\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"Histogram: {:.0} % of \
         the seen surface lies within {} {u} of the local fit, {} {u} of the global fit\">\n",
        95.0,
        digits(local.within(0.95), 2),
        digits(global.within(0.95), 2),
        u = escape(unit)
    );
    for (i, &share) in bars.iter().enumerate() {
        let _ = writeln!(
            out,
            "<rect class=\"bar\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
            i as f64 * step + 1.0,
            y(share),
            step - 2.0,
            base - y(share)
        );
    }
    let steps = line.iter().enumerate().map(|(i, &share)| format!("H{:.1}V{:.1}", i as f64 * step, y(share)));
    let _ = writeln!(
        out,
        "<path class=\"step\" d=\"M0 {base:.1}{}H{width}V{base:.1}\"/>\n<path class=\"axis\" d=\"M0 {base}H{width}\"/>",
        steps.collect::<String>()
    );
    for (i, anchor) in ["start", "middle", "middle", "middle", "end"].into_iter().enumerate() {
        let side = i as f64 / 2.0 - 1.0;
        let value = if i == 2 { "0".into() } else { format!("{:+}", side * range) };
        let x = width * (side + 1.0) / 2.0;
        let _ =
            writeln!(out, "<text x=\"{x}\" y=\"{}\" text-anchor=\"{anchor}\">{value}</text>", base + 20.0);
    }
    out + &format!(
        "</svg>\n<p class=\"key\"><span class=\"swatch bar\"></span> local fit <span class=\"swatch step\"></span> \
         global fit</p>\n<p class=\"note\">Distance from the fitted surface in {}, positive outside; the first and \
         the last bar hold all beyond.</p>\n",
        escape(unit)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_have_signs_and_all_of_them_are_in_a_bar() {
        let flat = |z: f64| {
            let points = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [2.0, 2.0]];
            let points = points.iter().map(|p| [p[0], p[1], z].into()).collect();
            Mesh { points, normals: vec![], triangles: vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]] }
        };
        let mut scan = flat(0.5);
        scan.points.push([1.0, 1.5, -9.0].into());
        // The corners of the scan lie over the fitted rim, its middle does not; the last point is beyond reach.
        let distances = Distances::new(&scan, &flat(0.0), 2.0);
        assert_eq!((distances.count(), distances.rms(), distances.within(0.5)), (1, 0.5, 0.5));
        for range in [0.1, 1.0] {
            assert!((distances.bars(range).iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        assert_eq!(distances.bars(1.0)[HALF + HALF / 2], 1.0);
        let none = Distances::new(&Mesh::default(), &Mesh::default(), 1.0);
        assert!(!drawing(&none, &none, 1.0, "mm").contains("NaN"));
    }
}
