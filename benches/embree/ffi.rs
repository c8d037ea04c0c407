//! As much of Embree 4's C interface as a race needs, from a library loaded at run time. After `include/embree4/rtcore*.h`.
#![allow(unsafe_code)]

use std::ffi::{CStr, c_char, c_int, c_uint, c_void};
use std::path::Path;
use std::ptr::NonNull;

use libloading::Library;
use pipeline::accel::Ray;

type Handle = NonNull<c_void>;
type Device = Handle;
type Geometry = Handle;

/// What keeps Embree from being measured.
#[derive(Debug, thiserror::Error)]
pub(crate) enum EmbreeError {
    /// The file is no library, or lacks a function of Embree's.
    #[error("Embree's library can't be loaded")]
    Library(#[from] libloading::Error),
    /// Its structures may be laid out otherwise.
    #[error("the library is Embree {0}, not 4")]
    Version(String),
    /// What `rtcGetDeviceError` tells: 2 for a bad argument, 4 for want of memory, 5 for a processor too old.
    #[error("Embree reports error {0}")]
    Reported(c_int),
}

/// Declares functions of the library and how they are found by their names.
macro_rules! functions {
    ($($name:ident($($argument:ty),*) $(-> $result:ty)?;)*) => {
        #[allow(non_snake_case, reason = "named as in the library")]
        struct Functions {
            $($name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl Functions {
            /// They may be called as long as the library is loaded.
            fn find(library: &Library) -> Result<Self, libloading::Error> {
                Ok(Self {
                    $(
                        // SAFETY: the signature is the header's.
                        $name: *unsafe { library.get(stringify!($name)) }?,
                    )*
                })
            }
        }
    };
}

functions! {
    rtcNewDevice(*const c_char) -> Option<Device>;
    rtcReleaseDevice(Device);
    rtcGetDeviceProperty(Device, c_int) -> isize;
    rtcGetDeviceError(Option<Device>) -> c_int;
    rtcNewScene(Device) -> Option<Handle>;
    rtcReleaseScene(Handle);
    rtcSetSceneBuildQuality(Handle, c_int);
    rtcSetSceneFlags(Handle, c_int);
    rtcCommitScene(Handle);
    rtcNewGeometry(Device, c_int) -> Option<Geometry>;
    rtcReleaseGeometry(Geometry);
    rtcSetNewGeometryBuffer(Geometry, c_int, c_uint, c_int, usize, usize) -> *mut c_void;
    rtcSetGeometryBuildQuality(Geometry, c_int);
    rtcCommitGeometry(Geometry);
    rtcAttachGeometry(Handle, Geometry) -> c_uint;
    rtcIntersect1(Handle, *mut RayHit, *const c_void);
    rtcOccluded1(Handle, *mut Segment, *const c_void);
}

/// `RTC_DEVICE_PROPERTY_VERSION`: two decimal digits each for the minor version and the patch.
const VERSION: c_int = 0;
/// `RTC_BUILD_QUALITY_HIGH`.
const HIGH_QUALITY: c_int = 2;
/// `RTC_GEOMETRY_TYPE_TRIANGLE`.
const TRIANGLES: c_int = 0;
/// `RTC_BUFFER_TYPE_INDEX` and `RTC_FORMAT_UINT3`.
const INDICES: [c_int; 2] = [0, 0x5003];
/// `RTC_BUFFER_TYPE_VERTEX` and `RTC_FORMAT_FLOAT3`.
const POINTS: [c_int; 2] = [1, 0x9003];
/// `RTC_INVALID_GEOMETRY_ID`.
const NONE: u32 = u32::MAX;

/// How traversal decides what touches a box or an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Mode {
    /// `RTC_SCENE_FLAG_NONE`: as fast as it can.
    Default = 0,
    /// `RTC_SCENE_FLAG_ROBUST`: so that no ray slips between neighbours.
    Robust = 4,
}

/// `RTCRay`.
#[repr(C, align(16))]
struct Segment {
    origin: [f32; 3],
    near: f32,
    direction: [f32; 3],
    time: f32,
    /// Negative infinity once a query for any hit has found one.
    far: f32,
    mask: u32,
    id: u32,
    flags: u32,
}

/// `RTCHit`, one level of instances deep.
#[repr(C, align(16))]
struct Meeting {
    normal: [f32; 3],
    uv: [f32; 2],
    primitive: u32,
    geometry: u32,
    instance: [u32; 2],
}

/// `RTCRayHit`.
#[repr(C, align(16))]
struct RayHit {
    ray: Segment,
    hit: Meeting,
}

// As C lays them out.
const _: () = assert!(size_of::<Segment>() == 48 && size_of::<Meeting>() == 48 && size_of::<RayHit>() == 96);

impl Segment {
    #[inline(always)]
    fn new(ray: &Ray) -> Self {
        Self {
            origin: ray.origin.to_array(),
            near: 0.0,
            direction: ray.direction.to_array(),
            time: 0.0,
            far: ray.t_max,
            mask: u32::MAX,
            id: 0,
            flags: 0,
        }
    }
}

/// The library with a device on one thread.
pub(crate) struct Embree {
    functions: Functions,
    device: Device,
    /// What `functions` point into: dropped last.
    _library: Library,
}

impl Embree {
    /// Loads the library at `path`.
    ///
    /// # Errors
    /// If it can't be loaded, is another version than 4, or makes no device.
    pub(crate) fn load(path: &Path) -> Result<Self, EmbreeError> {
        const ONE_THREAD: &CStr = c"threads=1";
        // SAFETY: whoever names the file says that it is Embree's, whose initialisers ask for nothing.
        let library = unsafe { Library::new(path) }?;
        let functions = Functions::find(&library)?;
        // SAFETY: the configuration is a C string.
        let device = unsafe { (functions.rtcNewDevice)(ONE_THREAD.as_ptr()) };
        let Some(device) = device else {
            // SAFETY: without a device it tells why there is none.
            return Err(EmbreeError::Reported(unsafe { (functions.rtcGetDeviceError)(None) }));
        };
        let embree = Self { functions, device, _library: library };
        match embree.version() {
            [4, ..] => Ok(embree),
            [major, minor, patch] => Err(EmbreeError::Version(format!("{major}.{minor}.{patch}"))),
        }
    }

    /// Major, minor and patch.
    pub(crate) fn version(&self) -> [isize; 3] {
        // SAFETY: the device is alive.
        let version = unsafe { (self.functions.rtcGetDeviceProperty)(self.device, VERSION) };
        [version / 10_000, version / 100 % 100, version % 100]
    }

    /// A tree of the best quality over `triangles`, which name three of the `points` each.
    ///
    /// # Errors
    /// If Embree reports one.
    pub(crate) fn scene(
        &self,
        points: &[[f32; 3]],
        triangles: &[[u32; 3]],
        mode: Mode,
    ) -> Result<Scene<'_>, EmbreeError> {
        let f = &self.functions;
        // SAFETY: the device is alive.
        let handle = unsafe { (f.rtcNewScene)(self.device) }.ok_or_else(|| self.error())?;
        let scene = Scene { embree: self, handle };
        // SAFETY: the device is alive.
        let geometry = unsafe { (f.rtcNewGeometry)(self.device, TRIANGLES) }.ok_or_else(|| self.error())?;
        let filled =
            self.fill(geometry, POINTS, points).and_then(|()| self.fill(geometry, INDICES, triangles));
        // SAFETY: scene and geometry are alive and of the device; the scene keeps the geometry, which is released once here.
        unsafe {
            if filled.is_ok() {
                (f.rtcSetGeometryBuildQuality)(geometry, HIGH_QUALITY);
                (f.rtcCommitGeometry)(geometry);
                (f.rtcAttachGeometry)(handle, geometry);
                (f.rtcSetSceneBuildQuality)(handle, HIGH_QUALITY);
                (f.rtcSetSceneFlags)(handle, mode as c_int);
                (f.rtcCommitScene)(handle);
            }
            (f.rtcReleaseGeometry)(geometry);
        }
        filled?;
        match self.reported() {
            0 => Ok(scene),
            code => Err(EmbreeError::Reported(code)),
        }
    }

    /// Gives a geometry a buffer of triples.
    fn fill<T: Copy>(
        &self,
        geometry: Geometry,
        [kind, format]: [c_int; 2],
        triples: &[[T; 3]],
    ) -> Result<(), EmbreeError> {
        let (stride, count) = (size_of::<[T; 3]>(), triples.len());
        // SAFETY: the geometry is alive.
        let buffer =
            unsafe { (self.functions.rtcSetNewGeometryBuffer)(geometry, kind, 0, format, stride, count) };
        let buffer = NonNull::new(buffer.cast::<[T; 3]>()).ok_or_else(|| self.error())?;
        // SAFETY: Embree has allocated room for as many triples, apart from all memory of ours and aligned to 16 bytes.
        unsafe { buffer.copy_from_nonoverlapping(NonNull::from(triples).cast(), count) };
        Ok(())
    }

    /// The code of the first error since the last call; 0 for none.
    fn reported(&self) -> c_int {
        // SAFETY: the device is alive.
        unsafe { (self.functions.rtcGetDeviceError)(Some(self.device)) }
    }

    fn error(&self) -> EmbreeError {
        EmbreeError::Reported(self.reported())
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        // SAFETY: no scene outlives it, and nothing uses the device hereafter.
        unsafe { (self.functions.rtcReleaseDevice)(self.device) }
    }
}

/// A tree of Embree's.
pub(crate) struct Scene<'a> {
    embree: &'a Embree,
    handle: Handle,
}

