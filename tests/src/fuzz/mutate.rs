//! Random changes of an input, from a seed.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Longest input that is made.
const LONGEST: usize = 1 << 14;

/// Numbers at which programs break.
const EDGES: [u32; 10] = [0, 1, 0x7f, 0x80, 0xff, 0x7fff, 0xffff, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff];

/// One of `seeds`, changed in one to eight places: the same for the same number.
pub fn mutated(seeds: &[Vec<u8>], number: u64) -> Vec<u8> {
    let mut rng = ChaCha8Rng::seed_from_u64(number);
    let pick = |rng: &mut ChaCha8Rng| seeds[rng.random_range(0..seeds.len())].clone();
    let mut bytes = pick(&mut rng);
    let other = pick(&mut rng);
    for _ in 0..rng.random_range(1..=8) {
        change(&mut bytes, &other, &mut rng);
    }
    bytes.truncate(LONGEST);
    bytes
}

fn change(bytes: &mut Vec<u8>, other: &[u8], rng: &mut ChaCha8Rng) {
    let at = rng.random_range(0..=bytes.len());
    let length = rng.random_range(0..=(bytes.len() - at).min(64));
    match rng.random_range(0..9) {
        0 => bytes.truncate(at),
        1 => drop(bytes.drain(at..at + length)),
        2 => {
            let again = bytes[at..at + length].to_vec();
            bytes.splice(at..at, again);
        }
        3 => {
            let from = rng.random_range(0..=other.len());
            let piece = &other[from..other.len().min(from + 64)];
            bytes.splice(at..at + length, piece.iter().copied());
        }
        4 => bytes[at..at + length].iter_mut().for_each(|byte| *byte = rng.next_u32() as u8),
        5 | 6 => {
            let width = [1, 2, 4][rng.random_range(0..3)];
            let mut number = EDGES[rng.random_range(0..EDGES.len())].to_le_bytes();
            if rng.random_bool(0.5) {
                number[..width].reverse();
            }
            bytes.iter_mut().skip(at).zip(&number[..width]).for_each(|(to, from)| *to = *from);
        }
        _ => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << rng.random_range(0..8);
            }
        }
    }
}
