//! Policies without a device: the replay against a re-enactment that shares nothing with it, and what every schedule must keep.
//!
//! **Invariant:** nothing here needs an adapter.

#[path = "policy/brute_force.rs"]
mod brute_force;
#[path = "policy/brute_lanes.rs"]
mod brute_lanes;
#[path = "policy/paper.rs"]
mod paper;
#[path = "policy/properties.rs"]
mod properties;
