//! Arguments of functions: handles, structs, arrays and files, right ones or with a fault.

use std::any::Any;
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;

use super::*;

/// The fault in a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    None,
    /// Handles that never were.
    Handle,
    /// A cancel that is set.
    Cancelled,
    /// Structs that were never initialized. Sizes that no struct has.
    Size,
    /// Structs one field older.
    Older,
    /// Structs one field newer.
    Newer,
    /// Structs of parameters whose numbers are none.
    Parameters,
    /// Arrays of no type.
    Type,
    /// Arrays and matrices whose numbers are none.
    Values,
    /// Numbers out of any range.
    Number,
    /// Texts that are not UTF-8.
    Text,
    /// Files in folders that are not there.
    Path,
    /// Scans whose files have gone.
    Gone,
    /// Scans whose files are damaged.
    Damaged,
    /// A context that allows no memory.
    Memory,
    /// Images, meshes, clouds and cameras too far off to be worked with, regions of another size, planes without a normal.
    Senseless,
}

pub const FAULTS: [Fault; 15] = [
    Fault::Handle,
    Fault::Cancelled,
    Fault::Size,
    Fault::Older,
    Fault::Newer,
    Fault::Parameters,
    Fault::Type,
    Fault::Values,
    Fault::Number,
    Fault::Text,
    Fault::Path,
    Fault::Gone,
    Fault::Damaged,
    Fault::Memory,
    Fault::Senseless,
];

/// Rows and columns of a bent surface: so many that an array of them is too large to pass any limit.
pub const SIDE: usize = 72;

/// Arguments of a function.
pub struct Kit {
    function: Cell<&'static str>,
    pub fault: Fault,
    /// Whether an argument has the fault.
    pub has_fault: Cell<bool>,
    /// The share of the call that its progress told last, where it has one.
    told: Cell<Option<*const f64>>,
    handles: RefCell<BTreeMap<&'static str, Handle>>,
    kept: RefCell<Vec<Box<dyn Any>>>,
    folder: tempfile::TempDir,
}

macro_rules! made {
    ($function:ident($($argument:expr),*)) => {{
        let mut made = Handle::NULL;
        // SAFETY: as the header wants it.
        api().ok(unsafe { (api().$function)($($argument,)* &mut made) });
        made
    }};
}

impl Kit {
    pub fn new(fault: Fault) -> Self {
        Kit {
            function: Cell::new(""),
            fault,
            has_fault: Cell::new(false),
            told: Cell::new(None),
            handles: RefCell::default(),
            kept: RefCell::default(),
            folder: tempfile::tempdir().unwrap(),
        }
    }

    /// From now on it is that function's.
    pub fn begin(&self, function: &'static str) {
        self.function.set(function);
        self.has_fault.set(false);
        self.told.set(None);
    }

    /// A progress that notes what it is told.
    pub fn watch(&self) -> *const Watch {
        unsafe extern "C" fn note(_: *const c_char, fraction: f64, _: *const c_char, told: *mut c_void) -> i32 {
            // SAFETY: a number of the kit's.
            unsafe { *told.cast::<f64>() = fraction };
            0
        }
        let told = self.keep(f64::NAN);
        self.told.set(Some(told));
        self.keep(Watch { report: Some(note), user: told.cast(), cancel: Handle::NULL })
    }

    /// The share of the call that its progress told last. `None` for calls without one.
    pub fn told(&self) -> Option<f64> {
        // SAFETY: the kit keeps it.
        self.told.get().map(|told| unsafe { *told })
    }

