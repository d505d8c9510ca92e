//! `ringwing bench`: the reporting side, until measuring joins it.

mod result;
mod samples;
