//! An animated SVG: marks that move over a ground, with captions and a clock.
//!
//! Every browser and every page that shows SVG plays it, without a script. Must never know what moves: callers hand in
//! places, colours and text.

use crate::{colour::hex, extent::Extent, html::escaped};
use plotters::style::RGBColor;
use std::{f64::consts::PI, fmt::Write};

/// Width of the picture, in pixels. Wider ones are scaled down with their text on most pages.
const WIDTH: f64 = 800.0;
/// Largest height of the part in which marks move, in pixels, so that the picture fits a screen.
const HEIGHT_MAX: f64 = 600.0;
/// Height of the strip with clock and captions.
const STRIP: f64 = 44.0;
/// Distance of the lines on the ground, in the unit of the places. Closer ones flicker when the ground moves fast.
const GRID: f64 = 20.0;
/// Time for which the last moment stays before the picture begins again, in seconds.
const REST_S: f64 = 2.0;

/// Where a mark is and where it heads, at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// To the right.
    pub x: f64,
    /// Upwards.
    pub y: f64,
    /// From the x axis, counterclockwise, in rad.
    pub heading_rad: f64,
}

/// What moves.
#[derive(Debug, Clone)]
pub struct Mover {
    /// Written beside it.
    pub name: String,
    /// Its colour.
    pub colour: RGBColor,
    /// Where it is in each frame; where it was last if it is nowhere, and then it is not shown.
    pub places: Vec<Option<Place>>,
    /// Whether it is full, or else hollow, in each frame.
    pub is_full: Vec<bool>,
}

/// A circle that moves.
#[derive(Debug, Clone)]
pub struct Disc {
    /// Its radius, in the unit of the places.
    pub radius: f64,
    /// Its colour.
    pub colour: RGBColor,
    /// Its centre in each frame.
    pub centres: Vec<(f64, f64)>,
}

/// A line of text from a moment on, until the next caption.
#[derive(Debug, Clone, PartialEq)]
pub struct Caption {
    /// The moment, as a share of the whole time from 0 to 1.
    pub at: f64,
    /// The text.
    pub text: String,
}

/// The picture. All lists of frames have the same length.
#[derive(Debug, Clone, Default)]
pub struct Animation {
    /// What moves; later ones cover earlier ones.
    pub movers: Vec<Mover>,
    /// Circles behind it.
    pub discs: Vec<Disc>,
    /// The corners of a closed line in each frame, always equally many.
    pub outline: Vec<Vec<(f64, f64)>>,
    /// How far the ground has moved in each frame.
    pub ground: Vec<(f64, f64)>,
    /// What is written below, in order.
    pub captions: Vec<Caption>,
    /// The text of the clock in each frame.
    pub clock: Vec<String>,
    /// The time that all frames take, in seconds.
    pub seconds: f64,
}

/// Converts places to pixels.
struct View {
    left: f64,
    top: f64,
    scale: f64,
    height: f64,
}

impl View {
    /// Shows every place of full movers.
    fn of(movers: &[Mover]) -> Self {
        let shown = || {
            // A hollow mark may fly away for good, and a view that followed it would make all others tiny.
            let full = |mover: &Mover| -> Vec<Place> {
                let both = mover.places.iter().zip(&mover.is_full);
                both.filter(|(_, full)| **full).filter_map(|(place, _)| *place).collect()
            };
            movers.iter().flat_map(full)
        };
        let x = Extent::of(shown().map(|place| place.x)).padded(0.06, 60.0);
        let y = Extent::of(shown().map(|place| place.y)).padded(0.1, 30.0);
        let scale = (WIDTH / x.size()).min(HEIGHT_MAX / y.size());
        // A high picture is as wide as the others, so that it has room on both sides.
        let left = x.low - (WIDTH / scale - x.size()) / 2.0;
        Self { left, top: y.high, scale, height: scale * y.size() }
    }

    fn pixels(&self, (x, y): (f64, f64)) -> (f64, f64) {
        ((x - self.left) * self.scale, (self.top - y) * self.scale)
    }
}

