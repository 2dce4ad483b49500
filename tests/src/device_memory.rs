//! What a firmware has in statics, on the heap of a test.

use lacuna::cloud::Packed;
use lacuna::wire::device::{Ended, Port};
use lacuna::wire::{Buffers, Device, serve};
use lacuna::{Fixed, Model, Schedule, Sizes};

/// Pixels of a depth image that a device keeps, as the firmware does.
const ROWS: usize = 2560;

/// Memory of a device.
pub struct DeviceMemory {
    /// Its points.
    pub points: Vec<Packed>,
    /// Its rows of a depth image.
    pub rows: Vec<u16>,
    fit: lacuna_host::fit::Buffers<Fixed>,
    wire: Box<Buffers>,
}

impl DeviceMemory {
    /// Enough for a model with any iterations, and none where the model is refused.
    pub fn new(model: &[u8], points: usize) -> Self {
        let model = Model::from_bytes(model).ok();
        let sizes = model.and_then(|model| Sizes::required(&model, &Schedule::with_momentum(&model)).ok());
        Self {
            points: vec![[0; 6]; points],
            rows: vec![0; ROWS],
            fit: lacuna_host::fit::Buffers::new(&sizes.unwrap_or_default()),
            wire: Box::new(Buffers::new()),
        }
    }

    /// The same without memory of a fit.
    pub fn without_fit(self) -> Self {
        Self { fit: lacuna_host::fit::Buffers::new(&Sizes::default()), ..self }
    }

    /// Serves until the line ends.
    pub fn serve<P: Port>(&mut self, port: &mut P, model: &[u8]) -> Ended<P::Error> {
        let memory = self.fit.memory();
        let device =
            Device { machine: "test", model, points: &mut self.points, rows: &mut self.rows, memory };
        serve(port, device, || 0, &mut self.wire)
    }
}
