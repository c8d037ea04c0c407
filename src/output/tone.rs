//! Tone curves: linear colours to the 8-bit sRGB codes of PNG, sheet and report.
//!
//! Exposure comes first: a colour is multiplied by 2^`exposure`. The curve then maps it to [0, 1], the result is encoded and
//! rounded to the nearest code. Light cannot be negative, so a negative channel counts as 0. A pixel with a NaN or infinite
//! channel is shown in [`NOT_FINITE`], so that it is seen and not taken for black or white.

use rayon::prelude::*;

use crate::color::{Rgb, srgb_from_linear};
use crate::scene::texture::Encoding;
use crate::settings::{Display, ToneCurve};

/// The code of a pixel that is NaN or infinite: magenta, which no curve gives to a grey.
pub const NOT_FINITE: [u8; 3] = [255, 0, 255];

/// Pixels that one task maps.
const CHUNK: usize = 16_384;

/// The 8-bit code of one linear colour. An exposure that is not finite makes every colour [`NOT_FINITE`].
pub fn tone_map(color: Rgb, display: &Display) -> [u8; 3] {
    Mapping::new(display).apply(color)
}

/// The 8-bit codes of a whole picture, R, G, B for each pixel in the planes' order; as many pixels as the shortest plane has.
pub fn to_srgb8(rgb: [&[f32]; 3], display: &Display) -> Vec<u8> {
    let [r, g, b] = rgb;
    let pixels = r.len().min(g.len()).min(b.len());
    let mapping = Mapping::new(display);
    let mut codes = vec![0; 3 * pixels];
    codes.par_chunks_mut(3 * CHUNK).enumerate().for_each(|(chunk, codes)| {
        for (i, code) in (chunk * CHUNK..).zip(codes.chunks_exact_mut(3)) {
            code.copy_from_slice(&mapping.apply(Rgb::new(r[i], g[i], b[i])));
        }
    });
    codes
}

/// The 8-bit codes that Aris' `render.py` gives a picture: clipped, encoded as sRGB or left as they are, times 255, truncated. White
/// encodes to just below 1, in single as in double precision, and becomes 254.
pub fn truncated_to_8_bits(rgb: [&[f32]; 3], encoding: Encoding) -> Vec<u8> {
    let code = |value: f32| {
        let clipped = value.clamp(0.0, 1.0);
        let encoded = match encoding {
            Encoding::Srgb => srgb_from_linear(clipped),
            Encoding::Linear => clipped,
        };
        (encoded * 255.0) as u8
    };
    let [r, g, b] = rgb;
    r.iter().zip(g).zip(b).flat_map(|((&r, &g), &b)| [r, g, b].map(code)).collect()
}

/// A [`Display`] with its exposure as a factor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mapping {
    tone: ToneCurve,
    gain: f32,
}

impl Mapping {
    /// What `display` says.
    pub(crate) fn new(display: &Display) -> Self {
        Self { tone: display.tone, gain: libm::exp2f(display.exposure) }
    }

    /// The code of a colour.
    pub(crate) fn apply(&self, color: Rgb) -> [u8; 3] {
        if !color.is_finite() || !self.gain.is_finite() {
            return NOT_FINITE;
        }
        // A finite colour stays finite: what the gain would carry past the largest float is as white as that.
        let exposed = color.map(|c| (c * self.gain).clamp(0.0, f32::MAX));
        let encoded = match self.tone {
            ToneCurve::Srgb => exposed.map(srgb_from_linear),
            ToneCurve::Neutral => neutral(exposed).map(srgb_from_linear),
            ToneCurve::Agx => agx(exposed),
        };
        encoded.map(|e| (255.0 * e).round()).to_array().map(|code| code as u8)
    }
}

