//! What makes one head differ from another: independent parameters, each N(0, 1).

use crate::synth::Random;

macro_rules! parameters {
    ($($(#[$doc:meta])* $name:ident,)*) => {
        /// Weights in standard deviations; zero everywhere is the mean head.
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct Parameters {
            $($(#[$doc])* pub $name: f64,)*
        }

        impl Parameters {
            /// The names, in the order in which they are drawn.
            pub const NAMES: &'static [&'static str] = &[$(stringify!($name)),*];

            /// One draw for each parameter.
            pub fn draw(random: &mut Random) -> Self {
                Self { $($name: random.normal()),* }
            }

            /// All values, in the order of [`Self::NAMES`].
            pub fn values(&self) -> Vec<f64> {
                vec![$(self.$name),*]
            }

            /// Access by position in [`Self::NAMES`].
            pub fn get_mut(&mut self, index: usize) -> Option<&mut f64> {
                [$(&mut self.$name),*].into_iter().nth(index)
            }
        }
    };
}

parameters! {
    /// Width of the whole head.
    width,
    /// Height of the whole head.
    height,
    /// Depth of the whole head.
    depth,
    /// Backward slope of the forehead.
    forehead,
    /// Brow ridge.
    brow,
    /// Distance of the eyes.
    eye_distance,
    /// Size of the eyes.
    eye_size,
    /// How far the eyes stand out.
    eye_depth,
    /// Outer corner of the eyes above the inner one.
    eye_tilt,
    /// Length of the nose.
    nose_length,
    /// Width of the nose.
    nose_width,
    /// Height of the bridge of the nose.
    nose_bridge,
    /// Hump of the nose.
    nose_hump,
    /// How far the tip of the nose stands out.
    nose_tip,
    /// Wings of the nostrils.
    nose_wings,
    /// Width of the mouth.
    mouth_width,
    /// Height of the mouth in the face.
    mouth_height,
    /// How far the mouth stands out.
    mouth_protrusion,
    /// Fullness of the lips.
    lips,
    /// Size of the chin.
    chin_size,
    /// How far the chin stands out.
    chin_protrusion,
    /// Cheekbones.
    cheekbones,
    /// Fullness of the cheeks.
    cheeks,
    /// Width of the jaw.
    jaw_width,
    /// Length of the face below the nose.
    jaw_length,
    /// Fullness of the temples.
    temples,
    /// Thickness of the neck.
    neck,
    /// Size of the ears.
    ear_size,
    /// How far the ears stand off.
    ear_angle,
    /// Height of the ears on the head.
    ear_height,
    /// Nose bent to the left.
    nose_bent,
    /// Left corner of the mouth above the right one.
    mouth_skew,
    /// Jaw shifted to the left.
    jaw_shift,
    /// Left eye above the right one.
    eye_skew,
    /// Left brow heavier than the right one.
    brow_skew,
    /// Left cheek fuller than the right one.
    cheek_skew,
    /// Left ear larger than the right one.
    ear_size_skew,
    /// Left ear stands off farther than the right one.
    ear_angle_skew,
    /// Left ear above the right one.
    ear_height_skew,
}
