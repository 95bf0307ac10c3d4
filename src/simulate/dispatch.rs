//! The one `match` from what a scene calls for to a kernel.

use super::bind::BoundScene;
use super::effects::{KernelKind, RequiredEffects};
use super::kernel::{self, Context, RaySelection, payload};
use super::settings::{KernelChoice, RunSettings};
use super::tallies::ReplicateTally;
use crate::intersect::Cost;

/// Returns the name of the kernel that a run with these settings uses, from "mirror" to "full". Of one scene, for settings that differ in
/// `kernel` alone, the same name is the same code; else the smaller kernels have a variant for runs that need only the ends of rays.
pub fn kernel_name(bound: &BoundScene, settings: &RunSettings) -> &'static str {
    kernel_kind(bound, settings).name()
}

/// Returns the kernel that a run takes: the smallest that the scene needs, or a larger one where the settings ask for it.
pub(crate) fn kernel_kind(bound: &BoundScene, settings: &RunSettings) -> KernelKind {
    let required = RequiredEffects::new(bound).kernel;
    match settings.kernel {
        // The pruned kernel is enough; a larger one must give the same bits, which is what the other choices are
        // for.
        KernelChoice::Pruned => required,
        KernelChoice::With(effects) => required.max(KernelKind::for_effects(effects)),
        KernelChoice::Full => KernelKind::Full,
    }
}

/// Traces the selected rays with a kernel, adds what becomes of them to `tally`, and returns the intersector's work.
pub(super) fn trace(
    kind: KernelKind,
    context: &Context<'_>,
    rays: RaySelection,
    tally: &mut ReplicateTally,
) -> Cost {
    use payload::{Clear, Coloured, EndsOnly, Full, Mirror, Nested, Opaque};
    match kind {
        // The smaller kernels have a variant that checks nothing on the way: the plain scenes that they serve gain
        // most by it.
        KernelKind::Mirror if context.asks_ends_only() => kernel::trace::<EndsOnly<Mirror>>(context, rays, tally),
        KernelKind::Mirror => kernel::trace::<Mirror>(context, rays, tally),
        KernelKind::Opaque if context.asks_ends_only() => kernel::trace::<EndsOnly<Opaque>>(context, rays, tally),
        KernelKind::Opaque => kernel::trace::<Opaque>(context, rays, tally),
        KernelKind::Clear if context.asks_ends_only() => kernel::trace::<EndsOnly<Clear>>(context, rays, tally),
        KernelKind::Clear => kernel::trace::<Clear>(context, rays, tally),
        KernelKind::Nested => kernel::trace::<Nested>(context, rays, tally),
        KernelKind::Coloured => kernel::trace::<Coloured>(context, rays, tally),
        KernelKind::Full => kernel::trace::<Full>(context, rays, tally),
    }
}