impl Scene<'_> {
    /// Whether the ray meets anything, told by what it meets first.
    #[inline(always)]
    pub(crate) fn closest(&self, ray: &Ray) -> bool {
        let hit =
            Meeting { normal: [0.0; 3], uv: [0.0; 2], primitive: NONE, geometry: NONE, instance: [NONE; 2] };
        let mut query = RayHit { ray: Segment::new(ray), hit };
        // SAFETY: the scene is committed, and the query aligned and as large as C's; no arguments stand for the defaults.
        unsafe { (self.embree.functions.rtcIntersect1)(self.handle, &raw mut query, std::ptr::null()) };
        query.hit.geometry != NONE
    }

    /// Whether the ray meets anything.
    #[inline(always)]
    pub(crate) fn occluded(&self, ray: &Ray) -> bool {
        let mut query = Segment::new(ray);
        // SAFETY: as for `closest`.
        unsafe { (self.embree.functions.rtcOccluded1)(self.handle, &raw mut query, std::ptr::null()) };
        query.far < 0.0
    }
}

impl Drop for Scene<'_> {
    fn drop(&mut self) {
        // SAFETY: the scene is alive and nothing uses it hereafter.
        unsafe { (self.embree.functions.rtcReleaseScene)(self.handle) }
    }
}
