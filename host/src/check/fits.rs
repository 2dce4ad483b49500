//! Is a scan of the model's size, and if not, in which unit would it be?

use super::Checked;
use crate::register::field::Field;
use crate::size::{LIMIT, misfit, of_mesh};
use crate::unit;
use lacuna::Model;
use lacuna::format::Unit;

/// Longest side of a model's mean shape, in its unit.
pub fn of_model(model: &Model<'_>) -> f64 {
    Field::of_model(model).size * f64::from(model.header().spacing)
}

/// Refuses a scan that cannot be of the model's size in the model's unit, and offers the unit in which it would.
pub(super) fn check(checked: &mut Checked, model: &Model<'_>, unit: Unit) {
    let (scan, model_size) = (of_mesh(&checked.mesh), of_model(model));
    if let Some(hint) = misfit(scan, model_size, unit) {
        let symbol = unit::symbol(model.header().unit);
        checked.refused(format!(
            "the scan is {scan:.4} {symbol} long and the model {model_size:.4} {symbol}: they differ by more \
             than a factor of {LIMIT}. {hint}"
        ));
    }
}
