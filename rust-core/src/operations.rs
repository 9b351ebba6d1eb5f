//! The one table of all operations.
//!
//! Every language and every host is made from it: from the parameters and the report of each, from its names and texts, and from
//! what it takes and gives. An operation that is added adds a line here.

pub use base::operation::{Command, DataKind, Filter, Operation, Operator};

/// Every operation, in the order of the work.
pub const OPERATIONS: &[Operation] = &[
    io::import::OPERATION,
    io::export::OPERATION,
    image::triangulate::OPERATION,
    plane::OPERATION,
    align::OPERATION,
    merge::OPERATION,
    sculpt::OPERATION,
    quads::OPERATION,
    quads::SPLINE_OPERATION,
    reconstruct::OPERATION,
    cluster::OPERATION,
    close::OPERATION,
    close::print::OPERATION,
    printing::OPERATION,
    unwrap::OPERATION,
    texture::OPERATION,
    mesh::CHECK_OPERATION,
    scan::OPERATION,
];

/// The operation of that name.
pub fn operation(name: &str) -> Option<&'static Operation> {
    OPERATIONS.iter().find(|operation| operation.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn declarations_are_whole() {
        let mut names = HashSet::new();
        let mut ids = HashSet::new();
        for operation in OPERATIONS {
            let name = operation.name;
            assert!(names.insert(name), "{name} is there twice");
            assert!(operation.text.ends_with('.') && !operation.takes.is_empty(), "{name}");
            assert!(
                operation.params.is_none_or(|schema| schema.operation == name),
                "{name} has the parameters of another"
            );
            assert!(operation.params.is_some() || !operation.report.is_empty(), "{name} has nothing to declare");
            if let Some(command) = operation.command {
                assert!(command.text.ends_with('.') && !command.summary.ends_with('.'), "{name}");
            }
            if let Some(operator) = operation.blender {
                assert!(ids.insert(operator.id), "two operators are called {}", operator.id);
                assert!(
                    !operator.text.ends_with('.') && operator.text.len() < 120,
                    "{name}: a tip is a short sentence"
                );
            }
            if let Some(filter) = operation.meshlab {
                assert!(ids.insert(filter.id) && !filter.menus.is_empty(), "{name}");
            }
        }
    }
}
