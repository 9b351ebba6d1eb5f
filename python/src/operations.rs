//! The core's operations: what each takes and gives, and what it is called where.

use pyo3::prelude::*;
use surfrecon::operations::{self, Command, DataKind, Filter, OPERATIONS, Operator};

/// One operation, as the library itself defines it.
///
/// >>> merge = {one.name: one for one in surfrecon.operations()}["merge"]
/// >>> merge.takes, merge.gives
/// (['scans'], ['a mesh'])
#[pyclass(frozen, module = "surfrecon")]
pub struct Operation {
    operation: &'static operations::Operation,
}

fn words(contents: &'static [DataKind]) -> Vec<&'static str> {
    contents.iter().map(|content| content.words()).collect()
}

#[pymethods]
impl Operation {
    /// Name, the same in every language.
    #[getter]
    fn name(&self) -> &'static str {
        self.operation.name
    }

    /// Its effect, in a sentence.
    #[getter]
    fn text(&self) -> &'static str {
        self.operation.text
    }

    /// The version of the library it came with.
    #[getter]
    fn since(&self) -> &'static str {
        self.operation.since
    }

    /// Sorts of content that it takes, in words.
    #[getter]
    fn takes(&self) -> Vec<&'static str> {
        words(self.operation.takes)
    }

    /// Sorts of content that it gives, in words.
    #[getter]
    fn gives(&self) -> Vec<&'static str> {
        words(self.operation.gives)
    }

    /// Its command on the command line: its files' name, its effect in a line, and in full. ``None``: it has none.
    #[getter]
    fn command(&self) -> Option<(&'static str, &'static str, &'static str)> {
        self.operation.command.map(|Command { files, summary, text, .. }| (files, summary, text))
    }

    /// Name of its command, the word behind ``surfrecon``. ``None``: it has none.
    #[getter]
    fn command_name(&self) -> Option<&'static str> {
        self.operation.command.map(|command| command.name)
    }

    /// Its operator in Blender: identifier, name for people, tip. ``None``: it has none.
    #[getter]
    fn operator(&self) -> Option<(&'static str, &'static str, &'static str)> {
        self.operation.blender.map(|Operator { id, label, text }| (id, label, text))
    }

    /// Its filter in MeshLab: name for people, name in pymeshlab. ``None``: it has none.
    #[getter]
    fn filter(&self) -> Option<(&'static str, &'static str)> {
        self.operation.meshlab.map(|Filter { label, id, .. }| (label, id))
    }

    fn __repr__(&self) -> String {
        format!("<Operation {}: {}>", self.operation.name, self.operation.text)
    }
}

/// Every operation of the library, in the order of the work.
///
/// >>> [one.name for one in surfrecon.operations() if one.takes == ["a mesh"]]
/// ['write', 'check_print', 'prepare_print', 'unwrap', 'texture', 'check', 'scan']
#[pyfunction]
#[pyo3(name = "operations")]
pub fn all() -> Vec<Operation> {
    OPERATIONS.iter().map(|operation| Operation { operation }).collect()
}
