//! Marching cubes of any volume: a manifold, closed where the rim is outside, and fit for what follows.

use super::source::Source;
use lacuna_host::mesh::{Mesh, Point};
use lacuna_host::surface::{
    Edges, Volume, components, is_manifold, largest_component, marching_cubes, trim_rim,
};

/// Most voxels along a side.
const SIDE: usize = 9;

/// Decodes a volume and extracts its surface.
pub fn run(bytes: &[u8]) {
    let mut source = Source(bytes);
    let flags = source.byte();
    let dims = std::array::from_fn(|_| source.below(SIDE + 1));
    let count: usize = dims.iter().product();
    let mut values: Vec<f32> = (0..count).map(|_| value(flags, &mut source)).collect();
    let closed = flags & 4 != 0;
    if closed {
        (0..count).filter(|&i| is_rim(i, dims)).for_each(|i| values[i] = 1.0);
    }
    let mesh = marching_cubes(&Volume { dims, values: &values }, &Point::origin(), 2.0);
    let known = values.iter().all(|v| v.is_finite());
    check(&mesh, closed, known);
}

/// Dents, checkers, holes and extremes.
pub fn seeds() -> Vec<Vec<u8>> {
    let ball: Vec<u8> = (0..512i32)
        .map(|i| {
            let [x, y, z] = [i % 8, i / 8 % 8, i / 64].map(|c| 2 * c - 7);
            (((x * x + y * y + z * z) - 20) / 4).clamp(-127, 127) as u8
        })
        .collect();
    let checkers: Vec<u8> = (0..216).map(|i| if (i + i / 6 + i / 36) % 2 == 0 { 16 } else { 240 }).collect();
    let holes: Vec<u8> = ball.iter().map(|&v| if v % 5 == 0 { 128 } else { v }).collect();
    vec![
        [&[4, 8, 8, 8][..], &ball].concat(),
        [&[0, 6, 6, 6][..], &checkers].concat(),
        [&[6, 8, 8, 8][..], &holes].concat(),
        [&[1, 2, 3, 2][..], &[0x7f; 48]].concat(),
    ]
}

fn value(flags: u8, source: &mut Source<'_>) -> f32 {
    if flags & 1 != 0 {
        return source.float();
    }
    let byte = source.byte() as i8;
    if flags & 2 != 0 && byte == i8::MIN { f32::NAN } else { f32::from(byte) / 16.0 }
}

fn is_rim(index: usize, [nx, ny, nz]: [usize; 3]) -> bool {
    let place = [index % nx, index / nx % ny, index / nx / ny];
    place.iter().zip([nx, ny, nz]).any(|(&i, n)| i == 0 || i + 1 == n)
}

fn check(mesh: &Mesh, closed: bool, known: bool) {
    let edges = Edges::of(mesh);
    assert_eq!(edges.non_manifold(), 0);
    assert!(mesh.points.iter().all(|p| p.iter().all(|c| c.is_finite())));
    if known {
        assert!(is_manifold(mesh));
        assert!(!closed || edges.boundary().count() == 0);
    }
    let pieces = components(mesh);
    assert_eq!(pieces.len(), mesh.triangles.len());
    assert!(largest_component(mesh).triangles.len() <= mesh.triangles.len());
    assert_eq!(Edges::of(&trim_rim(mesh, 1)).non_manifold(), 0);
}