impl Animation {
    /// The picture as SVG.
    pub fn svg(&self) -> String {
        let view = View::of(&self.movers);
        let (seconds, height) = (self.seconds + REST_S, view.height + STRIP);
        let timing = Timing { seconds, moving: self.seconds / seconds };
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height:.0}\" width=\"{WIDTH}\" \
             height=\"{height:.0}\" font-family=\"sans-serif\" font-size=\"13\">\n"
        );
        // SVG paints in this order. The strip comes last and covers marks that leave the view at the bottom.
        self.draw_ground(&mut svg, &view, timing);
        for disc in &self.discs {
            draw_disc(&mut svg, disc, &view, timing);
        }
        self.draw_outline(&mut svg, &view, timing);
        for mover in &self.movers {
            draw_mover(&mut svg, mover, &view, timing);
        }
        self.draw_strip(&mut svg, view.height, timing);
        svg + "</svg>\n"
    }

    /// A grid that moves, so that a formation at rest seems to fly.
    fn draw_ground(&self, svg: &mut String, view: &View, timing: Timing) {
        let step = GRID * view.scale;
        // The grid repeats itself, so a shift by whole steps may be left out, but only by the same one in all frames.
        let shift = |(x, y): &(f64, f64)| format!("{:.1} {:.1}", x * view.scale, -y * view.scale);
        let moved = timing.transform("patternTransform", "translate", self.ground.iter().map(shift));
        let _ = write!(
            svg,
            "<pattern id=\"ground\" width=\"{step:.1}\" height=\"{step:.1}\" patternUnits=\"userSpaceOnUse\">\
             <path d=\"M{step:.1} 0H0V{step:.1}\" fill=\"none\" stroke=\"#d4d4d4\"/>{moved}</pattern>\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\
             <rect width=\"100%\" height=\"{:.0}\" fill=\"url(#ground)\"/>\n",
            view.height
        );
    }

    fn draw_outline(&self, svg: &mut String, view: &View, timing: Timing) {
        let corners = |corners: &Vec<(f64, f64)>| {
            let corner = |corner: &(f64, f64)| {
                let (x, y) = view.pixels(*corner);
                format!("{x:.1},{y:.1}")
            };
            corners.iter().map(corner).collect::<Vec<_>>().join(" ")
        };
        let moved = timing.values("animate attributeName=\"points\"", self.outline.iter().map(corners));
        let _ =
            writeln!(svg, "<polygon fill=\"none\" stroke=\"#999\" stroke-width=\"1.5\">{moved}</polygon>");
    }

    /// The clock, the captions and how much of the flight is over.
    fn draw_strip(&self, svg: &mut String, top: f64, timing: Timing) {
        let (line, text) = (top + 8.0, top + 31.0);
        let grown = timing.values("animate attributeName=\"width\"", ["0".to_owned(), format!("{WIDTH}")]);
        let _ = writeln!(
            svg,
            "<rect y=\"{top:.0}\" width=\"100%\" height=\"{STRIP}\" fill=\"#fff\"/>\
             <rect y=\"{:.0}\" width=\"{WIDTH}\" height=\"4\" fill=\"#ddd\"/>\
             <rect y=\"{:.0}\" width=\"0\" height=\"4\" fill=\"#777\">{grown}</rect>",
            line - 2.0,
            line - 2.0
        );
        for caption in &self.captions {
            let x = caption.at * WIDTH;
            let _ = writeln!(
                svg,
                "<path d=\"M{x:.1} {:.0}v10\" stroke=\"#d55e00\" stroke-width=\"3\"/>",
                line - 5.0
            );
        }
        // 2 is past the end of a picture that moves for longer than it rests, so the last caption stays.
        let ends = self.captions.iter().skip(1).map(|next| next.at).chain([2.0]);
        for (caption, end) in self.captions.iter().zip(ends) {
            let shown = timing.shown(caption.at, end);
            let words = escaped(&caption.text);
            let _ = writeln!(
                svg,
                "<text x=\"90\" y=\"{text:.0}\" fill=\"#d55e00\" opacity=\"0\">{words}{shown}</text>"
            );
        }
        self.draw_clock(svg, text, timing);
    }

    /// Each text of the clock for as long as it is the same.
    fn draw_clock(&self, svg: &mut String, y: f64, timing: Timing) {
        let frames = self.clock.len().max(1) as f64;
        let mut begin = 0;
        for texts in self.clock.chunk_by(|a, b| a == b) {
            let end = begin + texts.len();
            // The last text stays while the picture rests, as the last caption does.
            let until = if end == self.clock.len() { 2.0 } else { end as f64 / frames };
            let shown = timing.shown(begin as f64 / frames, until);
            let text = escaped(texts.first().map_or("", String::as_str));
            let _ = writeln!(svg, "<text x=\"12\" y=\"{y:.0}\" opacity=\"0\">{text}{shown}</text>");
            begin = end;
        }
    }
}

