//! What viewers show besides the raw data of a tick: scenes, coordinate frames, the map, faults and panels.
//!
//! `view` decides what is due at a tick and combines the rest: `scene` draws for the 3D panel, `geo` for the map,
//! `faults` follows what is wrong, `layout` arranges the panels, `palette` holds the colours, and `circle` and `arrow` make
//! lines of circles and of the wind. Pure: never reads a clock or a file, and the same frames give the same bytes on every machine.

pub mod arrow;
pub mod circle;
pub(crate) mod faults;
pub(crate) mod geo;
pub(crate) mod layout;
pub mod palette;
pub(crate) mod scene;
mod timing;
pub mod view;
