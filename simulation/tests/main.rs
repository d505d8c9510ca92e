//! Whole flights in one process: what the paper shows, what the resilient law is for, and the rules of the simulation.

#![expect(clippy::unwrap_used, reason = "what is not there fails the test")]

mod support;

mod airframes;
mod controllers;
mod dead_reckoning;
mod force_limit;
mod paper;
mod pinned;
mod random;
mod resilience;
mod rules;
mod safety;
mod sensors;
mod shapes;
mod storm;
mod theory;
mod turning;
mod wind;
