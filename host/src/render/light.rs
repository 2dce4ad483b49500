//! Studio light for a matt surface, in linear colours.
//!
//! Directions are in view coordinates: the lamps move with the camera.

use nalgebra::Vector3;
use std::sync::LazyLock;

/// Linear red, green and blue, or a direction.
pub type Triple = Vector3<f32>;

/// A lamp: the direction towards it, its colour, and how far its light reaches around an edge.
struct Lamp {
    towards: [f32; 3],
    colour: [f32; 3],
    wrap: f32,
}

/// Large and warm, above left.
const KEY: Lamp = Lamp { towards: [-0.48, 0.56, 0.675], colour: [1.03, 0.97, 0.89], wrap: 0.45 };
/// Weak and cool, from the right.
const FILL: Lamp = Lamp { towards: [0.82, 0.05, 0.57], colour: [0.13, 0.15, 0.18], wrap: 0.60 };
/// From above, behind: lifts the outline off the shadow side.
const RIM: Lamp = Lamp { towards: [0.42, 0.62, -0.66], colour: [0.34, 0.36, 0.40], wrap: 0.10 };
/// Light from all around, above and below.
const SKY: [f32; 3] = [0.22, 0.24, 0.27];
const GROUND: [f32; 3] = [0.10, 0.085, 0.075];
/// Strength of the highlight.
const GLOSS: f32 = 0.045;
/// Halfway between the key lamp and the viewer.
const HALFWAY: [f32; 3] = [-0.262, 0.306, 0.915];

/// The surface where no colours are given: light clay.
pub const CLAY: [u8; 3] = [222, 209, 194];

/// What a back side keeps of its colour.
pub const BACK: [f32; 3] = [0.34, 0.36, 0.42];

/// The light that a surface sends to the viewer. `open` is how much of its surroundings is not
/// covered by other surfaces, 0 to 1.
pub fn reflect(normal: &Triple, colour: &Triple, open: f32) -> Triple {
    let from_lamps = [KEY, FILL, RIM].iter().fold(Triple::zeros(), |sum, lamp| sum + shine(lamp, normal));
    let height = 0.5 + 0.5 * normal.y;
    let around = Triple::from(GROUND).lerp(&Triple::from(SKY), height);
    let light = around * open + from_lamps * (0.35 + 0.65 * open);
    let highlight = normal.dot(&Triple::from(HALFWAY)).max(0.0).powi(24) * GLOSS * open;
    colour.component_mul(&light).add_scalar(highlight)
}

/// The square lets the light fade out smoothly where it ends.
fn shine(lamp: &Lamp, normal: &Triple) -> Triple {
    let slope = (normal.dot(&Triple::from(lamp.towards)) + lamp.wrap) / (1.0 + lamp.wrap);
    Triple::from(lamp.colour) * slope.max(0.0).powi(2)
}

/// A colour of a file or of the screen, made linear.
pub fn linear(colour: [u8; 3]) -> Triple {
    static TABLE: LazyLock<[f32; 256]> = LazyLock::new(|| {
        std::array::from_fn(|i| match i as f32 / 255.0 {
            low if low <= 0.04045 => low / 12.92,
            high => libm::powf((high + 0.055) / 1.055, 2.4),
        })
    });
    Triple::from(colour.map(|value| TABLE[usize::from(value)]))
}

/// Finest step of linear light that is told apart on the way to the screen.
const LEVELS: usize = 8192;

/// A linear colour, made fit for the screen.
pub fn screen(light: &Triple) -> [u8; 3] {
    static TABLE: LazyLock<Vec<u8>> = LazyLock::new(|| {
        let encode = |i: usize| match i as f32 / (LEVELS - 1) as f32 {
            low if low <= 0.003_130_8 => 12.92 * low,
            high => 1.055 * libm::powf(high, 1.0 / 2.4) - 0.055,
        };
        (0..LEVELS).map(|i| (encode(i) * 255.0).round() as u8).collect()
    });
    let level = |value: f32| (value.clamp(0.0, 1.0) * (LEVELS - 1) as f32).round() as usize;
    <[f32; 3]>::from(*light).map(|value| TABLE[level(value)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn screen_undoes_linear() {
        (0..=255).for_each(|v| assert_eq!(screen(&linear([v, 255 - v, 128])), [v, 255 - v, 128]));
        assert_eq!(screen(&Triple::new(-1.0, 2.0, f32::NAN)), [0, 255, 0]);
    }

    #[test]
    fn directions_have_unit_length() {
        let directions = [KEY.towards, FILL.towards, RIM.towards, HALFWAY];
        assert!(directions.iter().all(|&d| (Triple::from(d).norm() - 1.0).abs() < 0.01));
    }

    #[test]
    fn light_comes_from_above_left_and_corners_are_darker() {
        let colour = linear(CLAY);
        let towards = |x: f32, y: f32| reflect(&Triple::new(x, y, 0.5).normalize(), &colour, 1.0).sum();
        assert!(towards(-0.5, 0.5) > towards(0.5, -0.5));
        assert!(reflect(&Triple::z(), &colour, 0.2).sum() < reflect(&Triple::z(), &colour, 1.0).sum());
    }

    #[test]
    fn nothing_is_burnt_out() {
        let brightest =
            (0..400).map(|i| Triple::new((i % 20) as f32 - 10.0, (i / 20) as f32 - 10.0, 9.0).normalize());
        brightest.for_each(|n| assert!(reflect(&n, &linear(CLAY), 1.0).max() < 1.0));
    }
}
