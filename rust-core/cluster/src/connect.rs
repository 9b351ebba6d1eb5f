//! Patches become connected: parts of one that are not become patches of their own, or go to their neighbours if they are small.

use super::surface::{NONE, Surface, looking};
use base::error::Result;
use base::progress::Progress;

/// A part smaller than this share of the mean patch goes to its neighbours.
pub const SMALL: f64 = 0.25;

/// Counts of the repairs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Repairs {
    /// Parts that became patches.
    pub separated: usize,
    /// Parts and patches given to their neighbours.
    pub dissolved: usize,
    /// Patches halved as they were no disks.
    pub halved: usize,
}

/// Makes every patch connected and numbers the patches anew. Returns how many there are. Small parts go to their neighbours while
/// `dissolving`.
///
/// # Errors
/// Cancelled.
pub fn connect(
    surface: &Surface,
    weights: &[f64],
    labels: &mut [u32],
    dissolving: bool,
    repairs: &mut Repairs,
    progress: &Progress<'_>,
) -> Result<usize> {
    let parts = Parts::flood(surface, weights, labels, progress)?;
    let patches = labels.iter().max().map_or(0, |&m| m as usize + 1);
    let heaviest = parts.heaviest(patches);
    let into = if dissolving {
        let small = SMALL * parts.weights.iter().sum::<f64>() / patches.max(1) as f64;
        parts.dissolved(surface, &heaviest, small)
    } else {
        (0..parts.len() as u32).collect()
    };
    for (part, &end) in into.iter().enumerate() {
        let is_heaviest = heaviest[parts.labels[part] as usize] == part as u32;
        repairs.dissolved += usize::from(end != part as u32);
        repairs.separated += usize::from(end == part as u32 && !is_heaviest);
    }
    Ok(parts.number(&heaviest, &into, labels))
}

/// The connected parts of all patches, in the order of their first vertices.
struct Parts {
    /// The part of each vertex.
    of: Vec<u32>,
    /// The patch that each is a part of.
    labels: Vec<u32>,
    weights: Vec<f64>,
    /// The vertices of all, part by part, and the first place of each part. There is one more at the end.
    members: Vec<u32>,
    starts: Vec<u32>,
}

impl Parts {
    fn flood(surface: &Surface, weights: &[f64], labels: &[u32], progress: &Progress<'_>) -> Result<Self> {
        let mut parts = Parts {
            of: vec![NONE; labels.len()],
            labels: Vec::new(),
            weights: Vec::new(),
            members: Vec::new(),
            starts: vec![0],
        };
        let mut stack = Vec::new();
        for seed in 0..labels.len() as u32 {
            looking(seed, progress)?;
            if parts.of[seed as usize] != NONE {
                continue;
            }
            let (part, label) = (parts.len() as u32, labels[seed as usize]);
            let mut weight = 0.0;
            parts.of[seed as usize] = part;
            stack.push(seed);
            while let Some(v) = stack.pop() {
                looking(parts.members.len() as u32, progress)?;
                weight += weights[v as usize];
                parts.members.push(v);
                surface.neighbours(v, |w| {
                    if parts.of[w as usize] == NONE && labels[w as usize] == label {
                        parts.of[w as usize] = part;
                        stack.push(w);
                    }
                });
            }
            parts.labels.push(label);
            parts.weights.push(weight);
            parts.starts.push(parts.members.len() as u32);
        }
        Ok(parts)
    }

    fn len(&self) -> usize {
        self.labels.len()
    }

    fn members(&self, part: usize) -> &[u32] {
        &self.members[self.starts[part] as usize..self.starts[part + 1] as usize]
    }

    /// Of each patch the heaviest part, the first of several: it keeps the patch's place.
    fn heaviest(&self, patches: usize) -> Vec<u32> {
        let mut heaviest = vec![NONE; patches];
        for (part, (&label, &weight)) in self.labels.iter().zip(&self.weights).enumerate() {
            let slot = &mut heaviest[label as usize];
            if *slot == NONE || weight > self.weights[*slot as usize] {
                *slot = part as u32;
            }
        }
        heaviest
    }

    /// The part that each goes to, itself if it stays: parts lighter than `small` go to what they touch most, unless all that has
    /// gone itself.
    fn dissolved(&self, surface: &Surface, heaviest: &[u32], small: f64) -> Vec<u32> {
        let mut into: Vec<u32> = (0..self.len() as u32).collect();
        let mut contacts = Vec::new();
        for part in 0..self.len() {
            if heaviest[self.labels[part] as usize] == part as u32 || !(self.weights[part] < small) {
                continue;
            }
            contacts.clear();
            for &v in self.members(part) {
                surface.neighbours(v, |w| {
                    let other = self.of[w as usize];
                    if other != part as u32 && into[other as usize] == other {
                        contacts.push(other);
                    }
                });
            }
            into[part] = most_frequent(&mut contacts).unwrap_or(part as u32);
        }
        into
    }

    /// Writes the number of its patch for each vertex. Returns how many patches there are. They keep their order. Parts that became patches
    /// follow.
    fn number(&self, heaviest: &[u32], into: &[u32], labels: &mut [u32]) -> usize {
        let mut order: Vec<u32> = (0..self.len() as u32).filter(|&p| into[p as usize] == p).collect();
        order.sort_by_key(|&p| {
            let label = self.labels[p as usize];
            let follows = heaviest[label as usize] != p;
            (follows, if follows { p } else { label })
        });
        let mut number = vec![NONE; self.len()];
        for (n, &part) in order.iter().enumerate() {
            number[part as usize] = n as u32;
        }
        // A part goes to one that is kept then, but may have gone on since: always to one that was kept, so in no circle.
        for (label, &part) in labels.iter_mut().zip(&self.of) {
            let mut end = part;
            while into[end as usize] != end {
                end = into[end as usize];
            }
            *label = number[end as usize];
        }
        order.len()
    }
}

/// The value that occurs most often, the smallest of several.
pub fn most_frequent(values: &mut [u32]) -> Option<u32> {
    values.sort_unstable();
    let mut best = (0, None);
    for run in values.chunk_by(|a, b| a == b) {
        if run.len() > best.0 {
            best = (run.len(), Some(run[0]));
        }
    }
    best.1
}
