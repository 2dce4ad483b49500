//! What the core refuses, as sentences: what is wrong and what to do.

use lacuna::Error;
use lacuna::error::OptionName;

/// An error of the core as a sentence.
pub fn sentence(error: &Error) -> String {
    match error {
        Error::NotAModel => "is not a Lacuna model: make one with `lacuna train`".into(),
        Error::UnknownVersion { found } => {
            format!(
                "has format version {found}, this program reads 1 to {}: update it, or train again",
                lacuna::format::VERSION
            )
        }
        Error::WrongLength { expected, found } if found < expected => {
            format!("is cut short, {found} of {expected} bytes: copy it again")
        }
        Error::WrongLength { expected, found } => {
            format!("has {found} bytes where {expected} belong: copy it again")
        }
        Error::Damaged => "is damaged (checksum): copy it again".into(),
        Error::Inconsistent(part) => format!("contradicts itself ({part:?}): train it again"),
        Error::BufferTooSmall { buffer, needed, given } => {
            format!("the buffer {buffer:?} has {given} elements, {needed} are needed")
        }
        Error::Stride { asked, brick } => {
            format!(
                "a stride of {asked} does not go with bricks of {brick} voxels: use one of 1 to 4 that divides it"
            )
        }
        Error::Radius { asked } => {
            format!("a kernel radius of {asked} nodes is too wide for the fixed-point bounds")
        }
        Error::Option(name) => option(*name),
        Error::Pose => "the pose is not a rotation with a positive scale".into(),
        Error::TooFewPoints { given } => format!("{given} points are too few to find a pose"),
        Error::EmptyHull => "the scan does not touch the model in this pose: is the pose right?".into(),
    }
}

/// What a number has to be.
fn option(name: OptionName) -> String {
    let text = match name {
        OptionName::ImageSize => "the depth image has no pixels: give its width and height",
        OptionName::FocalLength => {
            "a focal length of the depth camera is not greater than 0: correct fx and fy"
        }
        OptionName::PrincipalPoint => "the depth camera's principal point is not finite: correct cx and cy",
        OptionName::DepthUnit => "the depth image's unit is not greater than 0: correct it",
        OptionName::DepthJump => "the largest step within a surface is not a length: correct it",
        OptionName::PixelStride => "the pixels' stride and reach must be at least 1: correct them",
        OptionName::Reach => "the hull's reach in front or behind is out of range: at most 7.5 voxels",
        OptionName::Lateral => {
            "the hull's reach sideways is out of range: a quarter of a voxel to four voxels"
        }
        OptionName::Ridge => "a ridge is not a positive number: correct it",
        OptionName::Step => "a step length of the local fit is not within 0 to 1024: correct it",
        OptionName::CloudStep => {
            "the step of the points' coordinates is not a positive number: pack them again"
        }
        OptionName::Misfit => "a misfit scale of the pose's rounds is not a positive number: correct it",
    };
    text.into()
}
