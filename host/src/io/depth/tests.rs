use std::fs;

use super::*;
use crate::io::{read_scan, read_scan_noted};
use crate::mesh::Point;

const JSON: &str = r#"{ "name": "by hand", "camera": { "fx": 2.0, "fy": 4.0, "cx": 1, "cy": 0.5,
    "depth_unit_mm": 0.5, "width": 3, "height": 2, "hfov_deg": 45 },
    "views": [ { "depth": "depth.png", "statistics": {},
    "camera_to_scan": [[1,0,0,10],[0,1,0,20],[0,0,1,30],[0,0,0,1]] } ] }"#;

fn png(width: u32, height: u32, depth: &[u16]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let raw: Vec<u8> = depth.iter().flat_map(|value| value.to_be_bytes()).collect();
    encoder.write_header().unwrap().write_image_data(&raw).unwrap();
    bytes
}

/// A folder with a scan.json and images of the given names.
fn folder(json: &str, images: &[(&str, Vec<u8>)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join(DESCRIPTION), json).unwrap();
    for (name, bytes) in images {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

const PIXELS: [u16; 6] = [4, 4, 0, 4, 4, 5];

#[test]
fn folder_description_and_image_are_three_names_of_one_scan() {
    let folder = folder(JSON, &[("depth.png", png(3, 2, &PIXELS))]);
    let views = read(folder.path()).unwrap();
    assert_eq!((views.len(), views[0].width, views[0].height), (1, 3, 2));
    assert_eq!(views[0].depth, PIXELS);
    assert_eq!(views[0].point(0, 0), Some(Point::new(-1.0 + 10.0, -0.25 + 20.0, 2.0 + 30.0)));
    assert_eq!(read(&folder.path().join("scan.json")).unwrap(), views);
    assert_eq!(read(&folder.path().join("depth.png")).unwrap(), views);
}

#[test]
fn views_are_merged_into_one_mesh() {
    let two = JSON.replace(
        r#""views": [ {"#,
        r#""views": [ { "depth": "b.png", "camera_to_scan":
        [[0,1,0,0],[1,0,0,0],[0,0,1,0],[0,0,0,1]] }, {"#,
    );
    let images = [("depth.png", png(3, 2, &PIXELS)), ("b.png", png(3, 2, &[4; 6]))];
    let folder = folder(&two, &images);
    assert_eq!(read(folder.path()).unwrap().len(), 2);
    assert_eq!(read(&folder.path().join("b.png")).unwrap().len(), 1);
    let mesh = read_scan(folder.path()).unwrap();
    assert_eq!((mesh.points.len(), mesh.triangles.len()), (11, 7));
    assert_eq!(mesh.triangles[4..].iter().flatten().min(), Some(&6));
}

#[test]
fn what_is_missing_is_named() {
    let png = png(3, 2, &PIXELS);
    let cases = [
        (r#""fx": 2.0,"#, "", "missing field `fx`"),
        (r#""depth_unit_mm": 0.5,"#, "", "missing field `depth_unit_mm`"),
        (r#""depth": "depth.png","#, "", "missing field `depth`"),
        ("camera_to_scan", "pose", "missing field `camera_to_scan`"),
        (r#""fx": 2.0"#, r#""fx": -2.0"#, "camera.fx is -2"),
        ("[0,0,1,30]", "[0,1,0,30]", "views[0].camera_to_scan is not invertible"),
        ("[0,0,0,1]]", "[0,0,0,2]]", "0 0 0 1"),
        ("[0,0,0,1]]", "[0,0,0]]", "scan.json, line 4: invalid length 3"),
        (r#""width": 3"#, r#""width": 4"#, "3 x 2 pixels, scan.json says 4 x 2"),
        ("depth.png", "other.png", "other.png: there is no such file"),
    ];
    for (old, new, message) in cases {
        let folder = folder(&JSON.replacen(old, new, 1), &[("depth.png", png.clone())]);
        let text = read(folder.path()).unwrap_err().to_string();
        assert!(text.contains(message), "{text}");
    }
}

#[test]
fn a_folder_without_a_description_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let text = read_scan(folder.path()).unwrap_err().to_string();
    assert!(text.contains("there is no scan.json in this folder; name a file"), "{text}");
    let image = folder.path().join("depth.png");
    fs::write(&image, png(3, 2, &PIXELS)).unwrap();
    let text = read_scan(&image).unwrap_err().to_string();
    assert!(text.contains("depth.png: a depth image needs a scan.json beside it"), "{text}");
}

#[test]
fn an_image_that_is_not_listed_is_refused() {
    let folder = folder(JSON, &[("more.png", png(3, 2, &PIXELS))]);
    let text = read(&folder.path().join("more.png")).unwrap_err().to_string();
    assert!(text.contains("more.png; add it to \"views\""), "{text}");
}

#[test]
fn other_images_are_refused() {
    let mut grey = Vec::new();
    let mut encoder = png::Encoder::new(&mut grey, 1, 1);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(&[1]).unwrap();
    let fault = image::decode(&grey).unwrap_err();
    assert!(fault.problem.to_string().contains("8-bit Grayscale"), "{fault:?}");
    assert!(image::decode(b"GIF89a").is_err());
}

#[test]
fn impossible_image_sizes_are_errors_before_anything_is_reserved() {
    for (height, message) in [(2_u32, "is cut off"), (1 << 10, "the most is 16777216")] {
        let mut image = png(3, 2, &PIXELS);
        image[16..20].copy_from_slice(&(1_u32 << 20).to_be_bytes());
        image[20..24].copy_from_slice(&height.to_be_bytes());
        let checksum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&image[12..29]);
        image[29..33].copy_from_slice(&checksum.to_be_bytes());
        let text = image::decode(&image).unwrap_err().problem.to_string();
        assert!(text.contains(message), "{text}");
    }
}

#[test]
fn a_scan_without_a_surface_is_refused() {
    let folder = folder(JSON, &[("depth.png", png(3, 2, &[1, 0, 0, 0, 0, 1]))]);
    assert!(read_scan(folder.path()).unwrap_err().to_string().contains("no three neighbouring pixels"));
}

#[test]
fn pixels_that_are_filled_in_are_told() {
    let folder = folder(JSON, &[("depth.png", png(3, 2, &[6, 0, 7, 6, 0, 7]))]);
    let Loaded { mesh, repairs } = read_scan_noted(folder.path()).unwrap();
    assert_eq!((mesh.points.len(), mesh.triangles.len()), (6, 4));
    assert!(repairs[0].starts_with("2 pixels between measured ones were not measured"), "{repairs:?}");
}

#[test]
fn truncated_images_and_descriptions_never_panic() {
    let image = png(3, 2, &PIXELS);
    for length in 0..image.len() {
        let _ = image::decode(&image[..length]);
    }
    for length in 0..JSON.len() {
        assert!(Description::parse(&JSON.as_bytes()[..length]).is_err());
    }
}

#[test]
fn damaged_images_never_panic() {
    let image = png(3, 2, &PIXELS);
    for (at, bit) in (0..image.len()).flat_map(|at| (0..8).map(move |bit| (at, bit))) {
        let mut damaged = image.clone();
        damaged[at] ^= 1 << bit;
        let _ = image::decode(&damaged);
    }
}
