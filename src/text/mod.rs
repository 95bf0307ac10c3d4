//! Text for people: numbers with their significant digits, suggestions for misspelled names, ordered lists.

#[cfg(feature = "cli")]
mod natural_order;
mod nearest_name;
mod number;
mod sentence_list;
#[cfg(feature = "report")]
mod unbroken;

#[cfg(feature = "cli")]
pub(crate) use natural_order::natural_order;
pub(crate) use nearest_name::{did_you_mean, nearest_name, nearest_or_listed};
#[cfg(feature = "report")]
pub(crate) use number::NARROW_SPACE;
pub(crate) use number::typed_number;
pub use number::{count_of, figures, grouped};
pub(crate) use sentence_list::first_sentences;
#[cfg(feature = "cli")]
pub(crate) use unbroken::belong_together;
#[cfg(feature = "report")]
pub(crate) use unbroken::unbroken;
