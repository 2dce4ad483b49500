//! Reports: what they say, and how they behave in a real browser.

use lacuna_host::io;
use lacuna_host::mesh::Mesh;
use lacuna_tests::browser::Browser;
use lacuna_tests::program::{files, json, lacuna, refuses, succeeds};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::OnceLock;
use tempfile::{TempDir, tempdir};

/// Completes the example scan into a report.
const REPORTED: [&str; 5] = ["complete", "--no-picture", "--report", "reports", "--json"];

/// The report of the example scan, made once.
fn example_page() -> &'static [u8] {
    static PAGE: OnceLock<Vec<u8>> = OnceLock::new();
    PAGE.get_or_init(|| {
        let folder = tempdir().unwrap();
        json(folder.path(), &REPORTED);
        std::fs::read(page(folder.path())).unwrap()
    })
}

/// A folder of one's own with that report in it.
fn example() -> TempDir {
    let folder = tempdir().unwrap();
    std::fs::create_dir(folder.path().join("reports")).unwrap();
    std::fs::write(page(folder.path()), example_page()).unwrap();
    folder
}

fn page(folder: &Path) -> std::path::PathBuf {
    folder.join("reports/completed.html")
}

/// Colours in a PNG.
fn colours(png: &[u8]) -> BTreeSet<Vec<u8>> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    pixels[..info.buffer_size()].chunks(info.color_type.samples()).map(<[u8]>::to_vec).collect()
}

#[test]
fn a_report_says_everything_and_loads_nothing() {
    let folder = tempdir().unwrap();
    let report = json(folder.path(), &REPORTED);
    assert_eq!(report["report"], "reports/completed.html");
    let text = std::fs::read_to_string(page(folder.path())).unwrap();
    assert!(text.len() < 5_000_000, "{} bytes", text.len());
    let digests = report["digests"].as_object().unwrap();
    for digest in digests.values().map(|d| format!("{:08x}", d.as_u64().unwrap())) {
        assert!(text.contains(&digest), "{digest}");
    }
    assert!(text.contains(report["model_checksum"].as_str().unwrap()));
    assert!(text.contains("lacuna complete --no-picture --report reports --json"));
    assert_eq!(text.matches("src=\"data:image/png;base64,").count(), 10);
    assert!(text.contains("class=\"histogram\""));
    // Addresses of other places: none but the names of SVG's vocabulary.
    let others = ["http://", "https://", "src=\"//", "@import", "url("];
    assert!(others.iter().all(|other| !text.replace("http://www.w3.org/2000/svg", "").contains(other)));
    // The same command gives the same file.
    assert!(text.as_bytes() == example_page());
}