/// How the frames are spread over the time of the picture.
#[derive(Clone, Copy)]
struct Timing {
    /// The time after which it begins again.
    seconds: f64,
    /// The share of it in which something moves.
    moving: f64,
}

impl Timing {
    /// `element` with a value for each frame, and the last one until the picture begins again.
    fn values(self, element: &str, values: impl IntoIterator<Item = String>) -> String {
        let mut values: Vec<String> = values.into_iter().collect();
        values.extend(values.last().cloned());
        // At least 1, because a picture of a single frame would divide by zero.
        let last = values.len().saturating_sub(2).max(1) as f64;
        let time = |index: usize| self.moving * (index as f64 / last).min(1.0);
        let mut times: Vec<String> =
            (1..values.len()).map(|index| format!("{:.4}", time(index - 1))).collect();
        // Browsers ignore an animation whose last key time is not exactly 1.
        times.push("1".into());
        format!(
            "<{element} dur=\"{:.1}s\" repeatCount=\"indefinite\" keyTimes=\"{}\" values=\"{}\"/>",
            self.seconds,
            times.join(";"),
            values.join(";")
        )
    }

    fn transform(self, attribute: &str, kind: &str, values: impl Iterator<Item = String>) -> String {
        self.values(&format!("animateTransform attributeName=\"{attribute}\" type=\"{kind}\""), values)
    }

    /// Makes its parent visible between two shares of the moving time.
    fn shown(self, from: f64, until: f64) -> String {
        // Whatever is shown to the end stays while the picture rests, however short the movement is.
        let end = if until > 1.0 { 1.0 } else { until * self.moving };
        let (from, until) = (from * self.moving, end);
        // Key times have to begin with 0, so the state before `from` needs a value of its own.
        let (mut times, mut values) = (vec![0.0], vec![u8::from(from <= 0.0)]);
        for (time, value) in [(from, 1), (until, 0)] {
            if time > 0.0 && time < 1.0 {
                times.push(time);
                values.push(value);
            }
        }
        let times: Vec<String> = times.iter().map(|time| format!("{time:.4}")).collect();
        let values: Vec<String> = values.iter().map(u8::to_string).collect();
        format!(
            "<animate attributeName=\"opacity\" calcMode=\"discrete\" dur=\"{:.1}s\" repeatCount=\"indefinite\" \
             keyTimes=\"{}\" values=\"{}\"/>",
            self.seconds,
            times.join(";"),
            values.join(";")
        )
    }
}

fn draw_disc(svg: &mut String, disc: &Disc, view: &View, timing: Timing) {
    let place = |centre: &(f64, f64)| {
        let (x, y) = view.pixels(*centre);
        format!("{x:.1} {y:.1}")
    };
    let moved = timing.transform("transform", "translate", disc.centres.iter().map(place));
    let _ = writeln!(
        svg,
        "<circle r=\"{:.1}\" fill=\"{}\" fill-opacity=\"0.5\">{moved}</circle>",
        disc.radius * view.scale,
        hex(disc.colour)
    );
}

