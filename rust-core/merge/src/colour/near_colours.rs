//! Colours of vertices that no scan has a colour of: those of the nearest that have one, ring by ring along the surface. In parts without
//! any, the nearest in space. Alpha stays 0, so that what was seen can be told from what was not.

use std::hash::BuildHasher as _;

use glam::DVec3;
use rustc_hash::FxBuildHasher;

use crate::surface::extract::Surface;
use crate::surface::passes;
use base::error::Result;
use base::progress::Progress;
use geom::neighbours::{Few, KdTree};
use mesh::srgb::Mix;

/// Colour if no vertex has one.
const NOWHERE: [u8; 4] = [u8::MAX, u8::MAX, u8::MAX, 0];
/// About so many vertices are searched for the nearest in space. Of more, some are taken, wherever they are.
const MOST: u64 = 1 << 20;

/// Gives vertices of alpha 0 the colours of those beside them. O(triangles).
///
/// # Errors
/// Cancelled.
pub fn fill_in(surface: &mut Surface, progress: &Progress<'_>) -> Result<()> {
    let apart = fill_in_along(surface, progress)?;
    if apart.is_empty() {
        return Ok(());
    }
    let mut seen = Seen::of(surface.colour.iter().filter(|colour| colour[3] != 0).count() as u64);
    passes::each(surface.colour.len(), progress, |v| seen.add(surface.positions[v], surface.colour[v]))?;
    seen.fill_in(surface, &apart, progress)
}

/// The same of vertices that are in parts with colours. The others are returned. Of the surface the bare vertices, the triangles at them
/// and their corners have to be known.
///
/// # Errors
/// Cancelled.
pub fn fill_in_along(surface: &mut Surface, progress: &Progress<'_>) -> Result<Vec<u32>> {
    let mut number = passes::filled(u32::MAX, surface.colour.len(), progress)?;
    let mut bare: Vec<u32> = Vec::new();
    passes::each(surface.colour.len(), progress, |v| {
        if surface.colour[v][3] == 0 {
            number[v] = bare.len() as u32;
            bare.push(v as u32);
        }
    })?;
    if bare.is_empty() {
        return Ok(bare);
    }
    let (starts, beside) = beside(&surface.triangles, &number, bare.len(), progress)?;
    let around = |i: u32| &beside[starts[i as usize] as usize..starts[i as usize + 1] as usize];
    // Of each the ring that it is in; 0 for what has a colour, the last for what has none yet.
    let mut rings = passes::filled(u32::MAX, bare.len(), progress)?;
    let ring_of = |rings: &[u32], v: u32| match number[v as usize] {
        u32::MAX => 0,
        i => rings[i as usize],
    };
    let mut ring: Vec<u32> = Vec::new();
    passes::each(bare.len(), progress, |i| {
        if around(i as u32).iter().any(|&v| ring_of(&rings, v) == 0) {
            ring.push(i as u32);
        }
    })?;
    let mut at = 0;
    while !ring.is_empty() {
        at += 1;
        passes::each(ring.len(), progress, |k| rings[ring[k] as usize] = at)?;
        let mixed = passes::made(ring.len(), progress, |k| {
            let mut mix = Mix::default();
            for &v in around(ring[k]).iter().filter(|&&v| ring_of(&rings, v) < at) {
                let [red, green, blue, _] = surface.colour[v as usize];
                mix.add([red, green, blue, u8::MAX], 1);
            }
            mix.colour()
        })?;
        passes::each(ring.len(), progress, |k| {
            let [red, green, blue, _] = mixed[k];
            surface.colour[bare[ring[k] as usize] as usize] = [red, green, blue, 0];
        })?;
        let mut next = Vec::new();
        passes::each(ring.len(), progress, |k| {
            for &v in around(ring[k]) {
                let i = number[v as usize];
                if i != u32::MAX && rings[i as usize] == u32::MAX {
                    // Of the next ring; once is enough.
                    rings[i as usize] = at + 1;
                    next.push(i);
                }
            }
        })?;
        ring = next;
    }
    let mut apart: Vec<u32> = Vec::new();
    passes::each(bare.len(), progress, |i| {
        if rings[i] == u32::MAX {
            apart.push(bare[i]);
        }
    })?;
    Ok(apart)
}

/// Vertices that were seen, or some of them.
pub struct Seen {
    /// One in so many is taken.
    every: u64,
    list: Vec<(DVec3, [u8; 4])>,
}

impl Seen {
    /// Of so many.
    pub fn of(count: u64) -> Self {
        Seen { every: 1 + count / MOST, list: Vec::new() }
    }

    /// Adds a vertex if it was seen.
    pub fn add(&mut self, place: DVec3, colour: [u8; 4]) {
        // The upper bits of this hash are the mixed ones.
        let is_taken = || FxBuildHasher.hash_one(place.to_array().map(f64::to_bits)) >> 32;
        if colour[3] != 0 && (self.every == 1 || is_taken() % self.every == 0) {
            self.list.push((place, colour));
        }
    }

