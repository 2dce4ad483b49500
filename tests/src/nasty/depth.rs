//! Depth images and what describes them.

use super::Expected::{Accepted, Refused};
use super::{Nasty, case};
use crate::image::{grey, png};
use png::{BitDepth, ColorType};

pub(super) fn cases() -> Vec<Nasty> {
    [descriptions(), images()].concat()
}

fn descriptions() -> Vec<Nasty> {
    vec![
        case("empty.json", "", Refused("")),
        case("text.json", "not json", Refused("scan.json needs")),
        case(
            "none.json",
            r#"{"camera":{"fx":1,"fy":1,"cx":0,"cy":0,"depth_unit_mm":1},"views":[]}"#,
            Refused("views"),
        ),
        case(
            "focal.json",
            r#"{"camera":{"fx":0,"fy":1,"cx":0,"cy":0,"depth_unit_mm":1},"views":[]}"#,
            Refused("camera.fx"),
        ),
        case("deep.json", "[".repeat(100_000), Refused("scan.json needs")),
        case("alone.png", &b"\x89PNG\r\n\x1a\n"[..], Refused("scan.json")),
    ]
}

const CAMERA: &str = r#""fx":50,"fy":50,"cx":8,"cy":8,"depth_unit_mm":0.1"#;
const IDENTITY: &str = "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]";

/// A scan.json of one view, with the image beside it.
fn view(name: &str, camera: &str, pose: &str, image: Vec<u8>, expected: super::Expected) -> Nasty {
    let png = format!("{name}.png");
    let json = format!(r#"{{"camera":{{{camera}}},"views":[{{"depth":"{png}","camera_to_scan":{pose}}}]}}"#);
    let beside = Some((png, image));
    Nasty { name: format!("{name}.json"), bytes: json.into_bytes(), beside, expected }
}

fn images() -> Vec<Nasty> {
    let slope: Vec<u8> = (0..256u16).flat_map(|i| (3000 + i / 16 + i % 16).to_be_bytes()).collect();
    let grey = |pixels: &[u8]| grey([16; 2], pixels);
    let good = || grey(&slope);
    let eight = png([16; 2], ColorType::Grayscale, BitDepth::Eight, &slope[..256]);
    let colours =
        png([16; 2], ColorType::Rgb, BitDepth::Eight, &[slope.clone(), slope[..256].to_vec()].concat());
    let swapped = |from: &str, to: &str| CAMERA.replace(from, to);
    let sized = format!("{CAMERA},\"width\":99,\"height\":16");
    let mirrored = "[[-1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]";
    let no_pose = "[[0,0,0,0],[0,0,0,0],[0,0,0,0],[0,0,0,1]]";
    vec![
        view("good", CAMERA, IDENTITY, good(), Accepted(256, 450)),
        view("mirrored", CAMERA, mirrored, good(), Accepted(256, 450)),
        view("eight", CAMERA, IDENTITY, eight, Refused("16-bit greyscale")),
        view("colours", CAMERA, IDENTITY, colours, Refused("16-bit greyscale")),
        view("unmeasured", CAMERA, IDENTITY, grey(&[0; 512]), Refused("no three neighbouring pixels")),
        view("cut", CAMERA, IDENTITY, good()[..60].to_vec(), Refused("cannot be decoded")),
        view("no_image", CAMERA, IDENTITY, vec![], Refused("")),
        view("no_focus", &swapped("\"fx\":50", "\"fx\":0"), IDENTITY, good(), Refused("camera.fx is 0")),
        view("far_axis", &swapped("\"cx\":8", "\"cx\":1e308"), IDENTITY, good(), Refused("not finite")),
        view("huge_unit", &swapped("0.1", "1e300"), IDENTITY, good(), Refused("no object")),
        view("other_size", &sized, IDENTITY, good(), Refused("16 x 16 pixels")),
        view("flat_pose", CAMERA, no_pose, good(), Refused("not invertible")),
    ]
}
