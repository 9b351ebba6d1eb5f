//! Photos that can't be used, in words. Memory. Cancelling.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DAffine3, DVec3};

use base::{Error, Progress, Result};
use image::frame::Camera;
use image::photo::{Photo, Pixels};
use mesh::{AttributeData, TriMesh, texture};

use super::kit::{PLAIN, Shot, around, covered, shot, sphere, textured, unwrapped, waves};
use crate::{TextureParams, run};

fn told(shots: &[Shot]) -> String {
    let mesh = sphere();
    textured(&unwrapped(&mesh), &mesh, shots, &PLAIN).unwrap_err().to_string()
}

#[test]
fn photos_that_cannot_be_used_are_named() {
    let mesh = sphere();
    let good = shot("good", &mesh, DVec3::X * 4.0, &waves);
    let with = |change: &dyn Fn(&mut Shot)| {
        let mut bad = Shot { name: "bad".into(), ..good.clone() };
        change(&mut bad);
        told(&[good.clone(), bad])
    };
    let other_size = with(&|bad| bad.pixels = Pixels { size: [60, 50], colours: vec![[0; 3]; 3000] });
    assert!(other_size.contains("bad: the photo has 60 x 50 pixels, but its camera 120 x 100"), "{other_size}");
    let short = with(&|bad| bad.pixels.colours.truncate(11_999));
    assert!(short.contains("bad: the photo of 120 x 100 pixels must have as many, got 11999"), "{short}");
    assert!(with(&|bad| bad.name = "good".into()).contains("two photos are called good"));
    assert!(with(&|bad| bad.camera.size = None).contains("bad: the camera has no size"));
    assert!(with(&|bad| bad.camera.focal[0] = 0.0).contains("bad: "));
    assert!(with(&|bad| bad.world_from_camera.matrix3 *= 2.0).contains("must be a rotation"));
    assert!(with(&|bad| bad.world_from_camera.translation.x = f64::NAN).contains("bad: the position"));
    assert!(told(&[]).contains("neither photos nor colours"));
}

#[test]
fn black_and_overexposed_photos_say_nothing() {
    let mesh = sphere();
    let flat = unwrapped(&mesh);
    let eyes = around(6, 4.0);
    let mut shots: Vec<Shot> =
        eyes.iter().enumerate().map(|(i, &eye)| shot(&i.to_string(), &mesh, eye, &waves)).collect();
    let clean = textured(&flat, &mesh, &shots, &PLAIN).unwrap();
    for (name, colour) in [("black", [0; 3]), ("white", [255; 3])] {
        let mut useless = Shot { name: name.into(), ..shots[0].clone() };
        useless.pixels.colours.fill(colour);
        shots.push(useless);
    }
    let done = textured(&flat, &mesh, &shots, &PLAIN).unwrap();
    assert!(done.images.tiles == clean.images.tiles);
    let said: Vec<&str> =
        done.report.photos.iter().map(|photo| photo.reason.as_str()).filter(|reason| !reason.is_empty()).collect();
    assert_eq!(said, ["100 % of its pixels are black or overexposed"; 2]);
}

/// Hands out the same photo under many names, and counts how many of them are held.
struct Streamed<'a> {
    name: String,
    of: &'a Shot,
    asked: &'a AtomicUsize,
}

impl Photo for Streamed<'_> {
    fn name(&self) -> &str {
        &self.name
    }
    fn camera(&self) -> Camera {
        self.of.camera
    }
    fn world_from_camera(&self) -> DAffine3 {
        self.of.world_from_camera
    }
    fn pixels(&self) -> Result<Pixels> {
        self.asked.fetch_add(1, Ordering::Relaxed);
        self.of.pixels()
    }
}