    /// Gives vertices the colours of the nearest of these. O(vertices log vertices).
    ///
    /// # Errors
    /// Cancelled.
    pub fn fill_in(mut self, surface: &mut Surface, apart: &[u32], progress: &Progress<'_>) -> Result<()> {
        // Of equally near ones the first by coordinates, however vertices are numbered.
        let by_place = |(a, of_a): &(DVec3, [u8; 4]), (b, of_b): &(DVec3, [u8; 4])| {
            a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)).then(of_a.cmp(of_b))
        };
        progress.sort(&mut self.list, &by_place)?;
        let tree = KdTree::try_new(&self.list.iter().map(|seen| seen.0).collect::<Vec<_>>(), progress)?;
        let mut found = Few::default();
        passes::each(apart.len(), progress, |k| {
            let v = apart[k] as usize;
            tree.nearest_few(surface.positions[v], 1, f64::INFINITY, &mut found);
            let colour = found.iter().next().map(|(i, _)| self.list[i as usize].1);
            surface.colour[v] = colour.map_or(NOWHERE, |[red, green, blue, _]| [red, green, blue, 0]);
        })
    }
}

/// The vertices beside each that has a number, as starts and a flat list. Each as often as triangles have both.
fn beside(
    triangles: &[[u32; 3]],
    number: &[u32],
    count: usize,
    progress: &Progress<'_>,
) -> Result<(Vec<u32>, Vec<u32>)> {
    let sides = |t: usize| {
        let [a, b, c] = triangles[t];
        [(a, [b, c]), (b, [c, a]), (c, [a, b])].into_iter().filter_map(|(v, others)| {
            let i = number[v as usize];
            (i != u32::MAX).then_some((i as usize, others))
        })
    };
    let mut starts = passes::filled(0_u32, count + 1, progress)?;
    passes::each(triangles.len(), progress, |t| sides(t).for_each(|(i, others)| starts[i + 1] += others.len() as u32))?;
    passes::each(count, progress, |i| starts[i + 1] += starts[i])?;
    let mut next = starts.clone();
    let mut list = passes::filled(0_u32, starts[count] as usize, progress)?;
    passes::each(triangles.len(), progress, |t| {
        for (i, others) in sides(t) {
            for v in others {
                list[next[i] as usize] = v;
                next[i] += 1;
            }
        }
    })?;
    Ok((starts, list))
}

#[cfg(test)]
mod tests {
    use super::*;

    use glam::DVec3;

    /// A strip of triangles with these colours along it.
    fn strip(colours: &[[u8; 4]]) -> Surface {
        let triangles =
            (2..colours.len() as u32).map(|v| if v % 2 == 0 { [v - 2, v - 1, v] } else { [v - 1, v - 2, v] });
        Surface {
            colour: colours.to_vec(),
            positions: vec![DVec3::ZERO; colours.len()],
            triangles: triangles.collect(),
            ..Surface::default()
        }
    }

    #[test]
    fn the_nearest_colours_spread_and_say_that_they_were_not_seen() {
        let (red, blue, none) = ([200, 0, 0, 255], [0, 0, 200, 255], [9, 9, 9, 0]);
        let mut colours = vec![none; 101];
        (colours[0], colours[1], colours[99], colours[100]) = (red, red, blue, blue);
        let mut surface = strip(&colours);
        fill_in(&mut surface, &Progress::none()).unwrap();
        let [dark_red, dark_blue] = [[200, 0, 0, 0], [0, 0, 200, 0]];
        assert_eq!((surface.colour[0], surface.colour[100]), (red, blue));
        assert!(surface.colour[2..49].iter().all(|&colour| colour == dark_red), "{:?}", surface.colour);
        assert!(surface.colour[52..99].iter().all(|&colour| colour == dark_blue), "{:?}", surface.colour);
        assert_eq!(surface.colour[50], [146, 0, 146, 0]);
    }

    #[test]
    fn parts_without_a_colour_take_the_nearest_in_space() {
        let (red, blue, none) = ([200, 0, 0, 255], [0, 0, 200, 255], [9, 9, 9, 0]);
        let surface = |order: &[usize]| {
            let colours = [red, red, red, blue, blue, blue, none, none, none];
            let places = [0.0, 0.125, 0.25, 10.0, 10.125, 10.25, 4.0, 6.0, 5.125];
            let mut place = [0; 9];
            order.iter().enumerate().for_each(|(new, &old)| place[old] = new as u32);
            let mut surface = Surface {
                colour: order.iter().map(|&v| colours[v]).collect(),
                positions: order.iter().map(|&v| DVec3::new(places[v], 0.0, 1.0)).collect(),
                triangles: [[0, 1, 2], [3, 4, 5], [6, 7, 8]].map(|t| t.map(|v| place[v])).to_vec(),
                ..Surface::default()
            };
            fill_in(&mut surface, &Progress::none()).unwrap();
            place.map(|v| surface.colour[v as usize])
        };
        let (dark_red, dark_blue) = ([200, 0, 0, 0], [0, 0, 200, 0]);
        let expected = [red, red, red, blue, blue, blue, dark_red, dark_blue, dark_red];
        // The one in the middle lies as near to both.
        assert_eq!(surface(&[0, 1, 2, 3, 4, 5, 6, 7, 8]), expected);
        assert_eq!(surface(&[8, 7, 6, 5, 4, 3, 2, 1, 0]), expected);
    }

    #[test]
    fn where_nothing_is_near_it_is_white_and_what_has_a_colour_stays() {
        let mut surface = strip(&[[1, 2, 3, 0]; 5]);
        fill_in(&mut surface, &Progress::none()).unwrap();
        assert_eq!(surface.colour, [NOWHERE; 5]);
        let colours = [[1, 2, 3, 4], [5, 6, 7, 8], [9, 10, 11, 255]];
        let mut surface = strip(&colours);
        fill_in(&mut surface, &Progress::none()).unwrap();
        assert_eq!(surface.colour, colours);
    }
}
