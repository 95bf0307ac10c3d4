//! The laws of light as pure functions: reflection, refraction, Fresnel, media, coatings, scatter, spectra.
