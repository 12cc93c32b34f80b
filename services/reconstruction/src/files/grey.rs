//! Decoded grey pictures of 8 to 16 bits, and the rule by which 16 become 8.
//!
//! Matching compares grey levels, so both pictures of a pair must be scaled by one rule. What counts as white is, in this order:
//! what the file says (PGM does), 255 for 8-bit samples, and for 16-bit ones the largest number of as many bits as the
//! brightest sample of the pair needs, at least 8: many machine-vision cameras put 10, 12 or 14 bits into 16, and PNG cannot say so.

use halcyon_model::Image;
use halcyon_model::stereo::ImageError;

/// Grey levels as the file has them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Samples {
    /// Of 8 bits.
    Eight(Vec<u8>),
    /// Of more.
    Sixteen(Vec<u16>),
}

/// A decoded grey picture, row-major.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Grey {
    /// Width, pixels.
    pub width_px: u32,
    /// Height, pixels.
    pub height_px: u32,
    /// `height_px × width_px` samples.
    pub samples: Samples,
    /// The sample that stands for white, where the file says.
    pub(super) white: Option<u16>,
}

impl Grey {
    /// The sample that stands for white.
    #[must_use]
    pub fn white(&self) -> u16 {
        match (&self.samples, self.white) {
            (_, Some(white)) => white,
            (Samples::Eight(_), None) => 255,
            (Samples::Sixteen(samples), None) => {
                let brightest = samples.iter().copied().max().unwrap_or(0);
                u16::MAX >> brightest.leading_zeros().min(8)
            }
        }
    }

    /// Scaled so that `white` becomes 255; brighter samples do as well.
    ///
    /// # Errors
    /// [`ImageError`] where the sides are out of range.
    pub fn into_image(self, white: u16) -> Result<Image, ImageError> {
        let white = u32::from(white.max(1));
        let scale = |sample: u32| ((sample * 255 + white / 2) / white).min(255) as u8;
        let pixels = match self.samples {
            Samples::Eight(samples) if white == 255 => samples,
            Samples::Eight(samples) => samples.into_iter().map(|sample| scale(sample.into())).collect(),
            Samples::Sixteen(samples) => samples.into_iter().map(|sample| scale(sample.into())).collect(),
        };
        Image::new(self.width_px, self.height_px, pixels.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sixteen(samples: &[u16], white: Option<u16>) -> Grey {
        Grey { width_px: samples.len() as u32, height_px: 1, samples: Samples::Sixteen(samples.to_vec()), white }
    }

    #[test]
    fn white_is_what_the_brightest_sample_needs() {
        for (brightest, white) in [(0, 255), (200, 255), (256, 511), (1023, 1023), (4000, 4095), (4096, 8191), (65535, 65535)] {
            assert_eq!(sixteen(&[0, brightest], None).white(), white);
        }
        assert_eq!(sixteen(&[0, 100], Some(4095)).white(), 4095);
    }

    #[test]
    fn full_scale_is_divided_by_257() {
        let image = sixteen(&[0, 257, 257 * 100, 65535], None).into_image(65535).unwrap();
        assert_eq!(image.pixels()[..], [0, 1, 100, 255]);
        let image = sixteen(&[0, 2048, 4095, 5000], None).into_image(4095).unwrap();
        assert_eq!(image.pixels()[..], [0, 128, 255, 255]);
    }
}
