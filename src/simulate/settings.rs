//! Settings of a simulation.

use super::scene::{Interfaces, Run, Sampling};
use crate::optics::Effects;

/// Rays in one wavefront: enough for the intersector to interleave, few enough that rays, paths and hits stay in the second cache.
const WAVEFRONT: usize = 1024;

/// What a simulation is run with: the scene's own settings, which the command may override, and how to spread the work.
///
/// ```
/// use lampyris::intersect::octree::{self, Octree};
/// use lampyris::simulate::{RunSettings, Scene, simulate};
/// use lampyris::{FacetMesh, Model};
///
/// let text = "source = [{ kind = 'point' }]\nreceiver = [{ name = 'ball', kind = 'sphere', radius = 10 }]";
/// let scene = Scene::parse(text, "scene.toml", ".".as_ref())?.bind(&Model::default())?;
/// let mesh = FacetMesh::default();
/// let nothing = Octree::build(&mesh, &octree::Settings::default());
/// let run = |threads| {
///     let settings = RunSettings { rays: 10_000, threads, ..RunSettings::default() };
///     simulate(&scene, &nothing, &settings, &|_| true)
/// };
/// // All light reaches the sphere around its source, and the result is the same bits for any number of threads.
/// let (one, two) = (run(1), run(2));
/// assert_eq!(one.power.received, one.power.emitted);
/// assert_eq!(one.digest, two.digest);
/// # Ok::<(), lampyris::simulate::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct RunSettings {
    /// Number of rays that leave the sources.
    pub rays: u64,
    /// The first ray to trace of a run that grows, for a tally that joins those of the rays before it; rounded up to a whole replicate.
    pub first_ray: u64,
    /// Whether the run is divided into replicates of a fixed size, so that further rays may follow. Without, that is so where the rays
    /// are many and a round number.
    pub grows: bool,
    /// Seed of all random numbers.
    pub seed: u64,
    /// How sources are sampled.
    pub sampling: Sampling,
    /// What happens at a partly reflecting interface.
    pub interfaces: Interfaces,
    /// Below this share of its first power a ray is no longer split.
    pub split_floor: f64,
    /// Hits after which a path is cut off.
    pub max_bounces: u32,
    /// Length after which a path is cut off, mm.
    pub max_length_mm: f64,
    /// Share of its first power below which a path is cut off.
    pub power_floor: f64,
    /// Independent parts the run is divided into.
    pub replicates: u32,
    /// Threads; 0 for as many as the machine has. Changes no bit of a result.
    pub threads: usize,
    /// Rays in one wavefront. Changes no bit of a result.
    pub batch: usize,
    /// About how many paths to record; 0 for none.
    pub path_samples: u64,
    /// Whether light is grouped by the faces it met; each ray is then traced twice. Changes no bit of a digest.
    pub sequences: bool,
    /// Which kernel to use: the smallest that the scene needs, or the one that can do everything. Changes no bit of a result.
    pub kernel: KernelChoice,
    /// Which part of the replicates to run: the `i`-th of `n`, from 0.
    pub shard: [u32; 2],
}

/// Which kernel to use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KernelChoice {
    /// The smallest that the scene needs.
    #[default]
    Pruned,
    /// The smallest that the scene needs and that could do these effects too.
    With(Effects),
    /// The one that can do everything.
    Full,
}

/// Returns the threads that this machine has; one where it does not report them.
pub(crate) fn machine_threads() -> usize {
    std::thread::available_parallelism().map_or(1, |n| n.get())
}

impl RunSettings {
    /// Returns the threads that are asked for; for 0, as many as the machine has.
    pub(super) fn thread_count(&self) -> usize {
        match self.threads {
            0 => machine_threads(),
            n => n,
        }
    }
}

impl From<&Run> for RunSettings {
    fn from(r: &Run) -> Self {
        Self {
            rays: r.rays,
            first_ray: 0,
            grows: false,
            seed: r.seed,
            sampling: r.sampling,
            interfaces: r.interfaces,
            split_floor: r.split_floor,
            max_bounces: r.max_bounces,
            max_length_mm: r.max_length_mm,
            power_floor: r.power_floor,
            replicates: r.replicates,
            threads: 0,
            batch: WAVEFRONT,
            path_samples: 0,
            sequences: r.sequences > 0,
            kernel: KernelChoice::Pruned,
            shard: [0, 1],
        }
    }
}

impl Default for RunSettings {
    fn default() -> Self {
        Self::from(&Run::default())
    }
}
