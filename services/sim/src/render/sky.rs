//! The light on the water: a graded sky with a veiled sun, and how much of it the surface mirrors.

/// Radiance of the sky overhead, in units of a white sheet's on the water.
const ZENITH: f32 = 0.40;
/// Radiance of the sky at the horizon.
const HORIZON: f32 = 1.1;
/// Radiance that the haze about the sun adds at its centre. The disc itself is veiled: no glint that blinds a camera.
const HAZE: f32 = 2.6;
/// Direction of the sun (north, east, up), unit: 50° high in the south-west.
const SUN: [f32; 3] = [-0.4545, -0.4545, 0.7660];
/// Reflectance of water seen straight on, for a refractive index of 1.333.
const STRAIGHT_ON: f32 = 0.0204;

/// Radiance of the sky in a direction (north, east, up), unit length.
#[inline]
pub(super) fn radiance(direction: [f32; 3]) -> f32 {
    let low = (1.0 - direction[2]).clamp(0.0, 1.0);
    let toward_sun = (direction[0] * SUN[0] + direction[1] * SUN[1] + direction[2] * SUN[2]).max(0.0);
    let squared = toward_sun * toward_sun;
    let eighth = squared * squared * squared * squared;
    ZENITH + (HORIZON - ZENITH) * low + HAZE * eighth
}

/// Share of the light that water mirrors at an angle of incidence with this cosine (Schlick, 1994).
#[inline]
pub(super) fn reflectance(cos_incidence: f32) -> f32 {
    let grazing = 1.0 - cos_incidence;
    let squared = grazing * grazing;
    STRAIGHT_ON + (1.0 - STRAIGHT_ON) * squared * squared * grazing
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fresnel's equations in full, unpolarised light.
    fn fresnel(cos_i: f64) -> f64 {
        let sin_t = (1.0 - cos_i * cos_i).sqrt() / 1.333;
        let cos_t = (1.0 - sin_t * sin_t).sqrt();
        let s = (cos_i - 1.333 * cos_t) / (cos_i + 1.333 * cos_t);
        let p = (cos_t - 1.333 * cos_i) / (cos_t + 1.333 * cos_i);
        0.5 * (s * s + p * p)
    }

    #[test]
    fn it_mirrors_as_fresnel_says() {
        for degrees in [0.0_f64, 10.0, 30.0, 45.0, 60.0, 75.0, 85.0] {
            let cos = degrees.to_radians().cos();
            let error = f64::from(reflectance(cos as f32)) - fresnel(cos);
            // Schlick's approximation for water is up to 0.06 off near grazing.
            assert!(error.abs() < 0.002 + 0.065 * (1.0 - cos), "{degrees}: {error}");
        }
    }
}
