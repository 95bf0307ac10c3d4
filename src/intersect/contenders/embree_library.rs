//! Embree 4 as a library that the user names, opened on request and never linked.

use libloading::{Library, Symbol};
use std::ffi::{c_char, c_int, c_uint, c_void};
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};
use std::ptr::null_mut;
use std::sync::Arc;
use std::sync::atomic::{AtomicIsize, Ordering};

/// Why a library cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum EmbreeError {
    /// The file is no library of this platform, or lacks what Embree has.
    #[error("{path} cannot be used as Embree: {source}")]
    Library {
        /// What was given.
        path: PathBuf,
        /// What the system says.
        source: libloading::Error,
    },
    /// Embree gave no memory for a mesh.
    #[error("Embree has no memory for a mesh of {primitives} facets")]
    Memory {
        /// Triangles or quads of the mesh.
        primitives: usize,
    },
    /// Embree 3 and others take other arguments.
    #[error("{path} is Embree {major}; version 4 is needed")]
    Version {
        /// What was given.
        path: PathBuf,
        /// The major version that it says it is.
        major: isize,
    },
    /// Embree gave no device, as on a processor without SSE2.
    #[error("Embree at {path} gives no device")]
    Device {
        /// What was given.
        path: PathBuf,
    },
}

/// An opaque handle of Embree.
pub(super) type Handle = *mut c_void;

/// `RTCRayHit` with room behind it: what follows the fields of `RTCHit` depends on how Embree was built.
#[repr(C, align(16))]
#[derive(Clone, Copy, Default)]
pub(super) struct RayHit {
    pub(super) origin: [f32; 3],
    pub(super) t_near: f32,
    pub(super) direction: [f32; 3],
    pub(super) time: f32,
    pub(super) t_far: f32,
    pub(super) mask: u32,
    pub(super) id: u32,
    pub(super) flags: u32,
    pub(super) normal: [f32; 3],
    pub(super) u: f32,
    pub(super) v: f32,
    pub(super) primitive: u32,
    pub(super) geometry: u32,
    pub(super) instances: [u32; 5],
}

type NewDevice = unsafe extern "C" fn(*const c_char) -> Handle;
type DeviceProperty = unsafe extern "C" fn(Handle, c_int) -> isize;
type MemoryMonitor = extern "C" fn(Handle, isize, bool) -> bool;
type SetMemoryMonitor = unsafe extern "C" fn(Handle, MemoryMonitor, Handle);
type NewObject = unsafe extern "C" fn(Handle) -> Handle;
type NewGeometry = unsafe extern "C" fn(Handle, c_int) -> Handle;
type SetNumber = unsafe extern "C" fn(Handle, c_int);
type NewBuffer = unsafe extern "C" fn(Handle, c_int, c_uint, c_int, usize, usize) -> Handle;
type Act = unsafe extern "C" fn(Handle);
type Attach = unsafe extern "C" fn(Handle, Handle) -> c_uint;
type Intersect1 = unsafe extern "C" fn(Handle, *mut RayHit, Handle);

/// `RTC_DEVICE_PROPERTY_VERSION`, which is 10,000 times the major version and more.
const VERSION_PROPERTY: c_int = 0;
/// `RTC_SCENE_FLAG_ROBUST`: without it rays through edges are lost, with which nobody could compare.
const ROBUST: c_int = 1 << 2;
/// `RTC_BUILD_QUALITY_HIGH`.
const HIGH_QUALITY: c_int = 2;

/// An open library with a device of its own.
pub struct EmbreeLibrary {
    device: Handle,
    release_device: Act,
    pub(super) intersect: Intersect1,
    /// Bytes that Embree holds; the box stays at the address that was passed to Embree.
    held: Box<AtomicIsize>,
    /// Never closed: Embree's worker threads run in it until the process ends.
    library: ManuallyDrop<Library>,
}

// SAFETY: Embree's devices and committed scenes may be used by any thread (its manual, "Thread safety"); the functions are plain
// addresses in a library that is kept open, and the count of bytes is atomic.
#[allow(unsafe_code)]
unsafe impl Send for EmbreeLibrary {}
#[allow(unsafe_code)]
unsafe impl Sync for EmbreeLibrary {}

