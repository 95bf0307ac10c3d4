//! Text for people: numbers with as many digits as mean something, and the name that was probably meant.

mod nearest_name;
mod number;
mod sentence_list;

pub(crate) use nearest_name::{did_you_mean, nearest_name, nearest_or_listed};
#[cfg(feature = "report")]
pub(crate) use number::NARROW_SPACE;
pub use number::{count_of, figures, grouped};
pub(crate) use sentence_list::first_sentences;
