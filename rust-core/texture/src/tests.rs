//! Textures of small scenes whose colours are known, each photo and each ray looked at by a naive twin.

mod cameras;
mod kit;
mod maps;
mod refusals;
mod visibility;
