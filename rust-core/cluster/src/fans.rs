//! Stage 5: a fan of triangles for each patch, from its centre to its polygon. \[KMT, sec. 4.3\]

use glam::DVec3;

use super::creases::Pieces;
use super::kmeans::members;
use super::net::{CORNER, Net};
use super::polygons::{PolygonSpot, Polygons};
use super::surface::{NONE, Place, Surface};

/// The mesh of all fans. Nodes: the centres in the order of the patches, then the nodes of the polygons. Those of patches with a
/// piece of a crease lie on it.
pub fn mesh(
    surface: &Surface,
    weights: &[f64],
    labels: &[u32],
    patches: usize,
    polygons: &Polygons,
    pieces: Option<&Pieces<'_>>,
) -> Net {
    let (starts, list) = members(labels, patches);
    let at_vertex = |v: u32| Place { point: surface.points[v as usize], triangle: surface.first[v as usize] / 3 };
    let piece = |patch: usize| pieces.and_then(|p| p.chosen[patch].as_ref());
    let way = |v: u32| pieces.map_or(NONE, |p| p.creases.way(v));
    // The place of each node, the border and the crease along which it slides.
    let mut nodes = Vec::with_capacity(patches + polygons.spots.len());
    for patch in 0..patches {
        let members = &list[starts[patch] as usize..starts[patch + 1] as usize];
        nodes.push(match piece(patch) {
            Some(piece) => (at_vertex(piece.centre), NONE, way(piece.centre)),
            None => (centre(surface, weights, members), NONE, NONE),
        });
    }
    nodes.extend(polygons.spots.iter().map(|spot| match *spot {
        PolygonSpot::Face(t) => {
            let [a, b, c] = surface.corners(t);
            (Place { point: a + ((b - a) + (c - a)) / 3.0, triangle: t }, NONE, NONE)
        }
        PolygonSpot::BorderEdge(h) => (middle(surface, h), h, NONE),
        PolygonSpot::BorderVertex(v) => {
            let ends = pieces.is_some_and(|p| p.has(v, labels[v as usize]));
            (at_vertex(v), surface.first[v as usize], if ends { CORNER } else { NONE })
        }
        PolygonSpot::Crease(h) => (middle(surface, h), NONE, h),
    }));
    let mut triangles = Vec::with_capacity(polygons.nodes.len());
    let mut ridges = Vec::new();
    for (c, &patch) in polygons.patches.iter().enumerate() {
        let circle = polygons.circle(c);
        for (i, &node) in circle.iter().enumerate() {
            let next = circle[if i + 1 == circle.len() { 0 } else { i + 1 }];
            let node = node + patches as u32;
            triangles.push([patch, node, next + patches as u32]);
            if piece(patch as usize).is_some() && nodes[node as usize].2 != NONE {
                ridges.push([patch, node]);
            }
        }
    }
    ridges.sort_unstable();
    Net::new(nodes, triangles, ridges)
}

/// The middle of an edge.
fn middle(surface: &Surface, h: u32) -> Place {
    let [a, b] = [surface.from(h), surface.to(h)].map(|v| surface.points[v as usize]);
    Place { point: a + (b - a) * 0.5, triangle: h / 3 }
}

/// The place on the patch nearest to its centroid, found from its nearest vertex.
fn centre(surface: &Surface, weights: &[f64], members: &[u32]) -> Place {
    let (sum, weight) = members.iter().fold((DVec3::ZERO, 0.0), |(sum, weight), &v| {
        (sum + surface.points[v as usize] * weights[v as usize], weight + weights[v as usize])
    });
    let centroid = sum / weight;
    let nearest = members.iter().fold((f64::INFINITY, members[0]), |best, &v| {
        let squared = surface.points[v as usize].distance_squared(centroid);
        if squared < best.0 { (squared, v) } else { best }
    });
    let v = nearest.1;
    if surface.on_border(v) {
        // Away from the border, or the fan would have no area there.
        let h = surface.first[v as usize];
        let [a, b, c] = surface.corners(h / 3);
        let inside = surface.walk(a + ((b - a) + (c - a)) / 3.0, h / 3);
        let walked = surface.walk(centroid, h / 3);
        return if members.len() < 3 { inside } else { walked };
    }
    surface.walk(centroid, surface.first[v as usize] / 3)
}
