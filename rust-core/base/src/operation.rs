//! The declaration of an operation: what every language and every host needs to know of it.
//!
//! An operation's crate declares its parameters ([`params!`](crate::params!)), its report ([`report!`](crate::report!)) and, in
//! a constant of this type, all else that would otherwise be repeated: names, texts, what it takes and gives, and in which hosts
//! it is found.

use crate::{params, report};

/// A sort of content that an operation takes or gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DataKind {
    /// Files, or folders of them.
    Files,
    /// Any number of scans: range images, or oriented meshes and points where that is said.
    Scans,
    /// One range image.
    Image,
    /// A point cloud.
    Points,
    /// A mesh of triangles.
    Mesh,
    /// A grid of quads.
    Quads,
    /// Poses, one for each scan.
    Poses,
    /// A surface that formulas give.
    Spline,
    /// A plane.
    Plane,
    /// Images of a mesh.
    Textures,
}

impl DataKind {
    /// It in words.
    pub const fn words(self) -> &'static str {
        match self {
            DataKind::Files => "files",
            DataKind::Scans => "scans",
            DataKind::Image => "a range image",
            DataKind::Points => "points",
            DataKind::Mesh => "a mesh",
            DataKind::Quads => "a grid of quads",
            DataKind::Poses => "poses",
            DataKind::Spline => "a spline surface",
            DataKind::Plane => "a plane",
            DataKind::Textures => "textures",
        }
    }
}

/// An operation as the command line has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Command {
    /// The word behind `surfrecon`.
    pub name: &'static str,
    /// Name of its files, such as SCANS.
    pub files: &'static str,
    /// Its effect, in a line without a verb.
    pub summary: &'static str,
    /// Its effect, in full.
    pub text: &'static str,
}

/// An operation as an operator of Blender.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Operator {
    /// Its identifier, without `surfrecon.`.
    pub id: &'static str,
    /// Its name for people.
    pub label: &'static str,
    /// Its tip, without a full stop.
    pub text: &'static str,
}

/// An operation as a filter of MeshLab.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Filter {
    /// Its name in menus.
    pub label: &'static str,
    /// Its name in pymeshlab.
    pub id: &'static str,
    /// Its effect, in HTML.
    pub text: &'static str,
    /// The menus that it is in, as MeshLab's `FilterClass` names them.
    pub menus: &'static [&'static str],
    /// The layers that it works on, as MeshLab's `FilterArity` names them.
    pub layers: &'static str,
}

/// All that is declared of an operation.
#[derive(Clone, Copy, Debug)]
pub struct Operation {
    /// Its name in every language.
    pub name: &'static str,
    /// Its effect, in a sentence.
    pub text: &'static str,
    /// The version it came with.
    pub since: &'static str,
    /// Sorts of content that it takes.
    pub takes: &'static [DataKind],
    /// Sorts of content that it gives.
    pub gives: &'static [DataKind],
    /// Its parameters.
    pub params: Option<params::ParamSchema>,
    /// Its report, which may be declared in several parts: the first gives name and text.
    pub report: &'static [report::ReportSchema],
    /// The command, where it has one.
    pub command: Option<Command>,
    /// The operator of Blender, where it has one.
    pub blender: Option<Operator>,
    /// The filter of MeshLab, where it has one.
    pub meshlab: Option<Filter>,
}
