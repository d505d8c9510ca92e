//! Draws the charts and pages of `ringwing review`, `ringwing bench` and `ringwing sweep`.
//!
//! [`chart`] draws lines over two axes, [`strip`] draws coloured cells over time, [`scale`] says what the numbers on an axis
//! mean, [`heat`] draws maps over two axes, [`bands`] curves with intervals, [`animation`] marks that move, [`interactive`]
//! turns a chart into a figure that a browser lets people explore, and [`html`] frames everything in one page. `canvas` and
//! `extent` hold what the drawings have in common.
//!
//! Must never know what it draws: callers hand in lines, cells and text. Must never read or write files.

pub mod animation;
pub mod bands;
mod canvas;
pub mod chart;
mod colour;
mod extent;
pub mod heat;
pub mod html;
pub mod interactive;
pub mod scale;
pub mod strip;

pub use canvas::DrawingError;
/// Colours, as charts take them.
pub use plotters::style::{BLACK, RGBColor};