/// Adds the bytes that Embree takes, or gives back where negative, to the counter that `held` points at; `true` lets it go on.
extern "C" fn count_bytes(held: Handle, bytes: isize, _after: bool) -> bool {
    // SAFETY: the pointer is that of `EmbreeLibrary::held`, which outlives the device that calls.
    #[allow(unsafe_code)]
    let held = unsafe { &*held.cast::<AtomicIsize>() };
    held.fetch_add(bytes, Ordering::Relaxed);
    true
}

impl EmbreeLibrary {
    /// Opens a library such as `libembree4.so.4`.
    ///
    /// The library's code runs in this process with all its rights: it is the user's to trust what he names.
    ///
    /// # Errors
    /// When the file cannot be loaded or lacks a function, gives no device, or is not version 4.
    pub fn open(path: &Path) -> Result<Arc<Self>, EmbreeError> {
        let unusable = |source| EmbreeError::Library { path: path.into(), source };
        // SAFETY: the names and arguments are those of Embree's C interface, `rtcore_device.h` of version 4; whether a file that bears
        // them is Embree is for the user to know. The version is queried before any function whose arguments depend on it.
        #[allow(unsafe_code)]
        unsafe {
            let library = Library::new(path).map_err(unusable)?;
            let new_device: Symbol<NewDevice> = library.get(b"rtcNewDevice\0").map_err(unusable)?;
            let property: Symbol<DeviceProperty> = library.get(b"rtcGetDeviceProperty\0").map_err(unusable)?;
            let release_device: Act = *library.get(b"rtcReleaseDevice\0").map_err(unusable)?;
            let intersect: Intersect1 = *library.get(b"rtcIntersect1\0").map_err(unusable)?;
            let monitor: Symbol<SetMemoryMonitor> =
                library.get(b"rtcSetDeviceMemoryMonitorFunction\0").map_err(unusable)?;
            let device = new_device(c"".as_ptr());
            if device.is_null() {
                return Err(EmbreeError::Device { path: path.into() });
            }
            let major = property(device, VERSION_PROPERTY) / 10_000;
            if major != 4 {
                release_device(device);
                return Err(EmbreeError::Version { path: path.into(), major });
            }
            let held = Box::new(AtomicIsize::new(0));
            monitor(device, count_bytes, std::ptr::from_ref(&*held).cast_mut().cast());
            Ok(Arc::new(Self { device, release_device, intersect, held, library: ManuallyDrop::new(library) }))
        }
    }

    /// Bytes that Embree holds for all scenes of this library.
    pub(super) fn held_bytes(&self) -> usize {
        self.held.load(Ordering::Relaxed).max(0) as usize
    }

