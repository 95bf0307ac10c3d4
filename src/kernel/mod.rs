//! The only door to the truck kernel: its shapes become a [`crate::model::Model`].
