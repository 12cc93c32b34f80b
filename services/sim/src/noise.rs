//! Seeds and the one noise process that everything here is made of.

use nalgebra::Vector3;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::StandardNormal;

/// A generator of its own for one purpose of one vehicle, so that adding a vehicle or a sensor changes no other's noise.
///
/// FNV-1a over the names, mixed with the seed: stable across platforms and compiler versions, unlike the standard hasher.
#[must_use]
pub fn generator(seed: u64, vehicle: &str, purpose: &str) -> ChaCha8Rng {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64 ^ seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    for byte in vehicle.bytes().chain([b'/']).chain(purpose.bytes()) {
        hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
    }
    ChaCha8Rng::seed_from_u64(hash)
}

/// One standard normal number.
pub(crate) fn normal(random: &mut ChaCha8Rng) -> f64 {
    random.sample(StandardNormal)
}

/// Three independent standard normal numbers.
pub(crate) fn normal3(random: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::new(normal(random), normal(random), normal(random))
}

/// A first-order Gauss-Markov process of unit variance on three axes: autocorrelation exp(−|τ| / T).
///
/// Stepped with the exact discrete form, so that its statistics depend on neither the step nor its regularity.
#[derive(Debug, Clone)]
pub struct GaussMarkov {
    correlation_s: f64,
    value: Vector3<f64>,
}

impl GaussMarkov {
    /// Started from its stationary distribution.
    #[must_use]
    pub fn new(correlation_s: f64, random: &mut ChaCha8Rng) -> Self {
        Self { correlation_s, value: normal3(random) }
    }

    /// Advances by `dt_s` and returns the new value.
    pub fn step(&mut self, dt_s: f64, random: &mut ChaCha8Rng) -> Vector3<f64> {
        let keep = (-dt_s / self.correlation_s).exp();
        self.value = self.value * keep + normal3(random) * (1.0 - keep * keep).sqrt();
        self.value
    }

    /// The present value.
    #[must_use]
    pub fn value(&self) -> Vector3<f64> {
        self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Unit variance and exp(−τ/T) by definition of the process, whatever the step.
    #[test]
    fn variance_is_one_and_the_autocorrelation_is_exponential() {
        let mut random = generator(3, "test", "noise");
        let mut process = GaussMarkov::new(2.0, &mut random);
        let samples: Vec<f64> = (0..400_000).map(|_| process.step(0.1, &mut random).x).collect();
        let mean_of =
            |lag: usize| samples.iter().zip(&samples[lag..]).map(|(a, b)| a * b).sum::<f64>() / (samples.len() - lag) as f64;
        // 40 000 s hold 10 000 independent pairs of correlation times: 1 % standard error, so 4 % is four of them.
        for lag in [0, 10, 20, 40] {
            let expected = (-(lag as f64) * 0.1 / 2.0).exp();
            assert!((mean_of(lag) - expected).abs() < 0.04, "lag {lag}: {} against {expected}", mean_of(lag));
        }
    }

    #[test]
    fn every_purpose_of_every_vehicle_has_its_own_noise() {
        let first = |seed, vehicle, purpose| normal(&mut generator(seed, vehicle, purpose)).to_bits();
        let all = [first(1, "a", "x"), first(1, "a", "y"), first(1, "b", "x"), first(2, "a", "x")];
        for (index, value) in all.iter().enumerate() {
            assert!(!all[..index].contains(value));
        }
        assert_eq!(first(1, "a", "x"), all[0]);
    }
}