    /// Builds and commits a scene of one mesh: `size` indices a primitive, 3 or 4, all below the number of positions. `path` is for
    /// messages. Fails where the library lacks a function or gives no memory.
    pub(super) fn new_scene(
        self: &Arc<Self>,
        path: &Path,
        positions: &[[f32; 3]],
        indices: &[u32],
        size: usize,
    ) -> Result<Scene, EmbreeError> {
        let unusable = |source| EmbreeError::Library { path: path.into(), source };
        let (kind, format) = if size == 3 { (TRIANGLES, UINT3) } else { (QUADS, UINT4) };
        // SAFETY: arguments as in `rtcore_scene.h` and `rtcore_geometry.h` of version 4. Both buffers are Embree's own, of the length
        // requested, and filled before the commit; all indices are below the number of positions.
        #[allow(unsafe_code)]
        unsafe {
            let new_scene: Symbol<NewObject> = self.library.get(b"rtcNewScene\0").map_err(unusable)?;
            let scene_flags: Symbol<SetNumber> = self.library.get(b"rtcSetSceneFlags\0").map_err(unusable)?;
            let scene_quality: Symbol<SetNumber> =
                self.library.get(b"rtcSetSceneBuildQuality\0").map_err(unusable)?;
            let new_geometry: Symbol<NewGeometry> = self.library.get(b"rtcNewGeometry\0").map_err(unusable)?;
            let new_buffer: Symbol<NewBuffer> = self.library.get(b"rtcSetNewGeometryBuffer\0").map_err(unusable)?;
            let commit_geometry: Symbol<Act> = self.library.get(b"rtcCommitGeometry\0").map_err(unusable)?;
            let attach: Symbol<Attach> = self.library.get(b"rtcAttachGeometry\0").map_err(unusable)?;
            let release_geometry: Symbol<Act> = self.library.get(b"rtcReleaseGeometry\0").map_err(unusable)?;
            let commit_scene: Symbol<Act> = self.library.get(b"rtcCommitScene\0").map_err(unusable)?;
            let release: Act = *self.library.get(b"rtcReleaseScene\0").map_err(unusable)?;
            let handle = new_scene(self.device);
            let primitives = indices.len() / size;
            if handle.is_null() {
                return Err(EmbreeError::Memory { primitives });
            }
            // From here on a failure gives the scene back.
            let scene = Scene { handle, release, library: self.clone() };
            scene_flags(handle, ROBUST);
            scene_quality(handle, HIGH_QUALITY);
            let geometry = new_geometry(self.device, kind);
            let vertices = new_buffer(geometry, VERTEX_BUFFER, 0, FLOAT3, 12, positions.len()).cast::<[f32; 3]>();
            let corners = new_buffer(geometry, INDEX_BUFFER, 0, format, 4 * size, primitives).cast::<u32>();
            let has_memory = !vertices.is_null() && !corners.is_null();
            if has_memory {
                vertices.copy_from_nonoverlapping(positions.as_ptr(), positions.len());
                corners.copy_from_nonoverlapping(indices.as_ptr(), indices.len());
                commit_geometry(geometry);
                attach(scene.handle, geometry);
            }
            release_geometry(geometry);
            // Without its facets the scene would answer every ray with a miss, and at a splendid rate.
            if primitives > 0 && !has_memory {
                return Err(EmbreeError::Memory { primitives });
            }
            commit_scene(scene.handle);
            Ok(scene)
        }
    }
}

/// `RTC_GEOMETRY_TYPE_TRIANGLE`, `_QUAD`.
const TRIANGLES: c_int = 0;
const QUADS: c_int = 1;
/// `RTC_BUFFER_TYPE_INDEX`, `_VERTEX`.
const INDEX_BUFFER: c_int = 0;
const VERTEX_BUFFER: c_int = 1;
/// `RTC_FORMAT_UINT3`, `_UINT4`, `_FLOAT3`.
const UINT3: c_int = 0x5003;
const UINT4: c_int = 0x5004;
const FLOAT3: c_int = 0x9003;

impl Drop for EmbreeLibrary {
    fn drop(&mut self) {
        // SAFETY: the device is this value's own, and the library stays open.
        #[allow(unsafe_code)]
        unsafe {
            (self.release_device)(self.device);
        }
    }
}

/// A committed scene.
pub(super) struct Scene {
    handle: Handle,
    release: Act,
    pub(super) library: Arc<EmbreeLibrary>,
}

// SAFETY: as for the library; a committed scene is only read.
#[allow(unsafe_code)]
unsafe impl Send for Scene {}
#[allow(unsafe_code)]
unsafe impl Sync for Scene {}

impl Scene {
    /// Overwrites `t_far`, weights and ids of the record with the nearest hit of its ray; on a miss leaves them as they are.
    pub(super) fn intersect(&self, ray: &mut RayHit) {
        // SAFETY: the record is aligned and larger than `RTCRayHit`; no arguments, which the null pointer says, are the default ones.
        #[allow(unsafe_code)]
        unsafe {
            (self.library.intersect)(self.handle, ray, null_mut());
        }
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: the scene is this value's own, and its library stays open.
        #[allow(unsafe_code)]
        unsafe {
            (self.release)(self.handle);
        }
    }
}