    /// The function that is to be called.
    pub fn function(&self) -> &'static str {
        self.function.get()
    }

    /// Whether this argument is to be the wrong one.
    pub fn is(&self, fault: Fault) -> bool {
        let is = self.fault == fault;
        if is {
            self.has_fault.set(true);
        }
        is
    }

    /// The call itself, when all that it is given is there.
    pub fn call<R>(&self, call: impl FnOnce() -> R) -> R {
        if !self.is(Fault::Memory) {
            return call();
        }
        let context = self.handle("context");
        // SAFETY: as the header wants it.
        unsafe {
            api().ok((api().srf_context_set_memory_limit)(context, 1));
            api().ok((api().srf_context_use)(context, std::ptr::null_mut()));
            let answer = call();
            api().ok((api().srf_context_use)(Handle::NULL, std::ptr::null_mut()));
            answer
        }
    }

    /// Something that stays as long as the kit.
    pub fn keep<T: 'static>(&self, value: T) -> *mut T {
        let mut value = Box::new(value);
        let place: *mut T = &mut *value;
        self.kept.borrow_mut().push(value);
        place
    }

    fn text(&self, text: &str) -> *const c_char {
        let text = CString::new(text).unwrap();
        let place = text.as_ptr();
        self.keep(text);
        place
    }

    pub fn path(&self, name: &str) -> *const c_char {
        self.text(self.folder.path().join(name).to_str().unwrap())
    }

    /// Rows of places of a bent surface.
    fn points(&self) -> Array {
        let place = |i: usize| {
            let (x, y) = ((i % SIDE) as f64 * 0.1, (i / SIDE) as f64 * 0.1);
            // A plane, and a bent part beside it.
            [x, y, if i % SIDE < 50 { 0.0 } else { 0.3 * (2.0 * x).sin() * y.cos() }]
        };
        let points: Vec<[f64; 3]> = (0..SIDE * SIDE).map(place).collect();
        let array = Array::of(&points, F64, 3);
        self.keep(points);
        array
    }

    pub fn scan_file(&self, name: &str) -> *const c_char {
        let file = self.folder.path().join(name);
        let image = self.handle("image");
        let path = CString::new(file.to_str().unwrap()).unwrap();
        // SAFETY: as the header wants it.
        api().ok(unsafe { (api().srf_images_write_ptx)(&image, 1, path.as_ptr(), std::ptr::null()) });
        // Of which the scans' notes tell.
        let beside = std::path::Path::new(name).with_extension("xf");
        std::fs::write(self.folder.path().join(beside), "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n").unwrap();
        self.path(name)
    }

    pub fn mesh_file(&self, name: &str) -> *const c_char {
        let path = self.path(name);
        // SAFETY: as the header wants it.
        api().ok(unsafe { (api().srf_mesh_write)(self.handle("mesh"), path, std::ptr::null(), std::ptr::null()) });
        path
    }

    pub fn spoil(&self, name: &str) {
        let file = self.folder.path().join(name);
        if self.is(Fault::Gone) {
            std::fs::remove_file(file).unwrap();
        } else if self.is(Fault::Damaged) {
            let mut bytes = std::fs::read(&file).unwrap();
            bytes.truncate(bytes.len() / 2);
            std::fs::write(&file, bytes).unwrap();
        }
    }

    /// A handle of the kind that arguments of this name have.
    pub fn handle(&self, name: &str) -> Handle {
        let name = match (name, self.function()) {
            ("mesh", "srf_mesh_prepare_print" | "srf_mesh_part") if self.fault != Fault::Senseless => "solid",
            ("mesh", "srf_mesh_texture") if self.fault != Fault::Senseless => "flat",
            ("detail", _) => "solid",
            _ => name,
        };
        let found = self.handles.borrow().iter().find(|(known, _)| **known == name).map(|(_, handle)| *handle);
        if let Some(handle) = found {
            return handle;
        }
        let (none, null) = (std::ptr::null(), std::ptr::null());
        let (kind, handle) = match name {
            "cancel" => ("cancel", made!(srf_cancel_create())),
            "context" => ("context", made!(srf_context_create())),
            "mesh" | "reference" | "image" | "cloud" | "region" if self.is(Fault::Senseless) => self.senseless(name),
            "mesh" => {
                let image = self.handle("image");
                let mesh = made!(srf_image_triangulate(image, std::ptr::null(), std::ptr::null()));
                let marks = vec![1.0_f32; SIDE * SIDE];
                let marks = Array::of(&marks, F32, 1);
                // SAFETY: as the header wants it.
                api().ok(unsafe { (api().srf_mesh_set_attribute)(mesh, 1, c"name".as_ptr(), &marks) });
                ("mesh", mesh)
            }
            "solid" => ("solid", self.solid()),
            "flat" => ("flat", self.flat()),
            "photo" => ("photo", self.photo()),
            "textures" => ("textures", self.textures()),
            "reference" => {
                ("reference", made!(srf_image_triangulate(self.handle("image"), std::ptr::null(), std::ptr::null())))
            }
            "image" => ("image", self.image()),
            "cloud" => (
                "cloud",
                made!(srf_cloud_create(&self.points(), std::ptr::null(), std::ptr::null(), std::ptr::null(), none)),
            ),
            "region" => {
                let region = made!(srf_region_below(self.plane()));
                ("region", region)
            }
            "folder" => {
                let folder = made!(srf_folder_create(std::ptr::null()));
                // SAFETY: as the header wants it.
                api().ok(unsafe { (api().srf_folder_put)(folder, c"name".as_ptr(), c"abc".as_ptr().cast(), 3) });
                ("folder", folder)
            }
            "scans" => {
                let paths = [self.scan_file("scan.ptx")];
                let scans = made!(srf_scans_open(paths.as_ptr(), 1, std::ptr::null(), std::ptr::null()));
                self.spoil("scan.ptx");
                ("scans", scans)
            }
            "aligner" => ("aligner", self.aligner([Fault::Gone, Fault::Damaged].contains(&self.fault))),
            "alignment" => {
                let aligner = self.aligner(false);
                let alignment = made!(srf_aligner_run(aligner, std::ptr::null(), std::ptr::null()));
                // SAFETY: as the header wants it.
                api().ok(unsafe { (api().srf_aligner_free)(aligner) });
                ("alignment", alignment)
            }
            "merger" => {
                let merger = made!(srf_merger_create());
                // SAFETY: as the header wants it.
                unsafe {
                    api().ok((api().srf_merger_add_image)(merger, self.handle("image")));
                    if [Fault::Gone, Fault::Damaged].contains(&self.fault) {
                        api().ok((api().srf_merger_add_scans)(merger, self.handle("scans")));
                    }
                }
                ("merger", merger)
            }
            "sculptor" => {
                ("sculptor", made!(srf_sculptor_create(self.handle("image"), std::ptr::null(), std::ptr::null())))
            }
            "reconstructor" => {
                ("reconstructor", made!(srf_reconstructor_create(self.handle("cloud"), std::ptr::null())))
            }
            "quads" => {
                let mut quads = Handle::NULL;
                let image = self.handle("image");
                // SAFETY: as the header wants it.
                api().ok(unsafe {
                    (api().srf_quads_create)(
                        image,
                        std::ptr::null(),
                        std::ptr::null(),
                        &mut quads,
                        std::ptr::null_mut(),
                    )
                });
                ("quads", quads)
            }
            "spline" => {
                let (mut spline, room) = (Handle::NULL, std::ptr::null_mut());
                let quads = self.handle("quads");
                // SAFETY: as the header wants it.
                api().ok(unsafe { (api().srf_spline_create)(quads, std::ptr::null(), null, &mut spline, room, room) });
                ("spline", spline)
            }
            other => panic!("{}: no handle is called {other}", self.function()),
        };
        self.handles.borrow_mut().insert(kind, handle);
        handle
    }

    /// A closed mesh of one part.
    fn solid(&self) -> Handle {
        let corners = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        let triangles = [0_u32, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2];
        let solid = made!(srf_mesh_create(&Array::of(&corners, F64, 3), &Array::of(&triangles, U32, 3)));
        let parts = Array::of(&[0_i32; 4], I32, 1);
        // SAFETY: as the header wants it.
        api().ok(unsafe { (api().srf_mesh_set_attribute)(solid, 2, c"part".as_ptr(), &parts) });
        solid
    }

    /// The closed mesh with texture coordinates.
    fn flat(&self) -> Handle {
        let (solid, mut flat) = (self.handle("solid"), Handle::NULL);
        let (mut params, none) = (UnwrapParams::ZERO, std::ptr::null_mut());
        // SAFETY: as the header wants it.
        unsafe {
            api().ok((api().srf_unwrap_params_init_sized)(&mut params, size_of_val(&params)));
            params.numbers[2] = 64;
            api().ok((api().srf_mesh_unwrap)(solid, &params, std::ptr::null(), &mut flat, none));
        }
        flat
    }

    /// A grey photo of the closed mesh.
    fn photo(&self) -> Handle {
        let (pixels, camera) = ([99_u8; 3 * 64], Projection { kind: 2, reserved: 0, numbers: [9.0, 9.0, 3.5, 3.5] });
        let (pixels, none) = (Array::of(&pixels, U8, 3), std::ptr::null());
        let mut below: [f64; 16] = std::array::from_fn(|i| if i % 5 == 0 { 1.0 } else { 0.0 });
        below[14] = -3.0;
        made!(srf_photo_create(8, 8, &camera, &pixels, &below, self.text("photo"), 0, 0, none))
    }

    /// The images of the closed mesh.
    fn textures(&self) -> Handle {
        let (flat, solid, photo) = (self.handle("flat"), self.handle("solid"), self.handle("photo"));
        let (mut textures, none) = (Handle::NULL, std::ptr::null_mut());
        let (params, watch) = (self.small_images(), std::ptr::null());
        // SAFETY: as the header wants it.
        api().ok(unsafe { (api().srf_mesh_texture)(flat, solid, &photo, 1, params, watch, &mut textures, none) });
        textures
    }

    /// Parameters of images of 64 texels.
    pub fn small_images(&self) -> *mut TextureParams {
        let params = self.keep(TextureParams::ZERO);
        // SAFETY: it is kept.
        unsafe {
            api().ok((api().srf_texture_params_init_sized)(params, size_of::<TextureParams>()));
            (*params).numbers[0] = 64;
        }
        params
    }

    /// A grid of points of the bent surface, seen from above.
    fn image(&self) -> Handle {
        let grid = Projection { kind: 6, reserved: 0, numbers: [1.0, 1.0, 9.0, 0.0] };
        made!(srf_image_create(SIDE, SIDE, &grid, &self.points(), std::ptr::null(), self.text("image")))
    }

    /// A handle that can be made and not be worked with.
    fn senseless(&self, name: &str) -> (&'static str, Handle) {
        let (none, null) = (std::ptr::null(), std::ptr::null());
        let numbers = vec![1e200; 3 * SIDE * SIDE];
        let (points, samples) = (Array::of(&numbers, F64, 3), Array::of(&numbers[..SIDE * SIDE], F64, 1));
        let plane = Projection { kind: 1, reserved: 0, numbers: [0.0, 0.0, 0.1, -0.1] };
        match name {
            "mesh" => ("mesh", made!(srf_mesh_create(&points, self.array("triangles")))),
            "reference" => ("reference", made!(srf_mesh_create(&points, self.array("triangles")))),
            "image" => ("image", made!(srf_image_create(SIDE, SIDE, &plane, &samples, none, std::ptr::null()))),
            "cloud" => ("cloud", made!(srf_cloud_create(&points, null, null, null, none))),
            _ => {
                let marks = Array::of(&[1_u8; 4], U8, 1);
                ("region", made!(srf_region_mask(&marks, 2, 2)))
            }
        }
    }

    /// An aligner of two scans, and of those of files if that is wanted.
    fn aligner(&self, with_files: bool) -> Handle {
        let aligner = made!(srf_aligner_create());
        let image = self.handle("image");
        // SAFETY: as the header wants it.
        unsafe {
            api().ok((api().srf_aligner_add_image)(aligner, image));
            api().ok((api().srf_aligner_add_image)(aligner, image));
            if with_files {
                api().ok((api().srf_aligner_add_scans)(aligner, self.handle("scans")));
            }
        }
        aligner
    }

    /// The plane z = 100, seen from above.
    pub fn plane(&self) -> *mut Plane {
        let plane = self.keep(Plane::ZERO);
        let points = [0.0, 0.0, 100.0, 1.0, 0.0, 100.0, 0.0, 1.0, 100.0_f64];
        let above = [0.0, 0.0, 200.0_f64];
        // SAFETY: as the header wants it.
        unsafe {
            api().ok((api().srf_plane_init_sized)(plane, size_of::<Plane>()));
            api().ok((api().srf_plane_through)(points.as_ptr(), above.as_ptr(), plane));
        }
        plane
    }

    pub fn camera(&self) -> *mut GridCamera {
        let camera = self.keep(GridCamera::ZERO);
        // SAFETY: as the header wants it.
        unsafe {
            api().ok((api().srf_grid_camera_init_sized)(camera, size_of::<GridCamera>()));
            let image = self.image();
            api().ok((api().srf_image_grid_camera)(image, std::ptr::null(), camera));
            api().ok((api().srf_image_free)(image));
            if self.is(Fault::Senseless) {
                // Behind the projection there are the anchors.
                let camera = &mut *camera;
                camera.numbers[64..].fill(f64::NAN.to_bits());
            }
        }
        camera
    }

    /// A struct that starts with its size, as the fault wants it.
    pub fn sized(&self, place: *mut c_void, size: usize) -> *mut c_void {
        let words = size / 8;
        let mut copy = vec![0_u64; words + 1];
        // SAFETY: the struct has that size.
        unsafe { std::ptr::copy_nonoverlapping(place.cast::<u64>(), copy.as_mut_ptr(), words) };
        let size = match () {
            () if self.is(Fault::Size) => 0,
            // A camera whose last fields are missing is none.
            () if size != size_of::<GridCamera>() && self.is(Fault::Older) => size - 8,
            () if self.is(Fault::Newer) => size + 8,
            () => size,
        };
        copy[0] = copy[0] >> 32 << 32 | size as u64;
        let copy = self.keep(copy);
        // SAFETY: it is kept.
        unsafe { (*copy).as_mut_ptr().cast() }
    }

    pub fn array(&self, name: &str) -> *const Array {
        let numbers = |count: usize, components: u32| {
            let values: Vec<f64> = (0..count * components as usize).map(|i| 1.0 + 0.01 * i as f64).collect();
            let array = Array::of(&values, F64, components);
            self.keep(values);
            array
        };
        let places = |of: fn(usize) -> usize| {
            let values: Vec<i32> = (0..SIDE * SIDE).map(|i| of(i) as i32).collect();
            let array = Array::of(&values, I32, 1);
            self.keep(values);
            array
        };
        let mut array = match name {
            "positions" | "points" => self.points(),
            "samples" | "depths" => numbers(SIDE * SIDE, 1),
            "data" => numbers(SIDE * SIDE, 1),
            "pixels" => {
                let grey = vec![99_u8; 3 * SIDE * SIDE];
                let array = Array::of(&grey, U8, 3);
                self.keep(grey);
                array
            }
            "row" => places(|i| i / SIDE),
            "col" => places(|i| i % SIDE),
            "triangles" => {
                let triangle = self.keep([0_u32, 1, 2]);
                // SAFETY: it is kept.
                Array::of(unsafe { &*triangle }, U32, 3)
            }
            "marks" => {
                let marks = vec![1_u8; SIDE * SIDE];
                let array = Array::of(&marks, U8, 1);
                self.keep(marks);
                array
            }
            // Too many to pass any limit.
            "intensities" | "confidences" if self.fault == Fault::Memory => numbers(SIDE * SIDE, 1),
            // An argument that may be left out is wrong or not there.
            _ if self.fault == Fault::Type || self.fault == Fault::Values => numbers(1, 1),
            _ => return std::ptr::null(),
        };
        if self.is(Fault::Type) {
            array.kind = 42;
        }
        if self.is(Fault::Values) {
            match name {
                "positions" | "points" | "samples" | "depths" | "data" | "row" | "col" | "marks" | "pixels" => {
                    array.count -= 1;
                }
                "triangles" => array.data = self.keep([0_u32, 1, u32::MAX]).cast(),
                "normals" | "sensors" => array = numbers(1, 3),
                "colours" => array = Array { kind: U8, components: 4, ..array },
                _ => {}
            }
            if matches!(name, "positions" | "points" | "samples") && self.function() != "srf_image_create" {
                let bad = self.keep([f64::NAN; 3]);
                array = Array { data: bad.cast(), count: 1, ..array };
            }
        }
        self.keep(array)
    }
}

impl Drop for Kit {
    fn drop(&mut self) {
        for (kind, handle) in self.handles.borrow().iter() {
            let free = match *kind {
                "cancel" => api().srf_cancel_free,
                "context" => api().srf_context_free,
                "mesh" | "solid" | "flat" | "reference" => api().srf_mesh_free,
                "photo" => api().srf_photo_free,
                "textures" => api().srf_textures_free,
                "image" => api().srf_image_free,
                "cloud" => api().srf_cloud_free,
                "region" => api().srf_region_free,
                "folder" => api().srf_folder_free,
                "scans" => api().srf_scans_free,
                "aligner" => api().srf_aligner_free,
                "alignment" => api().srf_alignment_free,
                "merger" => api().srf_merger_free,
                "sculptor" => api().srf_sculptor_free,
                "reconstructor" => api().srf_reconstructor_free,
                "quads" => api().srf_quads_free,
                _ => api().srf_spline_free,
            };
            // SAFETY: it is freed once, or was by the function itself.
            let _ = unsafe { free(*handle) };
        }
    }
}
