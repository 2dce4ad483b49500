//! Pictures of a report as a browser shows it, to be looked at:
//! `cargo run --release -p lacuna-tests --example screenshots -- REPORT.html FOLDER`.

use lacuna_tests::browser::Browser;
use std::path::Path;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [report, folder] = arguments.as_slice() else { panic!("give a report and a folder") };
    let Some(mut browser) = Browser::start(&[]) else { return };
    browser.open(Path::new(report));
    let save =
        |name: &str, bytes: Vec<u8>| std::fs::write(Path::new(folder).join(name), bytes).expect("a file");
    for (name, width, scheme) in [("light", 1280, "light"), ("dark", 1280, "dark"), ("phone", 390, "light")] {
        browser.resize(width, 844, width < 500);
        browser.prefer("screen", scheme);
        save(&format!("{name}.png"), browser.picture());
    }
    browser.prefer("", "light");
    save("print.pdf", browser.print());
    browser.complaints.iter().for_each(|complaint| println!("{complaint}"));
}
