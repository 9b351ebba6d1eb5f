//! Each layout written as its programs write it, with known truth; and what is wrong with recordings.

mod damaged;
mod dialects;
mod jpeg;
mod layouts;
mod real;
mod twin;
mod withstand;
mod writers;
