//! `ringwing bench`: the reporting side, until measuring joins it.

mod charts;
mod compare;
mod doctor;
#[cfg(test)]
mod example;
mod figure;
mod histogram_files;
mod label;
mod page;
mod result;
mod samples;
mod statistics;
mod table;
