//! The one `match` from what a scene calls for to a kernel.

use super::bind::BoundScene;
use super::effects::{KernelKind, Required};
use super::kernel::{self, Context, RaySelection, payload};
use super::settings::{KernelChoice, RunSettings};
use super::tallies::ReplicateTally;
use crate::intersect::Cost;

/// Name of the kernel that a run with these settings uses; runs of one kernel are the same code.
pub fn kernel_name(bound: &BoundScene, settings: &RunSettings) -> &'static str {
    kernel_kind(bound, settings).name()
}

/// The kernel that a run takes: what the scene needs, or more where the settings ask for more.
pub(crate) fn kernel_kind(bound: &BoundScene, settings: &RunSettings) -> KernelKind {
    let required = Required::new(bound).kernel;
    match settings.kernel {
        // The pruned kernel is enough; a larger one must give the same bits, which is what the other choices are
        // for.
        KernelChoice::Pruned => required,
        KernelChoice::With(effects) => required.max(KernelKind::for_effects(effects)),
        KernelChoice::Full => KernelKind::Full,
    }
}

/// Traces rays with a kernel and adds them to a tally. Returns the intersector's work.
pub(super) fn trace(
    kind: KernelKind,
    context: &Context<'_>,
    rays: RaySelection,
    tally: &mut ReplicateTally,
) -> Cost {
    use payload::{Clear, Coloured, EndsOnly, Full, Mirror, Nested, Opaque};
    match kind {
        // The smaller kernels have a variant that asks nothing on the way: the plain scenes that they serve gain
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