/// A cloud has no triangles: its distances are to those that stand for its points.
#[test]
fn surfaces_are_coloured_by_their_distance_from_a_cloud_too() {
    let folder = tempdir().unwrap();
    let mesh = io::parse(io::Format::Ply, lacuna_fixtures::SCAN).unwrap();
    let cloud = Mesh { normals: mesh.vertex_normals(), triangles: vec![], ..mesh };
    io::write_ply(&folder.path().join("cloud.ply"), &io::PlyOut::new(&cloud)).unwrap();
    succeeds(folder.path(), &["complete", "cloud.ply", "--no-picture", "--report", "reports"]);
    let text = std::fs::read_to_string(page(folder.path())).unwrap();
    // In the order of the surfaces: a byte a vertex, four characters for three of them.
    let distances: Vec<&str> =
        text.split("\"distances\":\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    assert_eq!(distances.len(), 4, "scan, global fit, local fit, completed");
    for (surface, distances) in distances.iter().enumerate() {
        let levels: BTreeSet<&[u8]> = distances.as_bytes().chunks(4).collect();
        assert!(levels.len() > 100, "surface {surface} has the same distance everywhere");
    }
}

#[test]
fn nothing_in_a_name_becomes_markup() {
    let folder = tempdir().unwrap();
    let name = "<img src=x onerror=alert(1)>&.ply";
    std::fs::write(folder.path().join(name), lacuna_fixtures::SCAN).unwrap();
    succeeds(folder.path(), &["complete", name, "--no-picture", "--report", "reports"]);
    let text = std::fs::read_to_string(page(folder.path())).unwrap();
    assert!(!text.contains("<img src=x") && text.contains("&lt;img src=x onerror=alert(1)&gt;&amp;.ply"));
}

#[test]
fn a_report_that_cannot_be_written_is_refused_before_the_work() {
    let folder = tempdir().unwrap();
    std::fs::write(folder.path().join("file"), "").unwrap();
    let sentence = refuses(folder.path(), &["complete", "--report", "file"]);
    assert!(sentence.contains("file is a file"), "{sentence}");
    let sentence = refuses(folder.path(), &["complete", "--report", "no/reports"]);
    assert!(sentence.contains("the folder no does not exist"), "{sentence}");
}

#[test]
fn an_evaluation_has_a_report_with_figure_and_table() {
    let folder = tempdir().unwrap();
    succeeds(folder.path(), &["synth", "heads", "heads", "--count", "5"]);
    let common = ["evaluate", "--train", "heads", "--targets", "heads/head_000.ply", "--spacing", "14"];
    let run = |more: &[&str]| lacuna(folder.path(), &[&common, more].concat());
    let made = run(&["--counts", "3", "--draws", "1", "--report", "reports"]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let text = std::fs::read_to_string(folder.path().join("reports/evaluation.html")).unwrap();
    assert!(text.contains("<svg") && text.contains("<th scope=\"row\">3</th><td>local</td>"), "{text}");
    let made = run(&["--counts", "3", "--draws", "1", "--report", "reports", "--ablation"]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    assert_eq!(files(&folder.path().join("reports")), ["ablation.html", "evaluation.html"]);
    let text = std::fs::read_to_string(folder.path().join("reports/ablation.html")).unwrap();
    assert!(text.contains("<th scope=\"row\">--method paper</th>"), "{text}");
    let table = std::fs::read_to_string(folder.path().join("evaluation/ablation.csv")).unwrap();
    assert!(table.starts_with("method,shapes,draw,target,model,rms,p95\nlacuna,3,0,head_000,"), "{table}");
    assert!(table.contains("\n--method paper,3,0,head_000,local,"), "{table}");
}

#[test]
fn the_view_draws_and_follows_every_choice() {
    let Some(mut browser) = Browser::start(&[]) else { return };
    let folder = example();
    browser.resize(1280, 900, false);
    browser.open(&page(folder.path()));
    let first = browser.picture_of("#view");
    // Shaded clay and orange on paper: a blank canvas has one colour or a few on its border.
    assert!(colours(&first).len() > 200, "{} colours", colours(&first).len());
    let mut seen = vec![first.clone()];
    for surface in 0..4 {
        for colouring in 0..4 {
            for (group, value) in [("surface", surface), ("colouring", colouring)] {
                browser.run(&format!(
                    "document.querySelector('input[name={group}][value=\"{value}\"]').click()"
                ));
            }
            browser.settle();
            seen.push(browser.picture_of("#view"));
        }
    }
    // Four surfaces, plain or by distance; the completed one has parts too, which is what came first, and expected
    // errors. The others are plain where those are asked for.
    let different: BTreeSet<&Vec<u8>> = seen.iter().collect();
    assert_eq!(different.len(), 4 * 2 + 2);
    assert_eq!(browser.run("document.getElementById('key-distance').hidden"), false);
    assert!(
        browser.run("document.getElementById('range-high').textContent").as_str().unwrap().contains("mm")
    );
    let wide = browser.picture_of("#view");
    browser.run("(() => { const r = document.getElementById('range'); r.selectedIndex = 0; r.dispatchEvent(new Event('change', { bubbles: true })); })()");
    assert_ne!(browser.picture_of("#view"), wide, "the scale of colours does not matter");
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
    let elsewhere = browser.requests.iter().filter(|r| !r.starts_with("file:") && !r.starts_with("data:"));
    let elsewhere: Vec<_> = elsewhere.collect();
    assert!(elsewhere.is_empty(), "{elsewhere:?}");
}

#[test]
fn the_view_turns_by_keys_by_buttons_and_by_the_pointer() {
    let Some(mut browser) = Browser::start(&[]) else { return };
    let folder = example();
    browser.resize(1280, 900, false);
    browser.open(&page(folder.path()));
    let focused =
        "document.activeElement.id || document.activeElement.name || document.activeElement.dataset.act";
    // From the top of the page, by the tabulator alone: view, surface, colour, buttons.
    let order: Vec<String> = (0..4)
        .map(|_| {
            browser.press("Tab");
            browser.run(focused).as_str().unwrap_or("").to_owned()
        })
        .collect();
    assert_eq!(order, ["view", "surface", "colouring", "left"]);
    browser.run("document.getElementById('view').focus()");
    let start = browser.picture_of("#view");
    for key in ["ArrowLeft", "ArrowUp", "+"] {
        let before = browser.picture_of("#view");
        browser.press(key);
        assert_ne!(browser.picture_of("#view"), before, "{key}");
    }
    browser.press("Home");
    assert_eq!(browser.picture_of("#view"), start, "Home");
    browser.drag("#view", [80.0, 30.0]);
    assert_ne!(browser.picture_of("#view"), start, "the pointer");
    browser.run("document.querySelector('button[data-act=reset]').click()");
    browser.run("document.getElementById('view').focus()");
    assert_eq!(browser.picture_of("#view"), start, "the reset button");
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
}

#[test]
fn the_page_fits_a_phone_and_paper() {
    let Some(mut browser) = Browser::start(&[]) else { return };
    let folder = example();
    browser.open(&page(folder.path()));
    for (scheme, width) in [("light", 390), ("dark", 390), ("light", 320), ("dark", 1280)] {
        browser.resize(width, 844, width < 500);
        browser.prefer("screen", scheme);
        let wide = browser.run("document.documentElement.scrollWidth").as_u64().unwrap();
        assert!(wide <= u64::from(width), "{width} pixels {scheme}: the page is {wide} wide");
        let dark = browser.run("getComputedStyle(document.body).backgroundColor") != "rgb(255, 255, 255)";
        assert_eq!(dark, scheme == "dark");
    }
    browser.prefer("print", "dark");
    let shown = |name: &str| format!("document.querySelector('{name}').getClientRects().length > 0");
    assert_eq!(browser.run(&shown(".columns img")), true);
    for hidden in ["#view", "button", "fieldset"] {
        assert_eq!(browser.run(&shown(hidden)), false, "{hidden} is printed");
    }
    assert_eq!(browser.run("getComputedStyle(document.body).backgroundColor"), "rgb(255, 255, 255)");
    assert!(browser.print().starts_with(b"%PDF"));
}

#[test]
fn without_webgl_a_sentence_says_so() {
    let Some(mut browser) = Browser::start(&["--disable-3d-apis"]) else { return };
    let folder = example();
    browser.open(&page(folder.path()));
    let sentence = browser.run("document.getElementById('no-view').innerText");
    assert!(sentence.as_str().unwrap().contains("no WebGL"), "{sentence}");
    assert_eq!(browser.run("document.getElementById('viewer').getClientRects().length"), 0);
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
}
