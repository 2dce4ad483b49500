//! Is a scan of the model's size, and if not, in which unit would it be?

use super::Checked;
use crate::register::{check_size, field::Field};
use lacuna::Model;
use lacuna::format::Unit;

/// Refuses a scan that cannot be of the model's size in the model's unit, and offers the unit in which it would.
pub(super) fn check(checked: &mut Checked, model: &Model<'_>, unit: Unit) {
    if let Err(error) = check_size(&checked.mesh, &Field::of_model(model), model, unit) {
        checked.refused(error.to_string());
    }
}
