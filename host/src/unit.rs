//! Units of length: their size, symbol and names.

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

/// The symbol of a unit.
pub fn symbol(unit: Unit) -> &'static str {
    match unit {
        Unit::Millimetre => "mm",
        Unit::Metre => "m",
        Unit::Inch => "in",
        Unit::Micrometre => "um",
    }
}
