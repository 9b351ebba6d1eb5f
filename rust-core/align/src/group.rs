//! Scans in one frame, while poses are searched.

use glam::DAffine3;

/// Scans that lie in one frame: their numbers and poses in it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Group {
    pub members: Vec<(usize, DAffine3)>,
}

impl Group {
    pub fn pose(&self, scan: usize) -> Option<DAffine3> {
        self.members.iter().find(|member| member.0 == scan).map(|member| member.1)
    }
}
