//! What commands share: from options and files to facets, intersectors and runs.

pub(super) mod aim;
pub(super) mod engine;
pub(super) mod job;
pub(super) mod ledger;
pub(super) mod load;
pub(super) mod pairs;
pub(super) mod paths;
pub(super) mod until;
pub(super) mod witness;
