//! A range image as vertices that a host keeps, and back.

use super::*;

/// Places of the fields of srf_grid_camera, among the numbers after its first eight bytes.
mod field {
    pub const KIND: usize = 0;
    pub const STEP: usize = 3;
    pub const POINT: usize = 7;
    pub const ROWS: usize = 1285;
    pub const COLS: usize = 1286;
}

const STILL: [f64; 16] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
/// Scales by 2, mirrors, turns and shifts.
const MOVED: [f64; 16] = [0.0, 2.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 5.0, 6.0, 7.0, 1.0];

/// A bumpy height map with colours, 12 x 15 pixels of which one is missing.
fn height_map() -> Handle {
    let api = api();
    let values: Vec<f64> = (0..180).map(|i| if i == 20 { f64::NAN } else { (0.7 * f64::from(i)).sin() }).collect();
    let plane = Projection { kind: 1, reserved: 0, numbers: [1.0, 2.0, 0.5, -0.5] };
    let (colours, mut image) = (vec![[7_u8, 8, 9, 255]; 180], Handle::NULL);
    // SAFETY: as the header wants it.
    unsafe {
        let null = std::ptr::null();
        let samples = Array::of(&values, F64, 1);
        api.ok((api.srf_image_create)(12, 15, &plane, &samples, null, std::ptr::null(), &mut image));
        api.ok((api.srf_image_set_attributes)(image, &Array::of(&colours, U8, 4), null.cast(), null.cast()));
    }
    image
}

fn camera_of(image: Handle) -> GridCamera {
    let (api, mut camera) = (api(), GridCamera::ZERO);
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_grid_camera_init_sized)(&mut camera, size_of_val(&camera)));
        api.ok((api.srf_image_grid_camera)(image, std::ptr::null(), &mut camera));
    }
    camera
}

/// The vertices of an image, with or without faces: views of a mesh, which comes with them.
struct Given {
    mesh: Handle,
    positions: Array,
    row: Array,
    col: Array,
    colours: Array,
}

impl Given {
    fn of(image: Handle, faces: u32) -> Self {
        let api = api();
        let (mut mesh, [mut positions, mut row, mut col, mut colours]) = (Handle::NULL, [Array::EMPTY; 4]);
        // SAFETY: as the header wants it.
        unsafe {
            api.ok((api.srf_image_to_mesh)(image, faces, std::ptr::null(), &mut mesh));
            api.ok((api.srf_mesh_positions)(mesh, &mut positions));
            api.ok((api.srf_mesh_attribute)(mesh, 1, c"range_row".as_ptr(), &mut row));
            api.ok((api.srf_mesh_attribute)(mesh, 1, c"range_col".as_ptr(), &mut col));
            api.ok((api.srf_mesh_attribute)(mesh, 1, c"colour".as_ptr(), &mut colours));
        }
        Given { mesh, positions, row, col, colours }
    }

    fn image(&self, camera: &GridCamera, world_from_host: &[f64; 16]) -> (i32, Handle) {
        let (api, mut image, none) = (api(), Handle::NULL, std::ptr::null());
        // SAFETY: as the header wants it, or wrong in the ways it names.
        let status = unsafe {
            (api.srf_image_from_vertices)(
                camera,
                &self.row,
                &self.col,
                &self.positions,
                &self.colours,
                none,
                none,
                world_from_host,
                c"back".as_ptr(),
                std::ptr::null(),
                &mut image,
            )
        };
        assert_eq!(status == OK, image != Handle::NULL, "written in spite of the error");
        (status, image)
    }
}

/// World points of an image, which is freed. Also its projection.
fn content(image: Handle) -> (Vec<f64>, Projection) {
    let (api, mut projection) = (api(), Projection { kind: 0, reserved: 0, numbers: [0.0; 4] });
    let mut points = vec![0.0; 3 * 180];
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_image_camera)(image, &mut projection, std::ptr::null_mut()));
        api.ok((api.srf_image_world_points)(image, points.as_mut_ptr(), points.len(), std::ptr::null()));
        api.ok((api.srf_image_free)(image));
    }
    (points, projection)
}

