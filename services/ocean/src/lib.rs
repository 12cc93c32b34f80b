//! Wave theory and wave statistics: dispersion, spectra, zero crossings
