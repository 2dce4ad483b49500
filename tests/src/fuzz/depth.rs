//! Depth images and their description: any JSON, any PNG, and whole images with any pixels.

use super::meshes::check;
use super::source::Source;
use crate::image::grey;
use lacuna::digest::Digest;
use lacuna_host::io::read_scan;
use std::cell::LazyCell;
use std::path::Path;
use tempfile::TempDir;

/// Writes a scan.json and an image and reads the folder. The first byte says which of them the rest becomes.
pub fn run(bytes: &[u8]) {
    let mut source = Source(bytes);
    let (json, png) = match source.byte() % 4 {
        0 => (source.0.to_vec(), grey([2; 2], &[9; 8])),
        1 => (description(1.0), source.0.to_vec()),
        2 => {
            let mut png = source.0.to_vec();
            mend(&mut png);
            (description(1.0), png)
        }
        _ => {
            let (width, height) = (source.below(24) + 1, source.below(24) + 1);
            let focus = f64::from(source.float());
            let mut pixels = source.0.to_vec();
            pixels.resize(2 * width * height, 0);
            (description(focus), grey([width as u32, height as u32], &pixels))
        }
    };
    read(&json, &png);
}

fn read(json: &[u8], png: &[u8]) {
    thread_local! {
        static FOLDER: LazyCell<TempDir> = LazyCell::new(|| {
            let memory = Path::new("/dev/shm");
            let made = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
            made.expect("a folder for the input")
        });
    }
    FOLDER.with(|folder| {
        let folder = folder.path();
        std::fs::write(folder.join("scan.json"), json).expect("room for the input");
        std::fs::write(folder.join("depth.png"), png).expect("room for the input");
        match read_scan(folder) {
            Ok(mesh) => check(&mesh),
            Err(error) => assert!(error.to_string().len() > 10),
        }
    });
}

/// A description, images of all kinds, pixels.
pub fn seeds() -> Vec<Vec<u8>> {
    let pixels: Vec<u8> = (0..288u32).map(|i| (i * i / 7 % 40) as u8).collect();
    let small = grey([5, 4], &pixels[..40]);
    vec![
        [&[0][..], &description(300.0)].concat(),
        [&[1][..], &small].concat(),
        [&[2][..], &small].concat(),
        [&[3, 11, 11][..], &300.0f32.to_le_bytes(), &pixels].concat(),
    ]
}

fn description(focus: f64) -> Vec<u8> {
    format!(
        "{{\"camera\": {{\"fx\": {focus}, \"fy\": 300.5, \"cx\": 2, \"cy\": 1.5, \"depth_unit_mm\": 0.0625}}, \
         \"views\": [{{\"depth\": \"depth.png\", \"camera_to_scan\": \
         [[1, 0, 0, 5], [0, 1, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]]}}]}}"
    )
    .into_bytes()
}

/// Makes the checksums of the chunks good, so that damage reaches what is behind them.
fn mend(png: &mut [u8]) {
    let mut at = 8;
    while let Some(length) = png.get(at..at + 4) {
        let length = u32::from_be_bytes([length[0], length[1], length[2], length[3]]) as usize;
        let Some(end) = at.checked_add(8).and_then(|start| start.checked_add(length)) else { return };
        let Some(covered) = png.get(at + 4..end) else { return };
        let mut digest = Digest::new();
        digest.add(covered);
        let sum = digest.value().to_be_bytes();
        let Some(place) = png.get_mut(end..end + 4) else { return };
        place.copy_from_slice(&sum);
        at = end + 4;
    }
}
