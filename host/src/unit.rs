//! Units of length: their size, symbol and names, and how lengths in them are written.

use lacuna::format::Unit;

/// Millimetres of a unit.
pub fn millimetres(unit: Unit) -> f64 {
    match unit {
        Unit::Millimetre => 1.0,
        Unit::Metre => 1000.0,
        Unit::Inch => 25.4,
        Unit::Micrometre => 0.001,
    }
}

/// A unit by name.
pub fn parse(name: &str) -> Result<Unit, String> {
    match name {
        "mm" | "millimetre" => Ok(Unit::Millimetre),
        "m" | "metre" => Ok(Unit::Metre),
        "in" | "inch" => Ok(Unit::Inch),
        "um" | "micrometre" => Ok(Unit::Micrometre),
        _ => Err("use mm, m, in or um".into()),
    }
}

/// A length or an area in words: so many decimal places, and more where they would leave less than two digits of it, as of
/// those in metres.
pub fn digits(value: f64, places: usize) -> String {
    let first = libm::log10(value.abs()).floor();
    let needed = if first.is_finite() { (1.0 - first).clamp(0.0, 15.0) as usize } else { 0 };
    format!("{value:.0$}", places.max(needed))
}

/// A voxel's edge in words: four digits of it, without zeros at the end.
pub fn four_digits(value: f64) -> String {
    let first = libm::log10(value.abs()).floor();
    let places = if first.is_finite() { (3.0 - first).clamp(0.0, 15.0) as usize } else { 0 };
    let text = format!("{value:.places$}");
    if places == 0 { text } else { text.trim_end_matches('0').trim_end_matches('.').into() }
}

/// The symbol of a unit.
pub fn symbol(unit: Unit) -> &'static str {
    match unit {
        Unit::Millimetre => "mm",
        Unit::Metre => "m",
        Unit::Inch => "in",
        Unit::Micrometre => "um",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_has_four_digits_at_most() {
        let written = [f64::from(3.3f32), 4.967_178_3, 0.003_3, 5.0, 12_345.6, 1e-30, 0.0].map(four_digits);
        assert_eq!(written, ["3.3", "4.967", "0.0033", "5", "12346", "0", "0"]);
    }

    #[test]
    fn a_length_in_metres_keeps_two_digits_and_one_in_millimetres_its_places() {
        let written = [(1.754, 2), (0.001754, 2), (0.04, 2), (0.0, 2), (23.6, 0), (0.0236, 0), (1e-30, 2)];
        let expected = ["1.75", "0.0018", "0.040", "0.00", "24", "0.024", "0.000000000000000"];
        assert_eq!(written.map(|(value, places)| digits(value, places)), expected);
        assert_eq!(digits(f64::INFINITY, 2), "inf");
    }
}
