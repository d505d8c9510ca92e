//! The colours of UAVs, the same in 3D, in plots, on maps and in figures.
//!
//! Never gives two of the first eight UAVs colours that a colour-blind person could confuse.

use foxglove::messages::Color;

/// The colours of Okabe and Ito, with a grey instead of their black so that all show on dark and on light backgrounds.
const OKABE_ITO: [Rgb; 8] = [
    Rgb { red: 0xe6, green: 0x9f, blue: 0x00 },
    Rgb { red: 0x56, green: 0xb4, blue: 0xe9 },
    Rgb { red: 0x00, green: 0x9e, blue: 0x73 },
    Rgb { red: 0xf0, green: 0xe4, blue: 0x42 },
    Rgb { red: 0x00, green: 0x72, blue: 0xb2 },
    Rgb { red: 0xd5, green: 0x5e, blue: 0x00 },
    Rgb { red: 0xcc, green: 0x79, blue: 0xa7 },
    Rgb { red: 0x99, green: 0x99, blue: 0x99 },
];

/// For normal things: the formation, a link with fresh data.
pub const CALM: Rgb = OKABE_ITO[1];
/// For obstacles and for things that are wrong.
pub const ALARM: Rgb = OKABE_ITO[5];
/// For reference lines.
pub const QUIET: Rgb = OKABE_ITO[7];
/// For names and things that must stand out on a dark background.
pub const BRIGHT: Rgb = Rgb { red: 0xff, green: 0xff, blue: 0xff };

/// A colour as screens mix it, each part from 0 to 255.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rgb {
    /// Red.
    pub red: u8,
    /// Green.
    pub green: u8,
    /// Blue.
    pub blue: u8,
}

/// The colour of UAV number `uav`, from 1. The eight colours repeat, first lighter, then darker.
pub fn colour(uav: u32) -> Rgb {
    let index = uav.saturating_sub(1) as usize;
    let plain = OKABE_ITO[index % OKABE_ITO.len()];
    match index / OKABE_ITO.len() % 3 {
        0 => plain,
        1 => plain.mixed_with(BRIGHT, 0.5),
        _ => plain.mixed_with(Rgb { red: 0, green: 0, blue: 0 }, 0.4),
    }
}

impl Rgb {
    /// The colour in style sheets: `#e69f00`.
    pub fn hex(self) -> String {
        format!("#{:02x}{:02x}{:02x}", self.red, self.green, self.blue)
    }

    /// A mixture with `share` of `other`, from 0 (this colour) to 1.
    pub fn mixed_with(self, other: Self, share: f64) -> Self {
        // Ages beyond the limit ask for a share above 1.
        let mix = |own: u8, its: u8| {
            (f64::from(own) + share.clamp(0.0, 1.0) * (f64::from(its) - f64::from(own))).round() as u8
        };
        Self {
            red: mix(self.red, other.red),
            green: mix(self.green, other.green),
            blue: mix(self.blue, other.blue),
        }
    }

    /// The colour in scenes, with an `opacity` from 0 to 1.
    pub(crate) fn in_scene(self, opacity: f64) -> Color {
        let share = |part: u8| f64::from(part) / 255.0;
        Color { r: share(self.red), g: share(self.green), b: share(self.blue), a: opacity }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn the_first_24_uavs_have_different_colours() {
        let colours: BTreeSet<_> = (1..=24).map(|uav| colour(uav).hex()).collect();
        assert_eq!(colours.len(), 24);
        assert_eq!((colour(1).hex(), colour(25).hex()), ("#e69f00".into(), "#e69f00".into()));
    }

    #[test]
    fn mixing_never_goes_beyond_either_colour() {
        let (one, other) = (colour(1), colour(2));
        assert_eq!((one.mixed_with(other, -1.0), one.mixed_with(other, 2.0)), (one, other));
        assert_eq!(BRIGHT.in_scene(0.5), Color { r: 1.0, g: 1.0, b: 1.0, a: 0.5 });
    }
}
