//! HTML, plots and tables of any result.
