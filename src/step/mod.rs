//! Part 21 text to entities to [`crate::model::Model`], with an account of every face.
