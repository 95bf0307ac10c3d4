//! Hands in what proofs have taken, and ends them on a face that has taken too much.

use super::prover::Prover;

impl Drop for Prover<'_, '_> {
    /// Hands in the steps not yet counted; their sum does not depend on how many provers there were.
    fn drop(&mut self) {
        self.gives_up();
    }
}

impl Prover<'_, '_> {
    /// Hands in the steps taken so far; whether the face has taken more than any may, so that nothing more is to be proved of it.
    pub(in crate::tessellate) fn gives_up(&mut self) -> bool {
        self.surface.steps.add(std::mem::take(&mut self.nets.steps));
        self.surface.steps.are_too_many()
    }
}