/// An arrow head with its name beside it.
fn draw_mover(svg: &mut String, mover: &Mover, view: &View, timing: Timing) {
    let places = held(&mover.places);
    let at = |place: &Place| {
        let (x, y) = view.pixels((place.x, place.y));
        format!("{x:.1} {y:.1}")
    };
    let moved = timing.transform("transform", "translate", places.iter().map(at));
    // Pixels grow downwards, so a turn to the left is a negative angle.
    let angles = unwound(places.iter().map(|place| place.heading_rad)).into_iter();
    let turned =
        timing.transform("transform", "rotate", angles.map(|angle| format!("{:.1}", -angle.to_degrees())));
    let colour = hex(mover.colour);
    let fill = |full: &bool| if *full { colour.clone() } else { "#fff".into() };
    let filled =
        timing.values("animate attributeName=\"fill\" calcMode=\"discrete\"", mover.is_full.iter().map(fill));
    let _ = writeln!(
        svg,
        "<g>{moved}<path d=\"M13 0L-8 7L-4 0L-8 -7Z\" fill=\"{colour}\" stroke=\"{colour}\" stroke-width=\"2\">{turned}\
         {filled}</path><text x=\"10\" y=\"-10\" fill=\"{colour}\">{}</text></g>",
        escaped(&mover.name)
    );
}

/// The places; a mark that is nowhere keeps the place that it had last.
fn held(places: &[Option<Place>]) -> Vec<Place> {
    // Before its first place a mark waits there: with fewer values than frames it would run ahead of the others.
    let mut last = places.iter().flatten().next().copied();
    places
        .iter()
        .filter_map(|place| {
            last = place.or(last);
            last
        })
        .collect()
}

/// The angles without jumps by a whole turn, which would spin the mark.
fn unwound(angles: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut last = 0.0;
    angles
        .map(|angle| {
            last = angle + 2.0 * PI * ((last - angle) / (2.0 * PI)).round();
            last
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn animation() -> Animation {
        let place = |x: f64| Some(Place { x, y: 0.0, heading_rad: 3.0 });
        Animation {
            movers: vec![Mover {
                name: "a<b".into(),
                colour: RGBColor(1, 2, 3),
                places: vec![place(0.0), None, place(100.0)],
                is_full: vec![true, true, false],
            }],
            outline: vec![vec![(0.0, 0.0)]; 3],
            ground: vec![(0.0, 0.0); 3],
            captions: vec![Caption { at: 0.5, text: "now".into() }],
            clock: ["0 s", "0 s", "1 s"].map(str::to_owned).into(),
            seconds: 3.0,
            ..Animation::default()
        }
    }

    #[test]
    fn a_picture_has_a_value_for_each_frame_and_rests_at_the_end() {
        let svg = animation().svg();
        assert!(svg.contains("keyTimes=\"0.0000;0.3000;0.6000;1\""), "{svg}");
        assert!(svg.contains("values=\"#010203;#010203;#fff;#fff\""), "{svg}");
        assert!(svg.contains("a&lt;b") && svg.contains(">now<"), "{svg}");
        assert_eq!(svg.matches(">0 s<").count() + svg.matches(">1 s<").count(), 2);
    }

    #[test]
    fn what_is_shown_to_the_end_stays_while_a_short_picture_rests() {
        let svg = Animation { seconds: 1.0, ..animation() }.svg();
        // A third of the picture moves, and the caption comes in the middle of that.
        assert!(svg.contains("keyTimes=\"0.0000;0.1667\" values=\"0;1\""), "{svg}");
    }

    #[test]
    fn a_mark_that_is_nowhere_stays_and_never_spins() {
        let places = held(&animation().movers[0].places);
        assert_eq!(places[1], places[0]);
        let angles = unwound([3.0, -3.0, 3.0].into_iter());
        assert!((angles[1] - angles[0]).abs() < 0.4 && (angles[2] - angles[1]).abs() < 0.4, "{angles:?}");
    }
}
