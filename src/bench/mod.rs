//! `ringwing bench`: the reporting side, until measuring joins it.

mod doctor;
#[cfg(test)]
mod example;
mod figure;
mod label;
mod result;
mod samples;
mod statistics;
mod table;
