//! Cross-check of intersectors, and what accuracy costs.
