//! Stage 5: a fan of triangles for each patch, from its centre to its polygon. \[KMT, sec. 4.3\]

use glam::DVec3;

use super::kmeans::members;
use super::net::Net;
use super::polygons::{Polygons, Spot};
use super::surface::{NONE, Place, Surface};

/// The mesh of all fans. Nodes: the centres in the order of the patches, then the nodes of the polygons.
pub fn mesh(surface: &Surface, weights: &[f64], labels: &[u32], patches: usize, polygons: &Polygons) -> Net {
    let (starts, list) = members(labels, patches);
    let mut places = Vec::with_capacity(patches + polygons.spots.len());
    let mut rails = Vec::with_capacity(places.capacity());
    for patch in 0..patches {
        let members = &list[starts[patch] as usize..starts[patch + 1] as usize];
        places.push(centre(surface, weights, members));
        rails.push(NONE);
    }
    for spot in &polygons.spots {
        let (place, rail) = match *spot {
            Spot::Face(t) => {
                let [a, b, c] = surface.corners(t);
                (Place { point: a + ((b - a) + (c - a)) / 3.0, triangle: t }, NONE)
            }
            Spot::BorderEdge(h) => {
                let [a, b] = [surface.from(h), surface.to(h)].map(|v| surface.points[v as usize]);
                (Place { point: a + (b - a) * 0.5, triangle: h / 3 }, h)
            }
            Spot::BorderVertex(v) => {
                let h = surface.first[v as usize];
                (Place { point: surface.points[v as usize], triangle: h / 3 }, h)
            }
        };
        places.push(place);
        rails.push(rail);
    }
    let mut triangles = Vec::with_capacity(polygons.nodes.len());
    for (c, &patch) in polygons.patches.iter().enumerate() {
        let circle = polygons.circle(c);
        for (i, &node) in circle.iter().enumerate() {
            let next = circle[if i + 1 == circle.len() { 0 } else { i + 1 }];
            triangles.push([patch, node + patches as u32, next + patches as u32]);
        }
    }
    Net::new(places, rails, triangles)
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
