//! What the core refuses, as sentences: what is wrong and what to do.

use lacuna::error::{Buffer, OptionName};
use lacuna::format::{PER_VOXEL, VERSION};
use lacuna::pose_fit::FEWEST_POINTS;
use lacuna::schedule::WIDEST;
use lacuna::{Error, Reach};

/// An error of the core as a sentence; `subject` is what it calls the model: "the model", or its file.
pub fn sentence(subject: &str, error: &Error) -> String {
    match error {
        Error::NotAModel => format!("{subject} is not a Lacuna model: make one with `lacuna train`"),
        Error::UnknownVersion { found } => {
            format!(
                "{subject} has format version {found}, this program reads 1 to {VERSION}: update it, or train again"
            )
        }
        Error::WrongLength { expected, found } if found < expected => {
            format!("{subject} is cut short, {found} of {expected} bytes: copy it again")
        }
        Error::WrongLength { expected, found } => {
            format!("{subject} has {found} bytes where {expected} belong: copy it again")
        }
        Error::Damaged => format!("{subject} is damaged (checksum): copy it again"),
        Error::Inconsistent(part) => format!("{subject} contradicts itself ({part:?}): train it again"),
        Error::BufferTooSmall { buffer, needed, given } => {
            format!(
                "the buffer for {} has {given} elements, {needed} are needed: {}",
                contents(*buffer),
                remedy(*buffer)
            )
        }
        Error::Stride { asked, brick } => {
            format!(
                "a stride of {asked} does not go with bricks of {brick} voxels: use one of 1 to 4 that divides it"
            )
        }
        Error::Radius { asked } => format!(
            "a kernel radius of {asked} nodes is too wide: stride (2 radius + 1) may be {WIDEST} voxels at most"
        ),
        Error::Option(name) => option(*name),
        Error::Pose => "the pose is not a rotation with a positive scale: correct it".into(),
        Error::TooFewPoints { given } => {
            format!("{given} points are too few to find a pose, {FEWEST_POINTS} are needed: scan more of it")
        }
        Error::EmptyHull => "the scan does not touch the model in this pose: is it a scan of this class, and a pose that was given the right one?".into(),
    }
}

/// What a buffer holds, with the name that `lacuna inspect --rust` gives its size.
const fn contents(buffer: Buffer) -> &'static str {
    match buffer {
        Buffer::Targets => "the hull's targets (TARGETS)",
        Buffer::Keys => "the hull's keys (RESIDUALS)",
        Buffer::Normal => "the global fit's normal equations (NORMAL)",
        Buffer::Block => "the global fit's sums over a brick (BLOCK)",
        Buffer::Global => "the global weights (GLOBAL)",
        Buffer::NodeWeights => "the weights at the nodes (NODE_WEIGHTS)",
        Buffer::Previous => "the nodes' weights before the last step (PREVIOUS)",
        Buffer::Residuals => "the residuals (RESIDUALS)",
        Buffer::HullRows => "the masks of the hull's rows (HULL_ROWS)",
        Buffer::Gradient => "the gradients at the nodes (GRADIENT)",
        Buffer::Dense => "the node field of the box filter (DENSE)",
        Buffer::Reciprocals => "the reciprocal curvatures (RECIPROCALS)",
        Buffer::Nodes => "the map of the nodes (NODES)",
        Buffer::Cell => "the numbers of a cell (CELL)",
        Buffer::DepthRows => "the last rows of a depth image",
        Buffer::PoseColumns => "the pose fit's columns (POSE_COLUMNS)",
        Buffer::PoseNormal => "the pose fit's normal equations (POSE_NORMAL)",
        Buffer::PoseChunk => "the pose fit's sums over a patch (POSE_CHUNK)",
        Buffer::PoseWeights => "the pose fit's weights (POSE_WEIGHTS)",
    }
}

/// What makes a buffer large enough.
const fn remedy(buffer: Buffer) -> &'static str {
    match buffer {
        // How many rows are kept is the firmware's choice, no model's.
        Buffer::DepthRows => "lend it as many",
        _ => "lend it as many as Sizes tells",
    }
}

/// 1/256 voxels in voxels.
fn voxels(reach: u16) -> f64 {
    f64::from(reach) / f64::from(PER_VOXEL)
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
        OptionName::Reach => {
            let most = voxels(Reach::MOST_FRONT);
            return format!("the hull's reach in front or behind is out of range: at most {most} voxels");
        }
        OptionName::Lateral => {
            let [least, most] = [Reach::LEAST_LATERAL, Reach::MOST_LATERAL].map(voxels);
            return format!("the hull's reach sideways is out of range: {least} to {most} voxels");
        }
        OptionName::Ridge => "a ridge is not a positive number: correct it",
        OptionName::Step => "a step length of the local fit is not within 0 to 1024: correct it",
        OptionName::CloudStep => {
            "the step of the points' coordinates is not a positive number: pack them again"
        }
        OptionName::Misfit => "a misfit scale of the pose's rounds is not from 0.001 to 1000: correct it",
    };
    text.into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use lacuna::Sizes;

    #[test]
    fn a_buffer_that_is_too_small_is_told_by_the_name_of_its_constant() {
        let buffers = [
            Buffer::PoseNormal,
            Buffer::PoseChunk,
            Buffer::PoseColumns,
            Buffer::PoseWeights,
            Buffer::Targets,
            Buffer::Normal,
            Buffer::Block,
            Buffer::Global,
            Buffer::NodeWeights,
            Buffer::Previous,
            Buffer::Residuals,
            Buffer::HullRows,
            Buffer::Gradient,
            Buffer::Dense,
            Buffer::Reciprocals,
            Buffer::Nodes,
            Buffer::Cell,
        ];
        for (buffer, (constant, _)) in buffers.into_iter().zip(Sizes::default().named()) {
            let error = Error::BufferTooSmall { buffer, needed: 20, given: 10 };
            let said = sentence("the model", &error);
            assert!(said.contains(&format!("({constant}) has 10 elements, 20 are needed")), "{said}");
        }
    }

    #[test]
    fn ranges_are_told_of_the_option_that_has_them() {
        let said = |name| sentence("the model", &Error::Option(name));
        let misfit = said(OptionName::Misfit);
        assert!(misfit.contains("misfit scale") && misfit.contains("from 0.001 to 1000"), "{misfit}");
        let lateral = said(OptionName::Lateral);
        assert!(lateral.contains("sideways") && lateral.contains("0.25 to 4 voxels"), "{lateral}");
    }
}
