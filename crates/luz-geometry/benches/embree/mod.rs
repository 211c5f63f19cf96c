//! Embree 4 for comparison, loaded at run time from the library that `LUZ_EMBREE_LIB` names (or that the Python package
//! `embreex` brings along). Nothing links to it.
//!
//! Only what the benchmark calls is declared; the layouts are those of the C headers `rtcore_ray.h` and `rtcore_scene.h`.

use std::ffi::{CStr, CString, c_char, c_int, c_uint, c_void};
use std::ptr::null_mut;

use glam::Vec3;
use luz_geometry::{Ray, TriangleMesh};

unsafe extern "C" {
    fn dlopen(filename: *const c_char, flags: c_int) -> *mut c_void;
    fn dlsym(handle: *mut c_void, symbol: *const c_char) -> *mut c_void;
    fn dlerror() -> *const c_char;
}

type Handle = *mut c_void;

/// `RTCRay` and the `RTCHit` that follows it, with room for all of the latter's optional fields.
#[repr(C, align(16))]
struct RayHit {
    origin: [f32; 3],
    t_near: f32,
    direction: [f32; 3],
    time: f32,
    t_far: f32,
    mask: u32,
    id: u32,
    flags: u32,
    normal: [f32; 3],
    u: f32,
    v: f32,
    primitive: u32,
    geometry: u32,
    instances: [u32; 9],
}

impl RayHit {
    fn new(ray: &Ray) -> Self {
        Self {
            origin: ray.origin.to_array(),
            t_near: 0.0,
            direction: ray.direction.to_array(),
            time: 0.0,
            t_far: ray.t_max,
            mask: u32::MAX,
            id: 0,
            flags: 0,
            normal: [0.0; 3],
            u: 0.0,
            v: 0.0,
            primitive: u32::MAX,
            geometry: u32::MAX,
            instances: [u32::MAX; 9],
        }
    }
}

type Trace = unsafe extern "C" fn(Handle, *mut RayHit, *mut c_void);

/// The library.
pub struct Embree {
    library: Handle,
    device: Handle,
}

impl Embree {
    /// The library that the environment or Python names; `None`, and why on standard error, if there is none.
    pub fn load() -> Option<Self> {
        let path = std::env::var("LUZ_EMBREE_LIB").ok().or_else(find)?;
        let name = CString::new(path.clone()).ok()?;
        const RTLD_NOW: c_int = 2;
        // SAFETY: a path to a shared library; its initialisers are trusted as those of any library are.
        let library = unsafe { dlopen(name.as_ptr(), RTLD_NOW) };
        if library.is_null() {
            // SAFETY: after a failed dlopen there is a message, valid until the next call.
            eprintln!("cannot load {path}: {:?}", unsafe { CStr::from_ptr(dlerror()) });
            return None;
        }
        let mut embree = Self { library, device: null_mut() };
        // SAFETY: signature as in rtcore_device.h.
        embree.device = unsafe {
            let new: unsafe extern "C" fn(*const c_char) -> Handle = embree.function(c"rtcNewDevice")?;
            new(c"threads=1,set_affinity=0".as_ptr())
        };
        (!embree.device.is_null()).then_some(embree)
    }

    /// # Safety
    /// `F` must be the type of the C function.
    unsafe fn function<F: Copy>(&self, name: &CStr) -> Option<F> {
        assert_eq!(size_of::<F>(), size_of::<Handle>());
        // SAFETY: the handle is open; the caller vouches for the type.
        unsafe {
            let symbol = dlsym(self.library, name.as_ptr());
            (!symbol.is_null()).then(|| std::mem::transmute_copy(&symbol))
        }
    }

    /// A scene of one mesh, built on one thread.
    pub fn scene(&self, mesh: &TriangleMesh, robust: bool) -> Option<Scene> {
        const TRIANGLE: c_uint = 0;
        const INDEX: c_uint = 0;
        const VERTEX: c_uint = 1;
        const UINT3: c_uint = 0x5003;
        const FLOAT3: c_uint = 0x9003;
        const ROBUST: c_uint = 1 << 2;
        type NewBuffer = unsafe extern "C" fn(Handle, c_uint, c_uint, c_uint, usize, usize) -> *mut c_void;
        // SAFETY: signatures as in rtcore_scene.h and rtcore_geometry.h; the buffers are allocated by Embree for the
        // number of items that is then copied.
        unsafe {
            let new_scene: unsafe extern "C" fn(Handle) -> Handle = self.function(c"rtcNewScene")?;
            let set_flags: unsafe extern "C" fn(Handle, c_uint) = self.function(c"rtcSetSceneFlags")?;
            let new_geometry: unsafe extern "C" fn(Handle, c_uint) -> Handle = self.function(c"rtcNewGeometry")?;
            let new_buffer: NewBuffer = self.function(c"rtcSetNewGeometryBuffer")?;
            let commit_geometry: unsafe extern "C" fn(Handle) = self.function(c"rtcCommitGeometry")?;
            let attach: unsafe extern "C" fn(Handle, Handle) -> c_uint = self.function(c"rtcAttachGeometry")?;
            let commit_scene: unsafe extern "C" fn(Handle) = self.function(c"rtcCommitScene")?;

            let scene = new_scene(self.device);
            if robust {
                set_flags(scene, ROBUST);
            }
            let geometry = new_geometry(self.device, TRIANGLE);
            let vertices = new_buffer(geometry, VERTEX, 0, FLOAT3, size_of::<Vec3>(), mesh.positions.len());
            let indices = new_buffer(geometry, INDEX, 0, UINT3, 12, mesh.indices.len());
            if vertices.is_null() || indices.is_null() {
                return None;
            }
            std::ptr::copy_nonoverlapping(mesh.positions.as_ptr(), vertices.cast(), mesh.positions.len());
            std::ptr::copy_nonoverlapping(mesh.indices.as_ptr(), indices.cast(), mesh.indices.len());
            commit_geometry(geometry);
            attach(scene, geometry);
            commit_scene(scene);
            Some(Scene {
                scene,
                intersect: self.function(c"rtcIntersect1")?,
                occluded: self.function(c"rtcOccluded1")?,
            })
        }
    }
}

fn find() -> Option<String> {
    let script = "import embreex,glob,os;print(sorted(glob.glob(os.path.join(os.path.dirname(embreex.__file__),'..',\
                  'embreex.libs','libembree4*')))[0])";
    let output = std::process::Command::new("python3").args(["-c", script]).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// A built scene.
pub struct Scene {
    scene: Handle,
    intersect: Trace,
    occluded: Trace,
}

impl Scene {
    /// The nearest hit's distance, if any.
    #[inline]
    pub fn closest_hit(&self, ray: &Ray) -> Option<f32> {
        let mut hit = RayHit::new(ray);
        // SAFETY: signature as in rtcore_scene.h; the ray is aligned and large enough; no arguments means the defaults.
        unsafe { (self.intersect)(self.scene, &mut hit, null_mut()) };
        (hit.geometry != u32::MAX).then_some(hit.t_far)
    }

    /// Whether anything is hit.
    #[inline]
    pub fn any_hit(&self, ray: &Ray) -> bool {
        let mut hit = RayHit::new(ray);
        // SAFETY: as above; occlusion takes the ray part alone.
        unsafe { (self.occluded)(self.scene, &mut hit, null_mut()) };
        hit.t_far < 0.0
    }
}
