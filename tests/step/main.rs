//! Reading STEP files and the splines they hold, judged by quadrature and by figures of other programs.

mod accounts;
mod arcs;
mod assemblies;
mod bounded_curves;
mod corpus;
mod eights;
mod faces;
#[path = "../support/files.rs"]
mod files;
mod fixtures;
mod joints;
mod near_places;
mod nurbs_properties;
mod occurrences;
mod offsets;
mod orphans;
mod parameters;
mod perforated;
mod pictures;
mod products;
mod rare_forms;
mod recipes;
mod repeated_faces;
mod revolved_conics;
mod rims;
mod seams;
mod shell_pieces;
mod shells;
mod silence;
mod subassemblies;
mod support;
