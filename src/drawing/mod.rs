//! Drawing that pages share: charts, strips over time, and the page that holds them.
//!
//! Never knows what is drawn: flights and benchmarks hand in lines, cells and texts.

pub(crate) mod chart;
pub(crate) mod html;
pub(crate) mod scale;
pub(crate) mod strip;