/// The Khronos PBR Neutral tone mapper, linear in and linear out (Khronos, *PBR Neutral Specification*, 2024, with
/// F90 = 0.04, K_s = 0.8 - F90, K_d = 0.15).
///
/// The Fresnel reflection that a lit surface adds to its base colour is taken off again, so that a base colour under white
/// light is shown as it was picked; peaks above K_s are compressed towards 1 and lose saturation.
fn neutral(c: Rgb) -> Rgb {
    const F90: f32 = 0.04;
    const START: f32 = 0.8 - F90;
    const DESATURATION: f32 = 0.15;
    let x = c.r.min(c.g).min(c.b);
    let offset = if x <= 2.0 * F90 { x - x * x / (4.0 * F90) } else { F90 };
    let c = c.map(|v| v - offset);
    let peak = c.max_channel();
    if peak <= START {
        return c;
    }
    let room = 1.0 - START;
    let new_peak = 1.0 - room * room / (peak + 1.0 - 2.0 * START);
    let kept = 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    (c * (1.0 / peak) * new_peak).lerp(Rgb::grey(new_peak), 1.0 - kept)
}

/// AgX's matrix from Rec. 709 to its own, less saturated primaries, by rows (Wrensch 2023).
const INSET: [Rgb; 3] = [
    Rgb::new(0.842_479_06, 0.078_433_6, 0.079_223_745),
    Rgb::new(0.042_328_242, 0.878_468_64, 0.079_166_13),
    Rgb::new(0.042_375_655, 0.078_433_6, 0.879_143),
];
/// The inverse of [`INSET`] (Wrensch 2023).
const OUTSET: [Rgb; 3] = [
    Rgb::new(1.196_879, -0.098_020_88, -0.099_029_74),
    Rgb::new(-0.052_896_852, 1.151_903_1, -0.098_961_174),
    Rgb::new(-0.052_971_636, -0.098_043_45, 1.151_073_7),
];

/// AgX, base look: linear in, display-encoded out (for a display with exponent 2.2, as AgX means sRGB).
///
/// Troy Sobotka's AgX (OCIO configuration SB2383): the primaries are drawn in by a matrix, each channel goes through a sigmoid
/// of its logarithm between 10 stops below and 6.5 above middle grey, and the primaries are let out again. The matrices are
/// those of Benjamin Wrensch, *Minimal AgX Implementation* (2023), which are inverse to each other.
///
/// Deviation: Wrensch fits the sigmoid with a polynomial, up to 0.006 off and not monotone at its ends; here it is the curve
/// itself, [`agx_sigmoid`].
fn agx(c: Rgb) -> Rgb {
    // log2(0.18) - 10 and log2(0.18) + 6.5.
    const MIN_EV: f32 = -12.473_931;
    const MAX_EV: f32 = 4.026_069;
    let drawn_in = apply(&INSET, c);
    let formed = drawn_in.map(|v| {
        // The logarithm of 0 is -∞, which the clamp takes to the lower end.
        let ev = libm::log2f(v.min(f32::MAX)).clamp(MIN_EV, MAX_EV);
        agx_sigmoid((ev - MIN_EV) / (MAX_EV - MIN_EV))
    });
    apply(&OUTSET, formed).map(|v| v.clamp(0.0, 1.0))
}

/// AgX's contrast curve on [0, 1]: Jed Smith's tunable sigmoid with slope 2 at (20/33, ½), where middle grey lies, toe power 3
/// and shoulder power 13/4. It leads 0 to 0 and 1 to 1.
///
/// With t the distance from the pivot, s the slope and p the power: y = ½ + k·h(s·t/k), h(u) = u/(1 + u^p)^(1/p), and the
/// scales k such that the curve ends in the corners.
fn agx_sigmoid(x: f32) -> f32 {
    const PIVOT: f32 = 20.0 / 33.0;
    const SLOPE: f32 = 2.0;
    // ((s·a)^-p·((s·a/½)^p - 1))^(-1/p), a being the width of the part: 20/33 with p = 3, 13/33 with p = 13/4.
    const TOE: f32 = 0.512_277_4;
    const SHOULDER: f32 = 0.541_464_15;
    const SHOULDER_POWER: f32 = 3.25;
    let y = if x < PIVOT {
        let u = SLOPE * (PIVOT - x) / TOE;
        0.5 - TOE * u / libm::cbrtf(1.0 + u * u * u)
    } else {
        let u = SLOPE * (x - PIVOT) / SHOULDER;
        0.5 + SHOULDER * u / libm::powf(1.0 + libm::powf(u, SHOULDER_POWER), 1.0 / SHOULDER_POWER)
    };
    y.clamp(0.0, 1.0)
}

