//! Colours: linear in glTF (section 3.7.2.1 of the specification), sRGB in images and in every other format (IEC
//! 61966-2-1).

/// The byte of sRGB that stands for a linear component.
pub(super) fn srgb_byte(linear: f64) -> u8 {
    let x = linear.clamp(0.0, 1.0);
    let encoded = if x <= 0.0031308 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (255.0 * encoded).round() as u8
}

/// The linear component that a byte of sRGB stands for, from 0 to 1.
pub(super) fn linear(srgb: u8) -> f64 {
    let x = f64::from(srgb) / 255.0;
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

/// Whether eight bits hold the linear component so well that the same byte of sRGB comes back.
pub(super) fn fits_a_byte(srgb: u8) -> bool {
    srgb_byte((255.0 * linear(srgb)).round() / 255.0) == srgb
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_comes_back_from_sixteen_bits() {
        for byte in 0..=255 {
            let sixteen = (65535.0 * linear(byte)).round() / 65535.0;
            assert_eq!(srgb_byte(sixteen), byte);
        }
        assert_eq!(
            [0, 64, 128, 200, 255].map(|b| (255.0 * linear(b)).round()),
            [0.0, 13.0, 55.0, 147.0, 255.0]
        );
        assert!(fits_a_byte(128) && !fits_a_byte(10));
        assert_eq!(srgb_byte(f64::NAN), 0);
    }
}