#[test]
fn photos_are_asked_for_once_per_purpose_and_not_kept() {
    let mesh = sphere();
    let flat = unwrapped(&mesh);
    let shot = shot("", &mesh, DVec3::X * 4.0, &waves);
    let count = if base::tier::is_thorough() { 1000 } else { 60 };
    let asked = AtomicUsize::new(0);
    let streamed: Vec<Streamed<'_>> =
        (0..count).map(|i| Streamed { name: format!("{i:04}"), of: &shot, asked: &asked }).collect();
    let photos: Vec<&dyn Photo> = streamed.iter().map(|photo| photo as &dyn Photo).collect();
    let done = run(&flat.mesh, &mesh, &photos, &PLAIN, &Progress::none()).unwrap();
    assert_eq!(asked.load(Ordering::Relaxed), 2 * count);
    let one = textured(&flat, &mesh, std::slice::from_ref(&shot), &PLAIN).unwrap();
    let same = covered(&flat)
        .iter()
        .all(|&(i, _)| super::kit::apart(one.images.tiles[0].colour[i], done.images.tiles[0].colour[i]) < 2);
    assert!(same && done.images.tiles[0].mask == one.images.tiles[0].mask);
}

/// A photo that is gone.
struct Missing<'a>(&'a Shot);

impl Photo for Missing<'_> {
    fn name(&self) -> &str {
        "missing.jpg"
    }
    fn camera(&self) -> Camera {
        self.0.camera
    }
    fn world_from_camera(&self) -> DAffine3 {
        self.0.world_from_camera
    }
    fn pixels(&self) -> Result<Pixels> {
        Err(Error::io("missing.jpg".as_ref(), std::io::ErrorKind::NotFound.into()))
    }
}

#[test]
fn a_missing_photo_is_named() {
    let mesh = sphere();
    let flat = unwrapped(&mesh);
    let shot = shot("", &mesh, DVec3::X * 4.0, &waves);
    let missing = Missing(&shot);
    let error = run(&flat.mesh, &mesh, &[&missing], &PLAIN, &Progress::none()).unwrap_err();
    assert!(error.to_string().contains("missing.jpg"), "{error}");
}

#[test]
fn meshes_and_coordinates_that_cannot_be_used_are_named() {
    let mesh = sphere();
    let flat = unwrapped(&mesh);
    let shot = shot("one", &mesh, DVec3::X * 4.0, &waves);
    let told = |textured: &TriMesh, detail: &TriMesh, params: &TextureParams| {
        run(textured, detail, &[&shot], params, &Progress::none()).unwrap_err().to_string()
    };
    assert!(
        told(&mesh, &mesh, &PLAIN).contains("has no texture coordinates, but texturing needs some: unwrap it first")
    );
    for outside in [-0.5, 10.5, f32::NAN] {
        let mut wrong = flat.mesh.clone();
        let s = wrong.vertex_attributes.iter_mut().find(|attribute| attribute.name == texture::S).unwrap();
        let AttributeData::F32(s) = &mut s.data else { panic!("coordinates are floats") };
        s[7] = outside;
        assert!(told(&wrong, &mesh, &PLAIN).contains("lie in no one tile"), "{outside}");
    }
    assert!(told(&flat.mesh, &TriMesh::default(), &PLAIN).contains("the detailed surface has no triangles"));
    assert!(told(&flat.mesh, &mesh, &TextureParams { size: 8, ..PLAIN }).contains("size must be"));
}

#[test]
fn it_can_be_cancelled_anywhere() {
    let mesh = sphere();
    let flat = unwrapped(&mesh);
    let shots: Vec<Shot> =
        around(3, 4.0).iter().enumerate().map(|(i, &eye)| shot(&i.to_string(), &mesh, eye, &waves)).collect();
    let photos: Vec<&dyn Photo> = shots.iter().map(|shot| shot as &dyn Photo).collect();
    let params = TextureParams { size: 96, threads: 1, occlusion_rays: 2, ..TextureParams::default() };
    let (mut checks, mut cancelled) = (0, 0);
    while let Err(error) = run(&flat.mesh, &mesh, &photos, &params, &Progress::cancel_after(checks)) {
        assert!(matches!(error, Error::Cancelled), "{error}");
        cancelled += 1;
        checks += 1 + checks / 2;
    }
    assert!(cancelled > 8, "{cancelled}");
}
