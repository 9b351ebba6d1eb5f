//! Each layout written as its programs write it, with known truth. Also faults of recordings.

mod damaged;
mod data_sets;
mod dialects;
mod layouts;
mod more_layouts;
mod photos;
mod real;
mod rooms;
mod twin;
mod withstand;
mod writers;
