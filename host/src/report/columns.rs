//! Figure 3 of the paper as pictures inside the page: a column for each stage, from the front and from the side.

use super::html::{base64, escape};
use crate::complete::{Completion, picture};
use png::EncodingError;
use rayon::prelude::*;

/// Width and height of a picture, pixels: sharp on a phone, and ten of them stay below a megabyte.
const PANEL: [usize; 2] = [300, 350];

/// The five columns as HTML.
///
/// # Errors
/// A picture that cannot be encoded; nothing is known that cannot.
pub fn columns(completion: &Completion) -> Result<String, EncodingError> {
    let rows = picture::rows(completion, PANEL[0], PANEL[1]);
    let figures = picture::TITLES.par_iter().enumerate().map(|(column, title)| {
        let cut = |row: usize| rows[row].columns(column * PANEL[0], PANEL[0]).png_small();
        let pictures = [("from the front", cut(0)?), ("from the side seen least", cut(1)?)];
        Ok(figure(title, &pictures))
    });
    let figures: Vec<String> = figures.collect::<Result<_, EncodingError>>()?;
    Ok(format!("<div class=\"columns\">\n{}</div>\n", figures.concat()))
}

fn figure(title: &str, pictures: &[(&str, Vec<u8>)]) -> String {
    let [width, height] = PANEL;
    let title = escape(title);
    let image = |(view, png): &(&str, Vec<u8>)| {
        format!(
            "<img width=\"{width}\" height=\"{height}\" alt=\"{title}, {view}\" src=\"data:image/png;base64,{}\">\n",
            base64(png)
        )
    };
    let images: String = pictures.iter().map(image).collect();
    format!("<figure>\n{images}<figcaption>{title}</figcaption>\n</figure>\n")
}
