//! Other people's file formats and the facet, ray and result files Data_1 to Data_3, as plain structs, read and written.