#[test]
pub(super) fn vertices_of_an_image_and_back() {
    let (api, image) = (api(), height_map());
    let camera = camera_of(image);
    assert_eq!((camera.size as usize, camera.second), (size_of::<GridCamera>(), 179));
    assert_eq!((camera.numbers[field::ROWS], camera.numbers[field::COLS], camera.numbers[field::KIND]), (12, 15, 1));
    let given = Given::of(image, 1);
    assert_eq!((given.positions.count, given.row.count, given.row.kind), (179, 179, I32));
    let (status, back) = given.image(&camera, &MOVED);
    api.ok(status);
    let mut name = std::ptr::null();
    let (mut colours, none) = (Array::EMPTY, std::ptr::null_mut);
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_image_name)(back, &mut name));
        assert_eq!(CStr::from_ptr(name), c"back");
        api.ok((api.srf_image_attributes)(back, &mut colours, none(), none()));
        assert_eq!(colours.bytes()[4 * 21..4 * 22], [7, 8, 9, 255]);
        assert_eq!(colours.count, 180);
    }
    let (there, projection) = content(back);
    assert_eq!(projection, Projection { kind: 1, reserved: 0, numbers: [-2.0, 4.0, -1.0, -1.0] });

    // In another unit.
    let mut larger = camera;
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        api.ok((api.srf_grid_camera_scale)(&mut larger, 10.0));
        api.refused((api.srf_grid_camera_scale)(&mut larger, -1.0), PARAMETER, "the scale must be > 0, got -1");
    }
    assert_eq!((larger.f64(field::STEP), larger.f64(field::POINT)), (5.0, 10.0 * camera.f64(field::POINT)));

    // Without faces the vertices are the same; what is stretched is a grid of points.
    let bare = Given::of(image, 0);
    assert_eq!(bare.positions.bytes(), given.positions.bytes());
    let mut triangles = Array::EMPTY;
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_mesh_triangles)(bare.mesh, &mut triangles));
        assert_eq!(triangles.count, 0);
        api.ok((api.srf_mesh_triangles)(given.mesh, &mut triangles));
        assert!(triangles.count > 100);
    }
    let (status, back) = given.image(&camera, &STILL);
    api.ok(status);
    let (here, _) = content(back);
    for (there, here) in there.chunks(3).zip(here.chunks(3)).filter(|(there, _)| !there[0].is_nan()) {
        let moved = [2.0 * here[1] + 5.0, 2.0 * here[0] + 6.0, 2.0 * here[2] + 7.0];
        assert!((0..3).all(|k| (there[k] - moved[k]).abs() < 1e-5), "{there:?} {moved:?}");
    }
    let stretched = std::array::from_fn(|i| if i < 4 { 3.0 * STILL[i] } else { STILL[i] });
    let (status, back) = bare.image(&camera, &stretched);
    api.ok(status);
    assert_eq!(content(back).1.kind, 5);
    // SAFETY: as the header wants it.
    unsafe {
        for end in [(api.srf_mesh_free)(given.mesh), (api.srf_mesh_free)(bare.mesh), (api.srf_image_free)(image)] {
            api.ok(end);
        }
    }
}

#[test]
pub(super) fn what_is_no_range_image_is_refused() {
    let (api, image) = (api(), height_map());
    let camera = camera_of(image);
    let given = Given::of(image, 0);
    let refused = |given: &Given, camera: &GridCamera, pose: &[f64; 16], status, part: &str| {
        api.refused(given.image(camera, pose).0, status, part);
    };
    let with = |change: &dyn Fn(&mut Given)| {
        let mut other = Given { ..given };
        change(&mut other);
        other
    };
    let places: Vec<u32> = (0..179).collect();
    let outside = Array::of(&places, U32, 1);
    refused(&with(&|g| g.row = outside), &camera, &STILL, INPUT, "vertex 12 is pixel (12, 12)");
    let first = [0_i32; 179];
    let first = Array::of(&first, I32, 1);
    refused(&with(&|g| g.col = first), &camera, &STILL, INPUT, "vertices 0 and 1 are both pixel (0, 0)");
    refused(&with(&|g| g.row.count = 100), &camera, &STILL, INPUT, "179 vertices need 179 rows, got 100");
    refused(
        &with(&|g| g.row.kind = F32),
        &camera,
        &STILL,
        PARAMETER,
        "row: type must be SRF_TYPE_I32 or SRF_TYPE_U32, got SRF_TYPE_F32",
    );
    refused(&given, &camera, &STILL.map(|x| if x == 1.0 { f64::NAN } else { x }), INPUT, "must have finite numbers");
    let flat = std::array::from_fn(|i| if i == 5 { 0.0 } else { STILL[i] });
    refused(&given, &camera, &flat, INPUT, "flattens");
    refused(&given, &GridCamera::ZERO, &STILL, STRUCT_SIZE, "camera.struct_size is 0");
    refused(
        &given,
        &GridCamera { second: 257, ..camera },
        &STILL,
        PARAMETER,
        "camera.anchor_count must be at most 256",
    );
    let mut other = camera;
    other.numbers[field::KIND] = 9;
    refused(&given, &other, &STILL, PARAMETER, "projection.kind must be a value of srf_projection_kind");
    let mut huge = GridCamera { second: 0, ..camera };
    (huge.numbers[field::ROWS], huge.numbers[field::COLS]) = (1 << 20, 1 << 20);
    refused(&given, &huge, &STILL, INPUT, "1048576 x 1048576 pixels, but 179 vertices");
    let mut mesh = Handle::NULL;
    // SAFETY: wrong in a way that the header names.
    unsafe {
        let answer = (api.srf_image_to_mesh)(image, 2, std::ptr::null(), &mut mesh);
        api.refused(answer, PARAMETER, "faces must be 0 or 1, got 2");
        api.ok((api.srf_mesh_free)(given.mesh));
        api.ok((api.srf_image_free)(image));
    }
}
