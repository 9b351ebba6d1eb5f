//! Each layout written as its programs write it, with known truth; and what is wrong with recordings.

mod damaged;
mod data_sets;
mod dialects;
mod jpeg;
mod layouts;
mod more_layouts;
mod real;
mod rooms;
mod twin;
mod withstand;
mod writers;
