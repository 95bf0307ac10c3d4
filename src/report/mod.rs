//! One self-contained HTML file for any result: an answer on top, pictures first, tables that sort and copy, 3-D views that turn.

mod provenance;

pub use provenance::Provenance;