/// The product of a matrix, given by its rows, and a colour.
fn apply(rows: &[Rgb; 3], c: Rgb) -> Rgb {
    let [r, g, b] = rows.map(|row| row.r * c.r + row.g * c.g + row.b * c.b);
    Rgb::new(r, g, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TONES: [ToneCurve; 3] = [ToneCurve::Srgb, ToneCurve::Neutral, ToneCurve::Agx];

    fn shown(tone: ToneCurve, color: [f32; 3]) -> [u8; 3] {
        tone_map(color.into(), &Display { tone, exposure: 0.0 })
    }

    #[test]
    fn srgb_clips_and_encodes() {
        assert_eq!(shown(ToneCurve::Srgb, [0.18; 3]), [118; 3]);
        assert_eq!(shown(ToneCurve::Srgb, [0.0, 1.0, 7.0]), [0, 255, 255]);
        assert_eq!(shown(ToneCurve::Srgb, [-3.0, 0.214_041_14, 0.002]), [0, 128, 7]);
    }

    #[test]
    fn aris_codes_are_truncated() {
        let plane = [-1.0, 0.18, 0.5, 0.999, 2.0];
        let reds =
            |encoding| truncated_to_8_bits([&plane; 3], encoding).into_iter().step_by(3).collect::<Vec<_>>();
        assert_eq!(reds(Encoding::Srgb), [0, 117, 187, 254, 254]);
        assert_eq!(reds(Encoding::Linear), [0, 45, 127, 254, 255]);
    }

    #[test]
    fn neutral_has_the_values_of_the_specification() {
        // Computed in f64 from the specification's formulas.
        for (input, expected) in [
            ([0.0; 3], [0.0; 3]),
            ([0.04; 3], [0.01; 3]),
            ([0.18; 3], [0.14; 3]),
            ([0.8; 3], [0.76; 3]),
            ([1.0; 3], [0.869_090_9; 3]),
            ([2.0; 3], [0.96; 3]),
            ([0.8, 0.2, 0.05], [0.765_496_2, 0.165_608_7, 0.015_636_9]),
            ([4.0, 1.0, 0.5], [0.983_255_8, 0.468_299_2, 0.382_473_1]),
        ] {
            let got = neutral(input.into()).to_array();
            for (g, e) in got.iter().zip(expected) {
                assert!((g - e).abs() < 2e-6, "{input:?}: {got:?}, not {expected:?}");
            }
        }
        assert_eq!(shown(ToneCurve::Neutral, [0.18; 3]), [105; 3]);
        assert_eq!(shown(ToneCurve::Neutral, [4.0, 1.0, 0.5]), [253, 182, 166]);
    }

    #[test]
    fn neutral_shows_a_lit_base_colour_as_it_was_picked() {
        // A rough dielectric under white light reflects its base colour and about 4% more.
        let base = [0.5, 0.3, 0.2];
        let lit = base.map(|c| c + 0.04);
        assert_eq!(shown(ToneCurve::Neutral, lit), shown(ToneCurve::Srgb, base));
    }

    #[test]
    fn agx_has_the_values_of_its_formulas() {
        // Computed in f64 with the published matrices and the sigmoid's general form, its scales worked out there.
        for (input, expected) in [
            ([0.0; 3], [0.0; 3]),
            ([0.5; 3], [172.661, 172.689, 172.69]),
            ([1.0; 3], [200.788, 200.824, 200.826]),
            ([16.3; 3], [254.956, 255.0, 255.0]),
            ([0.8, 0.2, 0.05], [200.183, 136.035, 90.166]),
            ([0.0, 0.0, 4.0], [144.347, 144.345, 249.429]),
            ([10.0, 0.1, 0.1], [255.0, 170.312, 170.357]),
        ] {
            let got = agx(input.into()).map(|v| 255.0 * v).to_array();
            for (g, e) in got.iter().zip(expected) {
                assert!((g - e).abs() < 2e-3, "{input:?}: {got:?}, not {expected:?}");
            }
        }
    }

    #[test]
    fn agx_puts_middle_grey_in_the_middle_and_reaches_both_ends() {
        assert!((agx_sigmoid(20.0 / 33.0) - 0.5).abs() < 1e-6);
        assert!(agx_sigmoid(0.0) < 1e-6 && agx_sigmoid(1.0) > 1.0 - 1e-6);
        for code in shown(ToneCurve::Agx, [0.18; 3]) {
            assert!(code.abs_diff(128) <= 1);
        }
    }

    #[test]
    fn agx_matrices_are_inverse() {
        for (i, axis) in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].into_iter().enumerate() {
            let back = apply(&OUTSET, apply(&INSET, axis.into())).to_array();
            for (j, value) in back.into_iter().enumerate() {
                assert!((value - if i == j { 1.0 } else { 0.0 }).abs() < 1e-6, "{back:?}");
            }
        }
    }

    #[test]
    fn greys_rise_through_every_curve_and_end_white() {
        for tone in TONES {
            let mut last = [0; 3];
            for step in -400..=200 {
                let now = shown(tone, [libm::exp2f(step as f32 / 20.0); 3]);
                for c in 0..3 {
                    assert!(now[c] >= last[c], "{tone:?} falls at 2^({step}/20)");
                }
                last = now;
            }
            assert_eq!(last, [255; 3], "{tone:?}");
            assert_eq!(shown(tone, [f32::MAX; 3]), [255; 3], "{tone:?}");
            assert_eq!(shown(tone, [0.0; 3]), [0; 3], "{tone:?}");
            assert_eq!(shown(tone, [-1.0; 3]), [0; 3], "{tone:?}");
        }
    }

    #[test]
    fn exposure_counts_in_stops() {
        for tone in TONES {
            let brighter = Display { tone, exposure: 3.0 };
            let darker = Display { tone, exposure: -1.0 };
            assert_eq!(tone_map(Rgb::new(0.02, 0.1, 0.05), &brighter), shown(tone, [0.16, 0.8, 0.4]));
            assert_eq!(tone_map(Rgb::new(0.02, 0.1, 0.05), &darker), shown(tone, [0.01, 0.05, 0.025]));
        }
    }

    #[test]
    fn what_is_not_finite_is_magenta_and_what_is_only_large_is_not() {
        for tone in TONES {
            for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                assert_eq!(shown(tone, [0.5, bad, 0.5]), NOT_FINITE);
            }
            let bright = Display { tone, exposure: 32.0 };
            assert_eq!(tone_map(Rgb::grey(f32::MAX), &bright), [255; 3]);
            let broken = Display { tone, exposure: f32::NAN };
            assert_eq!(tone_map(Rgb::grey(0.5), &broken), NOT_FINITE);
        }
    }

    #[test]
    fn a_whole_picture_is_mapped_pixel_by_pixel() {
        let pixels = CHUNK + 77;
        let plane = |k: usize| -> Vec<f32> { (0..pixels).map(|i| ((i * k) % 997) as f32 / 300.0).collect() };
        let (r, g, b) = (plane(3), plane(7), plane(11));
        let display = Display::default();
        let codes = to_srgb8([&r, &g, &b], &display);
        assert_eq!(codes.len(), 3 * pixels);
        for i in (0..pixels).step_by(61).chain([CHUNK - 1, CHUNK, pixels - 1]) {
            assert_eq!(codes[3 * i..3 * i + 3], tone_map(Rgb::new(r[i], g[i], b[i]), &display));
        }
    }
}
